"""``phasmid report``: make the result folder of a recording, or of an interrupted run's log."""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from phasmid.cli.output import say
from phasmid.cli.walk import (
    REPORT_OPTIONS,
    check_film,
    leg_numbers,
    own_appearance,
    print_report,
    write_film,
    write_report,
)

if TYPE_CHECKING:
    from phasmid.recording import DamagedRecording

OPTIONS = {
    "FILE": "a recording.nc, its folder, or the .mcap of a run",
    "--out DIR": "result folder; default: the file's name without its ending",
    **REPORT_OPTIONS,
}


@contextmanager
def print_damage() -> Iterator[list[DamagedRecording]]:
    """Print the damages of a recording that is read in the body, and yield them."""
    from phasmid.recording import DamagedRecording

    found: list[DamagedRecording] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", DamagedRecording)
        yield found
    found += [w.message for w in caught if isinstance(w.message, DamagedRecording)]
    for damage in found:
        say(f"phasmid: {damage}", file=sys.stderr)


def run(options: argparse.Namespace) -> int:
    """Make the result folder, and return the exit status."""
    from phasmid.recording import load_recording
    from phasmid.reporting import check_folder, read_run
    from phasmid.robot import Appearance
    from phasmid.scenario import recorded_scenario

    path = Path(options.file)
    # Only a file has a suffix.
    folder = Path(options.out or (path if path.is_dir() else path.with_suffix("")))
    with print_damage() as damage:
        recording = load_recording(path)
    check_folder(folder, force=options.force)
    check_film(options)
    legs = leg_numbers(options.legs, read_run(recording).robot)
    kept = path if path.is_dir() else path.parent
    scenario = recorded_scenario(recording.attrs, kept)
    look = own_appearance(scenario.base_robot())
    if look is not None:
        # Read before the folder is replaced.
        look = Appearance.of(look.parts, look.name)
    if "joint_position" in recording and "joint_position_measured" not in recording:
        # Lazy import: the simulation imports the whole controller.
        from phasmid.simulation import with_sensors

        recording = with_sensors(scenario, recording)
    write_report(recording, folder, options, look)
    print_report(recording, folder, options, legs)
    write_film(recording, options, look)
    return 2 if any(found.wrong for found in damage) else 0
