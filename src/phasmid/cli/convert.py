"""``phasmid convert``: a robot in another format."""

from __future__ import annotations

import argparse
from pathlib import Path

from phasmid.cli.output import say
from phasmid.cli.scenario_options import add_import_options, import_options
from phasmid.errors import plain

OPTIONS = {
    "SOURCE": "a robot: a preset or a file",
    "TARGET": "a .toml, .urdf, .xml (MJCF) or .step file",
    "--force": "replace older files",
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_import_options(parser)


def run(options: argparse.Namespace) -> int:
    """Convert a robot, and return the exit status."""
    from phasmid.formats import import_robot, possible, save_robot

    imported = import_robot(options.source, import_options(options), strict=options.strict)
    robot = possible(imported, options.source)
    lost = save_robot(robot, options.target, force=options.force)
    for finding in (*imported.findings, *lost):
        say(f"  {finding.severity.value:<10} {plain(finding.sentence)}")
    say(
        f"Written to {plain(str(Path(options.target)))}: {len(robot.legs)} legs, "
        f"{robot.mass:.3f} kg"
    )
    return 0
