"""Options of commands that read a robot: values missing in its file."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from phasmid.formats import ImportOptions

OPTIONS = {
    "foot": (
        "LINK|X,Y,Z|LEGS=...;...",
        "a link's name or its ending, or metres in each leg's last link; for each leg "
        '"1-3=0,0,-0.13; 4-6=0,0,0.13"',
    ),
    "masses": ("as-given|geometry", "inertias of the file, or of boxes of the file's masses"),
    "total_mass_g": ("G", "what the robot weighs on a scale: all masses are scaled to it"),
    "servo_model": ("NAME", "the servo, where efforts and speeds of the file do not determine it"),
    "package": ("NAME=PATH,...", "folders that package:// names"),
    "mesh_unit": ("as-given|m|mm", "unit of the mesh files"),
}
"""Placeholder and help of each field of a scenario's ``[robot_import]``."""


def add_import_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of reading a robot."""
    group = parser.add_argument_group("reading URDF, MJCF and STEP")
    for key, (metavar, words) in OPTIONS.items():
        group.add_argument(
            f"--{key.replace('_', '-')}", dest=f"import:{key}", metavar=metavar, help=words
        )
    group.add_argument(
        "--strict", action="store_true", help="refuse a file with anything that is ignored"
    )


def import_options(options: argparse.Namespace) -> ImportOptions:
    """Return the options of reading a robot.

    Raises:
        InvalidInput: A value is refused.
    """
    from phasmid.cli.scenario_options import number_or_text
    from phasmid.formats import ImportOptions
    from phasmid.tables import validate

    given = {
        key: vars(options)[f"import:{key}"]
        for key in OPTIONS
        if vars(options)[f"import:{key}"] is not None
    }
    if "total_mass_g" in given:
        given["total_mass_g"] = number_or_text(given["total_mass_g"])

    def locate(loc: tuple[str | int, ...]) -> tuple[str, str]:
        name = str(loc[0])
        key = next((key for key in OPTIONS if key.startswith(name)), name)
        return f"--{key.replace('_', '-')}", ""

    return validate(ImportOptions, given, locate)
