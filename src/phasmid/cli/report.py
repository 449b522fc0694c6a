"""``phasmid report``: the folder of a recording, or of the log of a run that was cut off."""

from __future__ import annotations

import argparse
import sys
import warnings
from pathlib import Path

from phasmid.cli.walk import add_report_options, leg_numbers, write_report


def add_options(parser: argparse.ArgumentParser) -> None:
    """Give a parser the file and the output."""
    parser.add_argument("file", metavar="FILE", help="a recording.nc, or the .rec of a run")
    parser.add_argument(
        "--out", metavar="DIR", help="result folder; default: the file's name without its ending"
    )
    add_report_options(parser)


def run(options: argparse.Namespace) -> int:
    """Report on the file that the options name; returns the exit status."""
    from phasmid.recording import DamagedRecording, load_recording
    from phasmid.reporting import check_folder, read_source
    from phasmid.scenario import recorded_scenario
    from phasmid.simulation import with_sensors

    path = Path(options.file)
    folder = Path(options.out or path.with_suffix(""))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", DamagedRecording)
        recording = load_recording(path)
    damage = [w.message for w in caught if isinstance(w.message, DamagedRecording)]
    for found in damage:
        print(f"phasmid: {found}", file=sys.stderr)
    check_folder(folder, force=options.force)
    legs = leg_numbers(options.legs, read_source(recording).robot)
    scenario, robot = recorded_scenario(recording.attrs)
    if "joint_position" in recording and "joint_position_measured" not in recording:
        recording = with_sensors(scenario.replace(robot=robot), recording)
    write_report(recording, folder, options, legs)
    return 2 if any(found.wrong for found in damage) else 0
