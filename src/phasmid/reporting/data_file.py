"""Recordings in the files of other programs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from phasmid.arguments import checked
from phasmid.errors import InvalidInput, nearest, plain
from phasmid.recording import (
    CHANNELS,
    Recording,
    check_time,
    save_csv,
    save_mcap,
    save_recording,
)
from phasmid.recording.file import check_new_file
from phasmid.recording.ros import rows_at
from phasmid.reporting.run import read_run

ENDINGS = (".csv", ".nc", ".mcap")
"""Endings of the files that can be written."""

MCAP_RATE = 100.0
"""Default of the most messages of a topic per second [1/s]."""


@checked
def export(
    recording: Recording,
    path: str | Path,
    *,
    channels: Sequence[str] | None = None,
    rate: float | None = None,
    force: bool = False,
) -> Path:
    """Write a recording as a file that other programs read.

    Args:
        recording: The recording.
        path: The file; its ending selects the format: ``.csv``, ``.nc`` or ``.mcap``.
        channels: Names of the channels that are written; by default all.
        rate: Most samples per second [1/s]; by default all, of MCAP 100.
        force: Replace an older file of that name.

    Returns:
        The file.

    Raises:
        InvalidInput: The file exists; there is no such format or channel.
        OutputError: The file cannot be written; nothing is left behind.
    """
    path = Path(path)
    ending = check_export(path, force=force)
    if rate is not None and not 0 < rate < np.inf:
        raise InvalidInput(f"rate is {rate}; it must be a finite number greater than 0.")
    names = read_run(recording).robot.leg_names if "robot" in recording.attrs else None
    chosen = _chosen(recording, channels)
    if rate is not None and ending != ".mcap":
        rows = rows_at(np.asarray(chosen["time"].values), rate)
        chosen = chosen.isel(time=rows)
    if ending == ".mcap":
        save_mcap(chosen, path, leg_names=names, rate=rate or MCAP_RATE)
    elif ending == ".nc":
        save_recording(chosen, path)
    else:
        save_csv(chosen, path, leg_names=names)
    return path


def check_export(path: str | Path, *, force: bool = False) -> str:
    """Return the ending of a file, or raise where `export` could not write it.

    Args:
        path: The file.
        force: Replace an older file of that name.

    Raises:
        InvalidInput: It exists and may not be replaced; its ending belongs to no format.
        OutputError: The name is impossible.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        hint = f'"{path.with_suffix(".csv")}"' if path.name else "walk.csv"
        raise InvalidInput(f'"{path}" does not end in {", ".join(ENDINGS)}; it must.', hint=hint)
    check_new_file(path, option="--out FILE", force=force)
    return ending


def _chosen(recording: Recording, channels: Sequence[str] | None) -> Recording:
    """Return the recording with these channels alone, in the order of the recording."""
    check_time(recording)
    if channels is None:
        return recording
    if not channels:
        raise InvalidInput("channels is empty; it must name at least one.")
    here = [str(name) for name in recording.data_vars]
    for name in channels:
        if name in here:
            continue
        guess = nearest(name, here)
        what = f"the recording has no {name}." if name in CHANNELS else f'no channel "{name}".'
        raise InvalidInput(plain(what), hint=f'"{guess}"' if guess else f"one of {', '.join(here)}")
    return recording[[name for name in here if name in channels]]
