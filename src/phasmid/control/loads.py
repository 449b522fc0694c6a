"""What servos have given for some time: their overload, and how warm they are."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.robot import Servo

AMBIENT = 25.0
"""Temperature at which servos are taken to begin [°C]."""

HEAT_STEP = 0.1
"""Time between two looks at the servos' warmth [s]."""


def heating(servo: Servo, load_share: float) -> Float[np.ndarray, "4"]:
    """What `add_loads` has to know: the output that is too much, the power at full output [W], 0
    where it is not known, and resistance [K/W] and capacity [J/K] of the servo's heat.

    Args:
        servo: The servo.
        load_share: That output.
    """
    power = 0.0 if servo.stall_current is None else servo.rated_voltage * servo.stall_current
    heat = servo.thermal_resistance, servo.heat_capacity
    return np.array([load_share, power, *heat])


def add_loads(
    load: Float[np.ndarray, "legs 3"],
    since: float,
    loads: Float[np.ndarray, "3 legs 3"],
    heating: Float[np.ndarray, "4"],
) -> None:
    """Take what has been added up for a while into overload and warmth.

    Args:
        load: Outputs of the servos now.
        since: For how long [s].
        loads: As in `phasmid.control.safety.SafetyMonitor`, changed.
        heating: See there.
    """
    most, power, resistance, capacity = heating[0], heating[1], heating[2], heating[3]
    for leg in range(load.shape[0]):
        for joint in range(3):
            time = loads[1, leg, joint] + since
            loads[1, leg, joint] = time if abs(load[leg, joint]) > most else 0.0
            if power > 0.0:
                gained = loads[0, leg, joint] / since * power
                lost = (loads[2, leg, joint] - AMBIENT) / resistance
                loads[2, leg, joint] += (gained - lost) * (since / capacity)
            loads[0, leg, joint] = 0.0
