"""Overload time and temperature of servos, from their measured output."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.robot import Servo

AMBIENT = 25.0
"""Initial temperature of servos [°C]."""

HEAT_STEP = 0.1
"""Time step of overload and temperature [s]."""


def heating(servo: Servo, load_share: float) -> Float[np.ndarray, "4"]:
    """Return the parameters of `add_loads`.

    Args:
        servo: The servo.
        load_share: Output above which a servo is overloaded.

    Returns:
        That output, power at full output [W] (0: unknown), thermal resistance [K/W] and heat
        capacity [J/K], shape (4,).
    """
    power = 0.0 if servo.stall_current is None else servo.rated_voltage * servo.stall_current
    return np.array([load_share, power, servo.thermal_resistance, servo.heat_capacity])


def add_loads(
    load: Float[np.ndarray, "legs 3"],
    dt: float,
    loads: Float[np.ndarray, "3 legs 3"],
    heating: Float[np.ndarray, "4"],
) -> None:
    """Integrate overload time and temperature over a time step.

    Args:
        load: Present outputs of the servos, shape (L, 3).
        dt: Time step [s].
        loads: See `phasmid.control.safety.SafetyMonitor`; changed.
        heating: As `heating` returns it.
    """
    most, power, resistance, capacity = heating[0], heating[1], heating[2], heating[3]
    for leg in range(load.shape[0]):
        for joint in range(3):
            overload_time = loads[1, leg, joint] + dt
            loads[1, leg, joint] = overload_time if abs(load[leg, joint]) > most else 0.0
            if power > 0.0:
                heat = loads[0, leg, joint] / dt * power
                loss = (loads[2, leg, joint] - AMBIENT) / resistance
                loads[2, leg, joint] += (heat - loss) * (dt / capacity)
            loads[0, leg, joint] = 0.0
