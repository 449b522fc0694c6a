"""Options of commands that read a robot: values missing in its file."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from phasmid.cli.scenario_options import add_field_options, with_fields

if TYPE_CHECKING:
    from phasmid.formats import ImportOptions


def add_import_options(parser: argparse.ArgumentParser) -> None:
    """Add the fields of ``[robot_import]``."""
    from phasmid.scenario import option_keys

    keys = [key for key, path in option_keys().items() if path[0] == "robot_import"]
    add_field_options(parser, "reading URDF, MJCF and STEP", keys)
    parser.add_argument(
        "--strict", action="store_true", help="refuse a file with anything that is ignored"
    )


def import_options(options: argparse.Namespace) -> ImportOptions:
    """Return the options of reading a robot.

    Raises:
        InvalidInput: A value is refused.
    """
    from phasmid.scenario import Scenario

    return with_fields(Scenario(), options).robot_import
