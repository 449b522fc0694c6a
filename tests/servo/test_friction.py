"""Friction of servos: models M1 to M6 of BAM, and the data sheet's points with them."""

import math
from dataclasses import replace

import numpy as np
import pytest

from phasmid.servo import Friction, Motor, load_servo

RNG = np.random.default_rng(5)
MOTOR, EXTERNAL = RNG.uniform(-3, 3, (2, 10_000))
SPEED = RNG.uniform(-8, 8, 10_000) * RNG.integers(0, 2, 10_000)


# The equations of the paper (Duclusaud et al., 2024), one by one, tm and te the torques of motor
# and load, w the speed. The quadratic term counts only where the torques oppose each other.
def m1(tm, te, w, Kv, Kc):
    return Kv * np.abs(w) + Kc


def stribeck(w, ws, alpha):
    return np.exp(-(np.abs(w / ws) ** alpha))


def m2(tm, te, w, Kv, Kc, Kcs, ws, alpha):
    return Kv * np.abs(w) + Kc + stribeck(w, ws, alpha) * Kcs


def m3(tm, te, w, Kv, Kc, Kl):
    return Kv * np.abs(w) + Kc + Kl * np.abs(tm - te)


def m4(tm, te, w, Kv, Kc, Kcs, Kl, Kls, ws, alpha):
    load = np.abs(tm - te)
    return Kv * np.abs(w) + Kc + Kl * load + stribeck(w, ws, alpha) * (Kcs + Kls * load)


def m5(tm, te, w, Kv, Kc, Kcs, Km, Ke, Kms, Kes, ws, alpha, Q=0.0):
    fading = Kcs + np.abs(Kms * tm - Kes * te) + Q
    return Kv * np.abs(w) + Kc + np.abs(Km * tm - Ke * te) + stribeck(w, ws, alpha) * fading


def m6(tm, te, w, Kv, Kc, Kcs, Km, Ke, Kms, Kes, Kmq, Keq, ws, alpha):
    Q = np.where(np.abs(tm) > np.abs(te), Keq * te**2, Kmq * tm**2)
    Q = np.where(np.sign(tm) == np.sign(te), 0.0, Q)
    return m5(tm, te, w, Kv, Kc, Kcs, Km, Ke, Kms, Kes, ws, alpha, Q)


NUMBERS = {
    "viscous": 0.04,
    "coulomb": 0.03,
    "stribeck": 0.08,
    "load_loss": 0.25,
    "external_loss": 0.12,
    "stribeck_load_loss": 0.09,
    "stribeck_external_loss": 0.21,
    "quadratic_load_loss": 0.006,
    "quadratic_external_loss": 0.011,
    "stribeck_speed": 1.7,
    "stribeck_exponent": 0.84,
}
BASE, STRIBECK = ("viscous", "coulomb"), ("stribeck_speed", "stribeck_exponent")
LOADS = ("load_loss", "external_loss", "stribeck_load_loss", "stribeck_external_loss")


@pytest.mark.parametrize(
    ("equation", "names"),
    [
        (m1, BASE),
        (m2, (*BASE, "stribeck", *STRIBECK)),
        (m3, (*BASE, "load_loss")),
        (m4, (*BASE, "stribeck", "load_loss", "stribeck_load_loss", *STRIBECK)),
        (m5, (*BASE, "stribeck", *LOADS, *STRIBECK)),
        (m6, tuple(NUMBERS)),
    ],
)
def test_friction_is_that_of_the_published_equations(equation, names):
    # Sums of at most five products of numbers below 10: round-off of some 1e-15.
    values = {name: NUMBERS[name] for name in names}
    fields = dict(values)
    if equation in (m3, m4):
        fields["external_loss"] = values["load_loss"]
        fields["stribeck_external_loss"] = values.get("stribeck_load_loss", 0.0)
    expected = equation(MOTOR, EXTERNAL, SPEED, *values.values())
    assert np.allclose(Friction(**fields).limit(MOTOR, EXTERNAL, SPEED), expected, 0, 1e-13)


def test_torques_that_cancel_have_no_quadratic_friction():
    # Neither drives the other: BAM's code leaves the term out there.
    friction = Friction(quadratic_load_loss=1.0, quadratic_external_loss=1.0, stribeck_speed=1.0)
    assert friction.limit(2.0, np.array([-2.0, -1.0, -3.0]), 0.0).tolist() == [0.0, 1.0, 4.0]


EXTENDED = {
    "friction": 0.02,
    "viscous_friction": 0.01,
    "external_loss": 0.05,
    "stribeck_friction": 0.03,
    "stribeck_load_loss": 0.08,
    "stribeck_external_loss": 0.06,
    "quadratic_external_loss": 0.02,
    "stribeck_speed": 1.5,
    "stribeck_exponent": 1.2,
}


def test_both_points_of_the_data_sheet_are_met_with_an_extended_friction():
    # At stall the motor's torque is the load's and the friction's at rest; without load it is the
    # friction's at the no-load speed. Round-off is all that is left.
    servo = replace(load_servo("AX-12A"), **EXTENDED)
    motor, voltage = servo.motor, servo.rated_voltage
    assert 0 < motor.load_loss < 1
    push = motor.constant * voltage / motor.resistance
    friction = float(motor.friction.limit(push, -servo.stall_torque, 0.0))
    assert push - friction == pytest.approx(servo.stall_torque, rel=1e-12)
    assert motor.stall_torque(voltage) == pytest.approx(servo.stall_torque, rel=1e-12)
    assert motor.lifting_current(servo.stall_torque) == pytest.approx(1.5, rel=1e-12)
    speed = servo.no_load_speed
    push = motor.constant * (voltage - motor.constant * speed) / motor.resistance
    assert push == pytest.approx(float(motor.friction.limit(push, 0.0, speed)), rel=1e-12)
    assert motor.no_load_speed(voltage) == pytest.approx(speed, rel=1e-12)


def test_the_sheet_of_a_motor_gives_the_same_motor():
    # The way that an identified servo goes: motor and friction, data sheet, motor and friction.
    friction = Friction(0.02, 0.01, 0.2, 0.05, 0.03, 0.08, 0.06, 0.01, 0.02, 1.5, 1.2)
    motor, voltage = Motor(8.0, 1.7, friction), 12.0
    servo = replace(
        load_servo("AX-12A"),
        **EXTENDED,
        quadratic_load_loss=0.01,
        rated_stall_torque=motor.stall_torque(voltage),
        stall_current=voltage / motor.resistance,
        rated_no_load_speed=motor.no_load_speed(voltage),
    )
    again = servo.motor
    assert again.constant == pytest.approx(motor.constant, rel=1e-10)
    assert again.load_loss == pytest.approx(0.2, rel=1e-9)
    assert replace(again.friction, load_loss=0.2) == friction


def test_gears_without_load_losses_are_no_perpetual_motion():
    # M1 and M2 have an efficiency of exactly 1, which round-off must not turn into more.
    for constant in np.linspace(1.0, 2.0, 50):
        motor = Motor(8.0, float(constant), Friction(0.02, 0.01))
        servo = replace(
            load_servo("AX-12A"),
            friction=0.02,
            viscous_friction=0.01,
            rated_stall_torque=motor.stall_torque(12.0),
            stall_current=1.5,
            rated_no_load_speed=motor.no_load_speed(12.0),
        )
        assert servo.motor.load_loss == pytest.approx(0.0, abs=1e-12)
        assert math.isfinite(servo.motor.constant)
