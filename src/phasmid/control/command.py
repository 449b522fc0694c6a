"""What a robot is asked to do."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from types import MappingProxyType

from phasmid.arguments import check_number, check_type
from phasmid.errors import InvalidInput
from phasmid.gait import Gait


class Posture(Enum):
    """What the body shall do as a whole; its value says it in words."""

    PACKED = "lies on its belly with its legs folded"
    STANDING = "stands"
    WALKING = "walks where it is told to, and stands where that is nowhere"


@dataclass(frozen=True, slots=True)
class LegCommand:
    """Where one leg is held by hand while the others stand; one of the two is given.

    Attributes:
        foot: The foot in the body frame [m], (x, y, z).
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
    """What the robot shall do from now on; a controller goes there without a jump.

    Attributes:
        velocity: Of the body over ground in its own axes: ahead, to the left [m/s], and turn to
            the left [rad/s].
        pose: Of the body, beside where it stands or walks: ahead, to the left, up [m], roll,
            pitch, yaw [rad].
        posture: What the body does as a whole.
        gait: Its name, or the gait itself; None: as the controller is set.
        period: Time of a cycle [s]; None: as the controller is set.
        step_height: Height to which a foot lifts [m]; None: as the controller is set.
        legs: Legs that are moved by hand, by number from 1.
        lost_legs: Numbers of legs that shall not be used: lifted off the ground, or broken.
        time: When it was given, on the controller's clock [s]; safety follows no old ones. None:
            it does not grow old.
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
            check_number("time", self.time)
            if not math.isfinite(self.time):
                raise InvalidInput(f"time is {self.time:g}; it must be a finite number.")
        for name, least in (("period", 0.0), ("step_height", -math.ulp(0.0))):
            value = getattr(self, name)
            if value is None:
                continue
            check_number(name, value)
            if not (math.isfinite(value) and value > least):
                must = "greater than 0" if name == "period" else "0 or more"
                raise InvalidInput(f"{name} is {value:g}; it must be a finite number, {must}.")


def _check_numbers(name: str, values: object, count: int) -> None:
    check_type(name, values, (tuple, list), f"{count} numbers")
    assert isinstance(values, tuple | list)
    if len(values) != count:
        raise InvalidInput(f"{name} has {len(values)} values; it must have {count}.")
    for i, value in enumerate(values):
        check_number(f"{name}[{i}]", value)
        if not math.isfinite(value):
            raise InvalidInput(f"{name}[{i}] is {value:g}; it must be a finite number.")
