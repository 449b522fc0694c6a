"""The phasmid extension: TOML in URDF and MJCF files, for data that these formats lack."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from annotated_types import Len

from phasmid.errors import InvalidInput, located
from phasmid.robot import Robot, Servo
from phasmid.robot.file import servo_table
from phasmid.robot.table import MOST_LEGS, Name, ServoTable, Vector
from phasmid.tables import Angle, Table, dotted, validate
from phasmid.toml import parse_toml, toml_key, toml_string

LARGEST = 100_000
"""Texts of more characters than this were not written by `extension_of`."""


class LegExtension(Table):
    """``[legs.NAME]``: properties of a leg that the tree lacks."""

    joint: str
    neutral_foot: Vector
    yaw: Angle
    pitch: Angle = 0.0
    roll: Angle = 0.0
    femur_bend: Angle = 0.0
    tibia_bend: Angle = 0.0


class Extension(Table):
    """Properties of a robot that the tree lacks, in SI; its body frame is the root link's."""

    name: Name
    description: str = ""
    body_size: Vector
    servo: ServoTable
    legs: Annotated[dict[Name, LegExtension], Len(4, MOST_LEGS)]

    @property
    def motor(self) -> Servo:
        """The servo."""
        return Servo(**self.servo.model_dump())


def extension_of(robot: Robot) -> str:
    """Write the data that a robot's tree lacks as TOML; `read_extension` reads it back exactly.

    The look is left out: the tree carries the meshes themselves.
    """
    lines = [
        f"name = {toml_string(robot.name)}",
        f"description = {toml_string(robot.description)}",
        f"body_size = {_row(robot.body.size)}",
        "",
        *servo_table(robot.servo),
    ]
    for leg in robot.legs:
        lines += [
            "",
            f"[legs.{toml_key(leg.name)}]",
            f"joint = {toml_string(f'{leg.name}_coxa')}",
            f"neutral_foot = {_row(leg.neutral_foot)}",
            f"yaw = {float(leg.mount_yaw)!r}",
            f"pitch = {float(leg.mount_pitch)!r}",
            f"roll = {float(leg.mount_roll)!r}",
            f"femur_bend = {float(leg.femur_bend)!r}",
            f"tibia_bend = {float(leg.tibia_bend)!r}",
        ]
    return "\n".join(lines) + "\n"


def read_extension(text: str, file: str = "") -> Extension:
    """Read the text of `extension_of`, from an untrusted source.

    Args:
        text: The TOML.
        file: Name of the file that carries it, for messages.

    Raises:
        InvalidInput: It is too long, no TOML, or no extension.
    """
    what = "its phasmid extension"
    place = f"{file}, {what}" if file else what
    if len(text) > LARGEST:
        raise InvalidInput(
            f"{what} has {len(text)} characters; the limit is {LARGEST}.", where=file
        )
    with located(place):
        return validate(Extension, parse_toml(text, what), lambda loc: (dotted(loc), ""))


def _row(values: np.ndarray) -> str:
    return "[" + ", ".join(repr(float(v)) for v in values) + "]"
