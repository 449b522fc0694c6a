"""How carefully a robot stands up, sits down and moves its legs by hand."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from phasmid.arguments import check_number
from phasmid.errors import InvalidInput
from phasmid.robot import Robot


@dataclass(frozen=True, slots=True)
class SequenceSettings:
    """How carefully a robot stands up, sits down and moves its legs by hand.

    Attributes:
        speed_share: Of the servo's speed without load that a joint turns at most.
        loaded_share: The same while the feet carry the body up or down.
        acceleration: Largest acceleration of a joint [rad/s²].
        clearance: Height over the ground that feet and knees keep on their way [m].
        step_height: Height to which a foot lifts where it steps [m].
        support_margin: Least distance of the centre of mass from the edge of the support polygon
            while legs are in the air [m].
        limit_margin: Angle that poses of rest keep from the joint limits [rad].
        knee_fold: Least angle between femur and tibia of a folded leg [rad].
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
        """Largest speed of a joint [rad/s], of one that carries the body where loaded."""
        share = self.loaded_share if loaded else self.speed_share
        return share * robot.servo.no_load_speed
