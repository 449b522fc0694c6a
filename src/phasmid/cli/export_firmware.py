"""``phasmid export-firmware``: leg kinematics and gait as a C header for microcontrollers."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path

from phasmid.cli.output import say
from phasmid.cli.scenario_options import (
    SCENARIO,
    add_field_options,
    field_arguments,
    scenario_of,
)
from phasmid.errors import InvalidInput, plain

OPTIONS = {
    **SCENARIO,
    "--out FILE": ("a .h file; default: walk.h", "walk.h"),
    "--force": "replace the file",
    "--quiet": "print only errors",
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_field_options(parser)


def run(options: argparse.Namespace) -> int:
    """Write the header, and return the exit status."""
    from phasmid.formats import firmware_header
    from phasmid.formats.robots import write_files
    from phasmid.motion import plan
    from phasmid.recording.file import check_new_file

    path = Path(options.out)
    if path.suffix != ".h":
        raise InvalidInput(f"{path} does not end as a C header does.", hint="--out walk.h")
    check_new_file(path, option="--out", force=options.force)
    scenario = scenario_of(options)
    own = [] if options.scenario is None else [options.scenario]
    words = ["phasmid", "export-firmware", *own, *field_arguments(options)]
    header = firmware_header(plan(scenario), command=shlex.join(words))
    write_files({path: header.encode()}, force=options.force)
    if not options.quiet:
        robot = scenario.load_robot()
        say(
            f"Written to {plain(str(path))}: {plain(robot.name)}, {len(robot.legs)} legs, "
            f"{scenario.stride.samples - 1} samples of a cycle"
        )
    return 0
