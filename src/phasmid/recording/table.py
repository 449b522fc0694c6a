"""A recording as one table, a row for each sample and a column for each number, for others."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from phasmid.arguments import path_of
from phasmid.errors import InvalidInput, plain
from phasmid.recording.channels import CHANNELS, COORDINATES
from phasmid.recording.file import whole_file
from phasmid.recording.recording import Recording, check_recording
from phasmid.recording.ros import names_of_legs

BLOCK = 4096
"""Rows that are text at the same time."""

FORMULA = re.compile(r'(^\s*|[;,|"]\s*)([=+\-@＝＋－＠])')
"""Where a spreadsheet would run a text: its beginning, and what follows a letter at which some
spreadsheets begin a cell, whatever the quotes say; full-width letters too."""

PLAIN_UNITS = str.maketrans({"·": " ", "²": "^2", "°": "deg"})
"""Units in letters that every program reads, as in ``kg m^2``."""


def columns(recording: Recording, leg_names: Sequence[str] | None = None) -> dict[str, np.ndarray]:
    """The recording's numbers, column by column.

    Args:
        recording: What was seen.
        leg_names: Of its legs, in order; ``leg1``, ``leg2`` and so on by default.

    Returns:
        By heading an array of shape (N,), time first, then the channels in their order, such as
        ``joint_torque.right_front.coxa [N m]``; yes and no are ``bool``.
    """
    time = np.asarray(recording["time"].values)
    found: dict[str, np.ndarray] = {"time [s]": time}
    legs = _plain_names(recording, leg_names)
    for name in recording.data_vars:
        channel = CHANNELS[str(name)]
        values = np.asarray(recording[name].values)
        labels = [legs if dim == "leg" else COORDINATES[dim] for dim in channel.dims[1:]]
        unit = channel.units.translate(PLAIN_UNITS)
        for index in np.ndindex(*values.shape[1:]):
            parts = [labels[axis][place] for axis, place in enumerate(index)]
            found[f"{'.'.join([str(name), *parts])} [{unit}]"] = values[:, *index]
    return found


def _plain_names(recording: Recording, given: Sequence[str] | None) -> list[str]:
    names = [plain(name) for name in names_of_legs(recording, given)]
    # Names that differ in unprintable letters alone would make columns of one heading.
    alike = len(set(names)) < len(names)
    return [f"{n}#{k}" for k, n in enumerate(names, 1)] if alike else names


def save_csv(
    recording: Recording, path: str | Path, *, leg_names: Sequence[str] | None = None
) -> None:
    """Write a recording as comma-separated values in UTF-8, with its units in the heading.

    Numbers have as many digits as tell them from all others, so that reading them gives the same
    bits; yes and no are 1 and 0. All text is in quotes, and what a spreadsheet would take for a
    formula begins with an apostrophe.

    Args:
        recording: What was seen.
        path: The file, by custom ``.csv``; an older one is replaced.
        leg_names: Of its legs, in order; ``leg1``, ``leg2`` and so on by default.

    Raises:
        OutputError: The file cannot be written; nothing is left behind.
    """
    check_recording(recording)
    path = path_of("path", path)
    table = columns(recording, leg_names)
    with whole_file(path) as file:
        head = io.StringIO()
        writer = csv.writer(head, quoting=csv.QUOTE_ALL, lineterminator="\n")
        writer.writerow([text_cell(name) for name in table])
        file.write(head.getvalue().encode())
        count = len(table["time [s]"])
        for start in range(0, count, BLOCK):
            cells = [_digits(values[start : start + BLOCK]) for values in table.values()]
            lines = "".join(f"{','.join(row)}\n" for row in zip(*cells, strict=True))
            file.write(lines.encode())


def text_cell(text: str) -> str:
    """A text as a cell that no spreadsheet takes for a formula.

    Args:
        text: Names in files may be anything.
    """
    return FORMULA.sub(r"\1'\2", plain(text))


def _digits(values: np.ndarray) -> list[str]:
    if values.dtype == np.bool_:
        return ["1" if value else "0" for value in values.tolist()]
    return [repr(value) for value in values.tolist()]


def save_parquet(
    recording: Recording, path: str | Path, *, leg_names: Sequence[str] | None = None
) -> None:
    """Write a recording as one Parquet table; its attributes become the file's metadata.

    Args:
        recording: What was seen.
        path: The file, by custom ``.parquet``; an older one is replaced.
        leg_names: Of its legs, in order; ``leg1``, ``leg2`` and so on by default.

    Raises:
        InvalidInput: The extra ``parquet`` is not installed.
        OutputError: The file cannot be written; nothing is left behind.
    """
    check_recording(recording)
    path = path_of("path", path)
    check_parquet()
    import pyarrow
    from pyarrow import parquet

    arrays = {name: pyarrow.array(values) for name, values in columns(recording, leg_names).items()}
    attributes: dict[Any, Any] = {name: str(value) for name, value in recording.attrs.items()}
    table = pyarrow.table(arrays, metadata=attributes)
    with whole_file(path) as file:
        parquet.write_table(table, file)


def check_parquet() -> None:
    """Refuse to write Parquet files where nothing can.

    Raises:
        InvalidInput: The extra ``parquet`` is not installed.
    """
    try:
        import_module("pyarrow.parquet")
    except ImportError as error:
        raise InvalidInput(
            "a Parquet file needs the package pyarrow, which was not found.",
            hint='pip install "phasmid[parquet]", or --format csv',
        ) from error
