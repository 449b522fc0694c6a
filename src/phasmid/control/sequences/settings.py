"""Speeds, margins and heights of posture sequences."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from phasmid.arguments import check_number
from phasmid.errors import InvalidInput
from phasmid.robot import Robot


@dataclass(frozen=True, slots=True)
class SequenceSettings:
    """Speeds, margins and heights of posture sequences and manual legs.

    Attributes:
        speed_share: Largest joint speed, as a share of the servo's no-load speed.
        loaded_share: The same while the feet raise or lower the body.
        acceleration: Largest joint acceleration [rad/s²].
        clearance: Height of feet and knees over the ground on their paths [m].
        step_height: Height to which a foot lifts for a step [m].
        support_margin: Least support margin while legs are in the air [m].
        limit_margin: Distance of resting poses from the joint limits [rad].
        knee_fold: Least angle between femur and tibia of a folded leg [rad].

    Raises:
        InvalidInput: A value is not positive, or a share is above 1.
    """

    speed_share: float = 0.5
    loaded_share: float = 0.2
    acceleration: float = 30.0
    clearance: float = 0.010
    step_height: float = 0.030
    support_margin: float = 0.012
    limit_margin: float = math.radians(2)
    knee_fold: float = math.radians(35)

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            check_number(field.name, value)
            most = 1.0 if field.name.endswith("share") else math.inf
            if not (math.isfinite(value) and 0 < value <= most):
                must = "greater than 0" + (" and 1 or less" if most == 1.0 else "")
                raise InvalidInput(
                    f"{field.name} is {value:g}; it must be a finite number, {must}."
                )

    def speed(self, robot: Robot, *, loaded: bool = False) -> float:
        """Return the largest joint speed [rad/s], with the body's load or without."""
        share = self.loaded_share if loaded else self.speed_share
        return share * robot.servo.no_load_speed
