"""The table of data that a page carries."""

from __future__ import annotations

import numpy as np

from phasmid.recording import Recording
from phasmid.recording.ros import rows_at
from phasmid.recording.table import columns, text_cell
from phasmid.reporting.source import Source

RATE = 50.0
"""Most rows a second."""

MOST_CELLS = 400_000
"""Most numbers in the table: a longer run has fewer rows a second."""


def data_table(recording: Recording, source: Source) -> tuple[bytes, float]:
    """Return a recording as comma-separated values of six digits, and its rows per second.

    Texts are quoted and safe in a spreadsheet.

    Args:
        recording: The recording.
        source: Its robot and experiment.
    """
    time = np.asarray(recording["time"].values)
    length = max(float(time[-1] - time[0]), 1e-9)
    width = len(columns(recording.isel(time=slice(0, 1)), source.robot.leg_names))
    rate = min(RATE, MOST_CELLS / width / length)
    rows = rows_at(time, rate)
    table = columns(recording.isel(time=rows), source.robot.leg_names)
    heading = ",".join('"' + text_cell(name).replace('"', '""') + '"' for name in table)
    numbers = np.column_stack([values.astype(float) for values in table.values()])
    line = ",".join(["%.6g"] * len(table))
    lines = [heading, *(line % tuple(row) for row in numbers.tolist())]
    taken = 1 / float(np.diff(time[rows]).mean()) if len(rows) > 1 else 0.0
    return ("\n".join(lines) + "\n").encode(), taken
