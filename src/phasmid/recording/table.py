"""Recordings as CSV tables: one row per sample, one column per number."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from phasmid.errors import plain
from phasmid.recording.channels import CHANNELS, COORDINATES
from phasmid.recording.file import whole_file
from phasmid.recording.recording import Recording
from phasmid.recording.ros import names_of_legs

FORMULA = re.compile(r'(^\s*|[;,|"]\s*)([=+\-@＝＋－＠])')
"""Places where a spreadsheet runs a text as a formula: at its beginning, and after a separator, at
which some spreadsheets begin a cell inside quotes too; full-width letters included."""

PLAIN_UNITS = str.maketrans({"·": " ", "²": "^2", "°": "deg"})
"""Units in ASCII, such as ``kg m^2``."""


def columns(recording: Recording, leg_names: Sequence[str] | None = None) -> dict[str, np.ndarray]:
    """Return the columns of a recording.

    Args:
        recording: The recording.
        leg_names: Names of the legs in order; ``leg1``, ``leg2`` and so on by default.

    Returns:
        Arrays of shape (N,) by heading, such as ``joint_torque.right_front.coxa [N m]``, in the
        order of the channels after time.
    """
    time = np.asarray(recording["time"].values)
    found: dict[str, np.ndarray] = {"time [s]": time}
    legs = [plain(name) for name in names_of_legs(recording, leg_names)]
    for name in recording.data_vars:
        channel = CHANNELS[str(name)]
        values = np.asarray(recording[name].values)
        labels = [legs if dim == "leg" else COORDINATES[dim] for dim in channel.dims[1:]]
        unit = channel.units.translate(PLAIN_UNITS)
        for index in np.ndindex(*values.shape[1:]):
            parts = [labels[axis][place] for axis, place in enumerate(index)]
            found[f"{'.'.join([str(name), *parts])} [{unit}]"] = values[:, *index]
    return found


def save_csv(
    recording: Recording, path: str | Path, *, leg_names: Sequence[str] | None = None
) -> None:
    """Write a recording as comma-separated values in UTF-8, with units in the heading.

    Numbers have as many digits as their bits need; booleans are 1 and 0. Headings are in quotes;
    one that a spreadsheet would run as a formula begins with an apostrophe.

    Args:
        recording: The recording.
        path: The file, by custom ``.csv``; an older one is replaced.
        leg_names: Names of the legs in order; ``leg1``, ``leg2`` and so on by default.

    Raises:
        OutputError: The file cannot be written; nothing is left behind.
    """
    # Lazy import: pandas takes 0.3 s.
    import pandas

    path = Path(path)
    table = columns(recording, leg_names)
    numbers = {
        text_cell(name): values.astype(int) if values.dtype == np.bool_ else values
        for name, values in table.items()
    }
    with whole_file(path) as file:
        pandas.DataFrame(numbers).to_csv(
            file, index=False, quoting=csv.QUOTE_NONNUMERIC, na_rep="nan", lineterminator="\n"
        )


def text_cell(text: str) -> str:
    """Return a text as a cell that no spreadsheet runs as a formula."""
    return FORMULA.sub(r"\1'\2", plain(text))
