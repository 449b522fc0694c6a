"""Friction of a servo's gears, as a compiled function of numbers."""

from __future__ import annotations

import math
from typing import Any

from phasmid.compiled import compiled


@compiled
def dry_friction(friction: Any, motor_torque: float, external_torque: float, speed: float) -> float:
    """Return the largest friction torque of gears, without its viscous part [N·m]; compiled.

    Model M6 of Duclusaud, Passault, Padois and Ly, "Extended Friction Models for the Physics
    Simulation of Servo Actuators" (2024), which contains M1 to M5.

    Args:
        friction: Record with the fields of `Friction`.
        motor_torque: Torque of the motor on the gears [N·m].
        external_torque: Torque of the load on the gears, in the motor's direction [N·m].
        speed: Of the output [rad/s].
    """
    dry = friction.coulomb + abs(
        friction.load_loss * motor_torque - friction.external_loss * external_torque
    )
    if friction.stribeck_speed > 0.0:
        more = friction.stribeck + abs(
            friction.stribeck_load_loss * motor_torque
            - friction.stribeck_external_loss * external_torque
        )
        if motor_torque * external_torque <= 0.0:
            if abs(motor_torque) > abs(external_torque):
                more += friction.quadratic_external_loss * external_torque**2
            elif abs(motor_torque) < abs(external_torque):
                more += friction.quadratic_load_loss * motor_torque**2
        ratio = abs(speed) / friction.stribeck_speed
        dry += more * math.exp(-(ratio**friction.stribeck_exponent))
    return dry


@compiled
def dry_frictions(
    friction: Any, motor_torque: Any, external_torque: Any, speed: Any, dry: Any
) -> None:
    """Write `dry_friction` of N states into an array; compiled."""
    for k in range(len(dry)):
        dry[k] = dry_friction(friction[0], motor_torque[k], external_torque[k], speed[k])
