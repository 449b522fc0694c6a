"""Recordings in the files of other programs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from phasmid.arguments import check_number, check_type, path_of
from phasmid.errors import AlreadyExists, InvalidInput, nearest, plain
from phasmid.recording import (
    CHANNELS,
    Recording,
    check_mcap,
    check_recording,
    save_csv,
    save_mcap,
    save_recording,
)
from phasmid.recording.file import cannot_write, new_file
from phasmid.recording.ros import rows_at
from phasmid.reporting.source import read_source

ENDINGS = {"csv": ".csv", "netcdf": ".nc", "mcap": ".mcap"}
"""Formats, and how their files' names end."""

MCAP_RATE = 100.0
"""Most messages of a topic a second where no rate is asked for [1/s]."""


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
        recording: What was seen.
        path: The file; its ending gives the format by default: ``.csv``, ``.nc``, or ``.mcap`` with
            the extra ``ros``.
        format: ``csv``, ``netcdf`` or ``mcap``.
        channels: Names of those that are written; by default all.
        rate: Most samples a second that are written [1/s]; by default all, of MCAP 100.
        force: Whether an older file of that name is replaced.

    Returns:
        The file.

    Raises:
        InvalidInput: The file exists; there is no such format or channel; an extra is absent.
        OutputError: The file cannot be written; nothing is left behind.
    """
    check_recording(recording)
    path = path_of("path", path)
    kind = check_export(path, format, force=force)
    if rate is not None:
        check_number("rate", rate)
    if rate is not None and not 0 < rate < np.inf:
        raise InvalidInput(f"rate is {rate}; it must be a finite number greater than 0.")
    names = read_source(recording).robot.leg_names if "robot" in recording.attrs else None
    chosen = _chosen(recording, channels)
    if rate is not None and kind != "mcap":
        rows = rows_at(np.asarray(chosen["time"].values), rate)
        chosen = chosen.isel(time=rows)
    with new_file(path, option="--out FILE", force=force) as place:
        if kind == "mcap":
            save_mcap(chosen, place, leg_names=names, rate=rate or MCAP_RATE)
        elif kind == "netcdf":
            save_recording(chosen, place)
        else:
            save_csv(chosen, place, leg_names=names)
    return path


def check_export(path: str | Path, format: str | None = None, *, force: bool = False) -> str:
    """Refuse a file that `export` could not write; to be asked before a recording is read.

    Args:
        path: The file.
        format: By default that which the name's ending tells.
        force: Whether an older file of that name may be replaced.

    Returns:
        The format.

    Raises:
        InvalidInput: It exists and may not be replaced; there is no such format, or the name's
            ending belongs to another; the extra that writes it is absent.
        OutputError: No file can be called so.
    """
    path = path_of("path", path)
    by_ending = {ending: name for name, ending in ENDINGS.items()}
    told = by_ending.get(path.suffix.lower())
    known = ", ".join(ENDINGS)
    if format is None and told is None:
        raise InvalidInput(
            f'"{path}" does not end in {", ".join(ENDINGS.values())}; '
            "it must, or the format be given.",
            hint=f"--format, one of {known}",
        )
    if format is not None:
        check_type("format", format, (str,), "text, or None")
    if format is not None and format not in ENDINGS:
        guess = nearest(format, ENDINGS)
        raise InvalidInput(f'no format "{format}".', hint=guess or f"one of {known}")
    kind = format or told or ""
    if told is not None and told != kind:
        raise InvalidInput(
            f'"{path}" ends as a {told} file, and the format is {kind}; they must agree.',
            hint=f'"{path.with_suffix(ENDINGS[kind])}"',
        )
    try:
        folder, exists = path.is_dir(), path.exists()
    except OSError as error:
        raise cannot_write(path, error) from None
    if folder:
        raise InvalidInput(f"{path} is a folder; nothing was written.", hint="a file's name")
    if exists and not force:
        raise AlreadyExists(path, option="--out FILE")
    if kind == "mcap":
        check_mcap()
    return kind


def _chosen(recording: Recording, channels: Sequence[str] | None) -> Recording:
    """The recording with these channels alone, in the order in which recordings keep them."""
    if channels is None:
        return recording
    check_type("channels", channels, (list, tuple), "a list of names, or None")
    for place, name in enumerate(channels):
        check_type(f"channels[{place}]", name, (str,), "text")
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
