"""Commands for a robot."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from types import MappingProxyType
from typing import Any

from phasmid.arguments import check_number, check_type
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
        _check_numbers("velocity", self.velocity, 3)
        _check_numbers("pose", self.pose, 6)
        check_type("posture", self.posture, (Posture,), "a Posture", "Posture.WALKING")
        if self.gait is not None:
            check_type("gait", self.gait, (str, Gait), "the name of a gait, or a Gait")
        if self.time is not None:
            _check_finite("time", self.time)
        if self.period is not None:
            _check_finite("period", self.period, least=math.ulp(0.0), must=", greater than 0")
        if self.step_height is not None:
            _check_finite("step_height", self.step_height, least=0.0, must=", 0 or more")


def _check_finite(name: str, value: Any, least: float = -math.inf, must: str = "") -> None:
    check_number(name, value)
    if not (math.isfinite(value) and value >= least):
        raise InvalidInput(f"{name} is {value:g}; it must be a finite number{must}.")


def _check_numbers(name: str, values: object, count: int) -> None:
    check_type(name, values, (tuple, list), f"{count} numbers")
    assert isinstance(values, tuple | list)
    if len(values) != count:
        raise InvalidInput(f"{name} has {len(values)} values; it must have {count}.")
    for i, value in enumerate(values):
        _check_finite(f"{name}[{i}]", value)
