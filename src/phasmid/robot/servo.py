"""What a joint's motor can give."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from phasmid.errors import InvalidRobot


@dataclass(frozen=True)
class Servo:
    """A position servo, by the numbers of its data sheet.

    Attributes:
        name: Maker's name.
        stall_torque: Largest torque, at standstill [N·m].
        no_load_speed: Largest speed, without load [rad/s].
        stiffness: Torque per position error, below the limit [N·m/rad].
        damping: Torque per speed error [N·m·s/rad].
        armature: Rotor inertia seen at the output [kg·m²].
        friction: Coulomb friction at the output [N·m].

    Raises:
        InvalidRobot: A number is not finite or has the wrong sign.
    """

    name: str
    stall_torque: float
    no_load_speed: float
    stiffness: float
    damping: float
    armature: float
    friction: float

    def __post_init__(self) -> None:
        positive = {"stall_torque", "no_load_speed", "stiffness"}
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name == "name":
                continue
            least = "greater than 0" if field.name in positive else "0 or more"
            if not math.isfinite(value) or value < 0 or (field.name in positive and value == 0):
                raise InvalidRobot(
                    f"servo {self.name}: {field.name} is {value}; "
                    f"it must be a finite number, {least}."
                )
