"""Tables of robot files."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any

from annotated_types import Ge, Gt, Len
from pydantic import BeforeValidator, ConfigDict, StringConstraints

from phasmid.errors import InvalidInput
from phasmid.servo.catalogue import ServoTable
from phasmid.servo.servo import NotNegative, Positive
from phasmid.tables import (
    Angle,
    Count,
    Hint,
    Inertia,
    Length,
    Mass,
    Name,
    Table,
    Weight,
)

MOST_LEGS = 100
"""Most legs of a robot, a gait or a file."""


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
    speed_ratio: Annotated[list[Positive], Len(3, 3)] = [1.0, 1.0, 1.0]
    armature_ratio: Annotated[list[NotNegative], Len(3, 3)] = [1.0, 1.0, 1.0]
    friction_ratio: Annotated[list[NotNegative], Len(3, 3)] = [1.0, 1.0, 1.0]
    links: LinksTable


class BodyTable(RobotPart):
    """``[body]``: the trunk; without centre of mass and inertia it is a solid box of its size."""

    size: Vector
    box_centre: Vector = [0.0, 0.0, 0.0]
    mass: Mass | None = None
    com: Vector | None = None
    inertia: Tensor | None = None


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
