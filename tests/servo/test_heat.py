"""Heat of a servo: one thermal node by hand, and a public measurement."""

import math
from dataclasses import replace

import numpy as np
import pytest

from phasmid.servo import load_servo
from phasmid.servo.heat import HEAT_RANGE, temperature_after, time_to_limit

SERVO = replace(
    load_servo("AX-12A"),
    thermal_resistance=10.0,
    heat_capacity=60.0,
    temperature_limit=70.0,
    ambient_temperature=20.0,
)
"""Time constant 600 s."""


def test_one_node_by_hand():
    # T = T_air + P R (1 - exp(-t/(R C))) from cold; 8 W lead to 100 °C, and to 70 °C in
    # -600 ln(1 - 50/80) s.
    for time in (0.0, 60.0, 600.0, 3600.0):
        rise = 80 * (1 - math.exp(-time / 600))
        assert temperature_after(SERVO, time, 20.0, 8.0) == pytest.approx(20 + rise, rel=1e-12)
    until = -600 * math.log(1 - 50 / 80)
    assert time_to_limit(SERVO, 20.0, 8.0) == pytest.approx(until, rel=1e-12)
    assert temperature_after(SERVO, until, 20.0, 8.0) == pytest.approx(70, rel=1e-12)
    # 5 W lead to the limit and not beyond it; a servo at its limit has no time left.
    np.testing.assert_array_equal(time_to_limit(SERVO, 20.0, np.array([5.0, 0.0])), np.inf)
    assert time_to_limit(SERVO, 70.0, 0.0) == 0


def test_a_measured_warming_is_in_the_range():
    """An STS3215 of 12 V lifted 1.5 kg at 10 cm for 10 minutes and warmed by 15 K.

    Source: robonine.com, test of an STS3215-C018, 2025.
    """
    servo = load_servo("STS3215")
    motor, air = servo.motor, servo.ambient_temperature
    power = motor.resistance * motor.working_current(1.5 * 9.81 * 0.1) ** 2
    low, high = (temperature_after(servo, 600.0, air, power * part) - air for part in HEAT_RANGE)
    assert low < 15 < high
    assert high <= 3 * low * (1 + 1e-12)
