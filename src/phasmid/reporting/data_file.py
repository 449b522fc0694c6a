"""Recordings in the files of other programs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from phasmid.errors import InvalidInput, nearest, plain
from phasmid.recording import (
    CHANNELS,
    Recording,
    check_mcap,
    save_csv,
    save_mcap,
    save_recording,
)
from phasmid.recording.file import check_new_file
from phasmid.recording.ros import rows_at
from phasmid.reporting.run import read_run

ENDINGS = {"csv": ".csv", "netcdf": ".nc", "mcap": ".mcap"}
"""Endings of the file names of each format."""

MCAP_RATE = 100.0
"""Default of the most messages of a topic per second [1/s]."""


def export(
    recording: Recording,
    path: str | Path,
    *,
    format: str | None = None,
    channels: Sequence[str] | None = None,
    rate: float | None = None,
    force: bool = False,
) -> Path:
    """Write a recording as a file that other programs read.

    Args:
        recording: The recording.
        path: The file; its ending selects the format: ``.csv``, ``.nc``, or ``.mcap`` with the
            extra ``ros``.
        format: ``csv``, ``netcdf`` or ``mcap``, instead of the ending.
        channels: Names of the channels that are written; by default all.
        rate: Most samples per second [1/s]; by default all, of MCAP 100.
        force: Replace an older file of that name.

    Returns:
        The file.

    Raises:
        InvalidInput: The file exists; there is no such format or channel; an extra is absent.
        OutputError: The file cannot be written; nothing is left behind.
    """
    path = Path(path)
    kind = check_export(path, format, force=force)
    if rate is not None and not 0 < rate < np.inf:
        raise InvalidInput(f"rate is {rate}; it must be a finite number greater than 0.")
    names = read_run(recording).robot.leg_names if "robot" in recording.attrs else None
    chosen = _chosen(recording, channels)
    if rate is not None and kind != "mcap":
        rows = rows_at(np.asarray(chosen["time"].values), rate)
        chosen = chosen.isel(time=rows)
    if kind == "mcap":
        save_mcap(chosen, path, leg_names=names, rate=rate or MCAP_RATE)
    elif kind == "netcdf":
        save_recording(chosen, path)
    else:
        save_csv(chosen, path, leg_names=names)
    return path


def check_export(path: str | Path, format: str | None = None, *, force: bool = False) -> str:
    """Return the format of a file, or raise where `export` could not write it.

    Args:
        path: The file.
        format: The format; by default that of the ending.
        force: Replace an older file of that name.

    Raises:
        InvalidInput: It exists and may not be replaced; there is no such format, or the name's
            ending belongs to another; its extra is not installed.
        OutputError: The name is impossible.
    """
    path = Path(path)
    by_ending = {ending: name for name, ending in ENDINGS.items()}
    implied = by_ending.get(path.suffix.lower())
    known = ", ".join(ENDINGS)
    if format is None and implied is None:
        raise InvalidInput(
            f'"{path}" does not end in {", ".join(ENDINGS.values())}; '
            "it must, or the format be given.",
            hint=f"--format, one of {known}",
        )
    if format is not None and format not in ENDINGS:
        guess = nearest(format, ENDINGS)
        raise InvalidInput(f'no format "{format}".', hint=guess or f"one of {known}")
    kind = format or implied or ""
    if implied is not None and implied != kind:
        raise InvalidInput(
            f'"{path}" ends as a {implied} file, and the format is {kind}; they must agree.',
            hint=f'"{path.with_suffix(ENDINGS[kind])}"',
        )
    check_new_file(path, option="--out FILE", force=force)
    if kind == "mcap":
        check_mcap()
    return kind


def _chosen(recording: Recording, channels: Sequence[str] | None) -> Recording:
    """Return the recording with these channels alone, in the order of the recording."""
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
        raise InvalidInput(plain(what), hint=guess or f"one of {', '.join(here)}")
    return recording[[name for name in here if name in channels]]
