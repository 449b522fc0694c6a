"""``phasmid export``: write a recording in a format of other programs."""

from __future__ import annotations

import argparse
from pathlib import Path

from phasmid.cli.options import Number
from phasmid.cli.output import say
from phasmid.cli.plot import run_name
from phasmid.cli.report import print_damage
from phasmid.errors import InvalidInput, plain

OPTIONS = {
    "RECORDING": "a result folder, or a recording",
    "--out FILE": "a .csv, .nc or .mcap, the last for Foxglove and ROS 2; default: a "
    ".csv beside the result folder, with its name",
    "--channels A,B,...": "channels that are written; default: all",
    "--rate HZ": Number("most samples a second; default: all, of mcap 100", 1e-3, 1e6),
    "--force": "replace the file",
    "--quiet": "print only errors",
}


def run(options: argparse.Namespace) -> int:
    """Export a recording, and return the exit status."""
    from phasmid.recording import load_recording
    from phasmid.reporting.data_file import check_export, export

    given = Path(options.recording)
    target = Path(options.out or _beside(given))
    with print_damage() as damage:
        recording = load_recording(given)
    source = given / "recording.nc" if given.is_dir() else given
    if target.resolve() == source.resolve():
        raise InvalidInput(
            f"{target} is the recording itself; nothing was written.", hint="another --out"
        )
    check_export(target, force=options.force)
    channels = [name.strip() for name in options.channels.split(",")] if options.channels else None
    export(recording, target, channels=channels, rate=options.rate, force=options.force)
    if not options.quiet:
        say(plain(str(target)))
    return 2 if any(found.wrong for found in damage) else 0


def _beside(given: Path) -> Path:
    """Return a .csv beside a recording, or beside its result folder."""
    whole = given.resolve()
    folder = whole if whole.is_dir() else whole.parent if whole.name == "recording.nc" else None
    if folder is None:
        return given.with_name(f"{given.stem}.csv")
    above = given.parent if given.is_dir() else given.parent.parent
    if given.name in ("", ".", "..") or above.resolve() != folder.parent:
        above = folder.parent
    return above / f"{run_name(given)}.csv"
