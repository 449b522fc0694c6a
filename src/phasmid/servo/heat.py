"""Heat of a servo: one thermal node, which the loss in the winding warms and the air cools."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.servo.servo import Servo

HEAT_RANGE = 1 / 3, 1.0
"""Least and largest share of a computed warming. The largest is that of the servo alone: 10
W/(m² K) from the faces of its case, as in still air with radiation, and the heat capacity of its
mass. The least has three times the surface and the heat capacity: frame, horn and draught take
part. An STS3215 at 1.47 N·m warmed by 15 K in 10 minutes of lifting; the range is 13 to 38 K.
Source: robonine.com, test of an STS3215-C018, 2025."""


def remaining(servo: Servo, time: float) -> float:
    """Return the share of the distance to the steady temperature that is left after a time [s]."""
    return math.exp(-time / (servo.thermal_resistance * servo.heat_capacity))


def temperature_after(
    servo: Servo,
    time: float,
    start: Float[np.ndarray, "*batch"] | float,
    power: Float[np.ndarray, "*batch"] | float,
) -> Float[np.ndarray, "*batch"]:
    """Return the temperature after a time at a constant loss [°C].

    Args:
        servo: The servo, with the temperature of the air.
        time: The time [s].
        start: Temperature at its beginning [°C].
        power: Loss in the winding [W].
    """
    steady = servo.ambient_temperature + servo.thermal_resistance * np.asarray(power)
    return steady + remaining(servo, time) * (start - steady)


def time_to_limit(
    servo: Servo,
    start: Float[np.ndarray, "*batch"] | float,
    power: Float[np.ndarray, "*batch"] | float,
) -> Float[np.ndarray, "*batch"]:
    """Return the time to the temperature limit at a constant loss [s].

    Args:
        servo: The servo, with the temperature of the air.
        start: Temperature at the beginning [°C].
        power: Loss in the winding [W].

    Returns:
        0 where the limit is reached, infinite where it never is.
    """
    start = np.asarray(start, dtype=float)
    steady = servo.ambient_temperature + servo.thermal_resistance * np.asarray(power)
    with np.errstate(invalid="ignore", divide="ignore"):
        lasting = np.log((steady - start) / (steady - servo.temperature_limit))
    lasting *= servo.thermal_resistance * servo.heat_capacity
    lasting = np.where(steady > servo.temperature_limit, lasting, np.inf)
    return np.where(start >= servo.temperature_limit, 0.0, lasting)
