"""Tables of robot files."""

from __future__ import annotations

import math
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Annotated, Any

from annotated_types import Ge, Gt, Len
from pydantic import BeforeValidator, ConfigDict, StringConstraints, model_validator

from phasmid.errors import InvalidInput, nearest
from phasmid.robot.servo import KnownNumbers, Positive, Servo
from phasmid.robot.servo_rules import complete_servo
from phasmid.tables import (
    Angle,
    Count,
    Hint,
    Inertia,
    Length,
    Mass,
    Table,
    Weight,
    in_si,
)
from phasmid.toml import read_toml

MOST_LEGS = 100
"""Most legs of a robot, a gait or a file."""

LONGEST_NAME = 64
"""Robots and legs with longer names than this make no readable tables."""


def _matrix(tensor: Any) -> Any:
    """Return the rows of a tensor from its table xx, yy, zz, xy, xz, yz."""
    if not isinstance(tensor, Mapping):
        return tensor
    needed, known = {"xx", "yy", "zz"}, ("xx", "yy", "zz", "xy", "xz", "yz")
    for key in tensor:
        if key not in known:
            raise InvalidInput(f'unknown key "{key}" in an inertia.', hint=", ".join(known))
    if not needed <= set(tensor):
        raise InvalidInput("an inertia must have xx, yy and zz; xy, xz and yz may follow.")
    xx, yy, zz, xy, xz, yz = (tensor.get(key, 0.0) for key in known)
    return [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]


_PRINTABLE = r"[^\p{C}\p{Z}]"
Name = Annotated[
    str,
    # Formats of XML know no blanks at the ends.
    StringConstraints(
        pattern=rf"^{_PRINTABLE}((?:{_PRINTABLE}| ){{0,{LONGEST_NAME - 2}}}{_PRINTABLE})?$"
    ),
    Hint(f"1 to {LONGEST_NAME} printable characters, without a blank at the ends"),
]
FileName = Annotated[
    Annotated[str, StringConstraints(pattern=r"^[^\p{C}/\\:]+\.glb$")] | None,
    Hint("the name of a .glb file beside the robot file, without a folder"),
]
Vector = Annotated[list[Length], Len(3, 3)]
Limits = Annotated[list[Angle], Len(2, 2)]
Tensor = Annotated[list[Annotated[list[Inertia], Len(3, 3)]], Len(3, 3), BeforeValidator(_matrix)]


class RobotPart(Table):
    """Table of a robot file; the robot refuses numbers that are not finite."""

    model_config = ConfigDict(allow_inf_nan=True)


class LinkTable(RobotPart):
    """``[leg.links.coxa]``: length, mass and inertia of a link.

    Attributes:
        mass: Mass [kg].
        com: Centre of mass [m]; without it the middle of the link.
        inertia: About the centre of mass [kg·m²]; without it a solid box along the link.
        width: Width and height of that box [m]; an AX-12's breadth without it.
        lateral_offset: Of the next link's frame, or the foot, to the leg's left [m].
    """

    mass: Mass
    com: Vector | None = None
    inertia: Tensor | None = None
    width: Annotated[Length, Gt(0)] = 0.038
    lateral_offset: Length = 0.0


class LimitsTable(RobotPart):
    """``[leg.joint_limits]``: lowest and highest angle of each joint."""

    coxa: Limits = [-math.pi, math.pi]
    femur: Limits = [-math.pi, math.pi]
    tibia: Limits = [-math.pi, math.pi]


class LinksTable(RobotPart):
    """``[leg.links]``: the three links."""

    coxa: LinkTable
    femur: LinkTable
    tibia: LinkTable


class LegTable(RobotPart):
    """``[legs.NAME]`` merged over the shared table ``[leg]``."""

    coxa: Length
    femur: Length
    tibia: Length
    mount: Vector
    yaw: Angle
    neutral_foot: Vector | None = None
    home: Annotated[list[Angle], Len(3, 3)] | None = None
    femur_bend: Angle = 0.0
    tibia_bend: Angle = 0.0
    pitch: Angle = 0.0
    roll: Angle = 0.0
    joint_limits: LimitsTable = LimitsTable()
    strength: Annotated[list[Positive], Len(3, 3)] = [1.0, 1.0, 1.0]
    links: LinksTable


class BodyTable(RobotPart):
    """``[body]``: the trunk; without centre of mass and inertia it is a solid box of its size."""

    size: Vector
    box_centre: Vector = [0.0, 0.0, 0.0]
    mass: Mass | None = None
    com: Vector | None = None
    inertia: Tensor | None = None


class ServoTable(KnownNumbers):
    """``servo = "AX-12A"``, or a table of data-sheet numbers: the fields of `Servo`.

    Attributes:
        sources: Names of the numbers that have a source, by the source.
    """

    name: Name
    sources: dict[str, list[str]] = {}

    @model_validator(mode="before")
    @classmethod
    def _from_name(cls, raw: Any) -> Any:
        if not isinstance(raw, str):
            return raw
        known = known_servos()
        if raw not in known:
            guess = nearest(raw, known)
            raise InvalidInput(
                f'no servo called "{raw}".',
                hint=f'"{guess}"' if guess else f"one of {', '.join(known)}",
            )
        return {"name": raw} | _catalogue_entry(known[raw])

    def servo(self) -> Servo:
        """Build the servo; rules give the numbers that are absent.

        Raises:
            InvalidRobot: No servo can have these numbers.
        """
        stated = {name: source for source, names in self.sources.items() for name in names}
        return complete_servo(self.model_dump(exclude={"sources"}), stated)


def _catalogue_entry(groups: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return a servo of ``servos.toml`` as a table ``[servo]`` with sources."""
    numbers: dict[str, Any] = {}
    sources: dict[str, list[str]] = {}
    for status, group in groups.items():
        own = {key: value for key, value in group.items() if key != "source"}
        statement = status.replace("_", " ")
        if "source" in group:
            statement += f" ({group['source']})"
        sources[statement] = list(in_si(KnownNumbers, own))
        numbers |= own
    return numbers | {"sources": sources}


class RobotTable(RobotPart):
    """A robot file."""

    name: Name
    description: str = ""
    appearance: FileName = None
    leg_count: Annotated[Count, Ge(4)] = 6
    foot_radius: Length = 0.0
    total_weight: Weight | None = None
    servo: ServoTable
    body: BodyTable
    legs: dict[Name, LegTable]


def known_servos() -> dict[str, Any]:
    """Return the tables of ``servos.toml``: by servo and by the kind of source."""
    return read_toml(Path(str(resources.files("phasmid.robot") / "servos.toml")))[0]
