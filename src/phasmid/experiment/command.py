"""Commands for a robot."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, field
from enum import Enum
from types import MappingProxyType
from typing import Any

from phasmid.arguments import check_fields, check_kind, described
from phasmid.errors import InvalidInput
from phasmid.gait import Gait


class Posture(Enum):
    """Posture of the whole robot; the value describes it."""

    PACKED = "lies on its belly with its legs folded"
    STANDING = "stands"
    WALKING = "walks as commanded, and stands at zero velocity"


@dataclass(frozen=True, slots=True)
class LegCommand:
    """Position of a manual leg: either its foot or its joint angles.

    Attributes:
        foot: Foot in the body frame [m], (x, y, z).
        joints: Joint angles [rad], (coxa, femur, tibia).
    """

    foot: tuple[float, float, float] | None = None
    joints: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        if (self.foot is None) == (self.joints is None):
            raise InvalidInput("a leg command is a foot or joints, one of the two.")
        _check_numbers("foot" if self.foot is not None else "joints", self.foot or self.joints, 3)


@dataclass(frozen=True, slots=True)
class Command:
    """Command for a robot; controllers follow changes smoothly.

    Attributes:
        velocity: Of the body over ground in body axes: forward, left [m/s], yaw rate [rad/s].
        pose: Of the body, relative to that of standing or walking: forward, left, up [m], roll,
            pitch, yaw [rad].
        posture: Posture of the whole robot.
        gait: Name of a gait, or the gait; None: the controller's setting.
        period: Duration of a cycle [s]; None: the controller's setting.
        step_height: Height to which a foot lifts [m]; None: the controller's setting.
        legs: Manual legs, by number from 1.
        lost_legs: Numbers of legs that are not used: lifted, or broken.
        time: When the command was given, on the controller's clock [s]; old ones are not followed.
            None: it does not expire.
    """

    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    pose: tuple[float, float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    posture: Posture = Posture.WALKING
    gait: str | Gait | None = None
    period: float | None = None
    step_height: float | None = None
    legs: Mapping[int, LegCommand] = field(default_factory=lambda: MappingProxyType({}))
    lost_legs: frozenset[int] = frozenset()
    time: float | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.lost_legs, frozenset):
            check_kind(self.lost_legs, Set[int] | Sequence[int], "lost_legs")
            object.__setattr__(self, "lost_legs", frozenset(self.lost_legs))
        for name, kind in _CLASSES:
            if not isinstance(getattr(self, name), kind):
                check_fields(self)
        _check_numbers("velocity", self.velocity, 3)
        _check_numbers("pose", self.pose, 6)
        for name, least, must in (
            ("time", -math.inf, ""),
            ("period", math.ulp(0.0), ", greater than 0"),
            ("step_height", 0.0, ", 0 or more"),
        ):
            value = getattr(self, name)
            if value is None:
                continue
            if not isinstance(value, float):
                check_kind(value, float, name)
            if not (math.isfinite(value) and value >= least):
                raise InvalidInput(f"{name} is {value:g}; it must be a finite number{must}.")


_CLASSES: tuple[tuple[str, Any], ...] = (
    ("posture", Posture),
    ("gait", str | Gait | None),
    ("legs", Mapping),
)
"""Fields of a command that are looked at closely where their class differs."""


def _check_numbers(name: str, values: Any, count: int) -> None:
    # Quick, because a function may give a new command at every update.
    try:
        is_right = len(values) == count and all(map(math.isfinite, values))
    except TypeError:
        is_right = False
    if not is_right:
        raise InvalidInput(f"{name} is {described(values)}; it must be {count} finite numbers.")
