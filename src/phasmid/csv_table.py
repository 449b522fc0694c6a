"""Tables of text with a heading: trajectories and logs as CSV files."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, own_words

if TYPE_CHECKING:
    import pandas

LARGEST_FILE = 200_000_000
"""Files above this many bytes are refused before they are read."""

MOST_ROWS = 1_000_000
"""Most rows of a table: at 1 kHz a quarter of an hour."""


def check_size(path: Path, what: str) -> None:
    """Refuse a file that is too large to read.

    Args:
        path: The file.
        what: Kind of its content, such as ``trajectory``, for the message.

    Raises:
        InvalidInput: It has more than `LARGEST_FILE` bytes.
    """
    size = path.stat().st_size
    if size > LARGEST_FILE:
        raise InvalidInput(f"{path} holds {size} bytes; a {what} holds at most {LARGEST_FILE}.")


def read_csv_table(path: Path, what: str) -> pandas.DataFrame:
    """Read a CSV file; an empty one gives a table without columns.

    Args:
        path: The file.
        what: Kind of its content, such as ``trajectory``, for messages.

    Returns:
        The table; the names of its columns are free of outer blanks.

    Raises:
        InvalidInput: It is no table of text, has rows longer than the heading, or no row below it,
            or too many.
    """
    # Lazy import: pandas takes 0.3 s.
    import pandas

    try:
        # As many columns as the heading: otherwise pandas takes longer rows for an index.
        with warnings.catch_warnings(action="error", category=pandas.errors.ParserWarning):
            frame = pandas.read_csv(path, index_col=False, encoding="utf-8-sig", low_memory=False)
    except pandas.errors.EmptyDataError:
        frame = pandas.DataFrame()
    except pandas.errors.ParserWarning:
        raise InvalidInput(f"{what} has rows of more cells than the heading.") from None
    except Exception as error:
        # A damaged file can raise any exception.
        raise InvalidInput(
            f"{path.name} is not a table of text{own_words(error)}.",
            hint="UTF-8, with commas between cells and every quote closed",
        ) from None
    if len(frame.columns) and frame.empty:
        raise InvalidInput(f"{what} has a heading and no row below it.")
    if len(frame) > MOST_ROWS:
        raise InvalidInput(f"{what} has more than {MOST_ROWS} rows.")
    frame.columns = [str(name).strip() for name in frame]
    return frame


def check_times(time: Float[np.ndarray, " rows"]) -> None:
    """Refuse times of a log that are not finite or do not increase.

    Args:
        time: One per row [s], shape (N,).

    Raises:
        InvalidInput: With the first such row, counted from 1 below the heading.
    """
    wrong = np.flatnonzero(~np.isfinite(time))
    if len(wrong):
        raise InvalidInput(f"log row {wrong[0] + 1}: time is not a finite number.")
    late = np.flatnonzero(np.diff(time) <= 0)
    if len(late):
        row = late[0] + 1
        raise InvalidInput(
            f"log row {row + 1}: time {time[row]:g} s does not follow {time[row - 1]:g} s."
        )
