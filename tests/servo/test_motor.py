"""The motor behind a data sheet, and servos that are none."""

import math
from dataclasses import replace

import numpy as np
import pytest

from phasmid.errors import InvalidInput, InvalidRobot
from phasmid.robot import load_robot, robot_to_toml
from phasmid.servo import load_servo, servo_names

RPM = math.pi / 30


@pytest.mark.parametrize("name", servo_names())
def test_both_points_of_the_data_sheet_are_met_at_once(name):
    # k i (1 - c1) - c0 = stall torque, and V = R i0 + k w0 with k i0 (1 - c1) = c0 + b w0: three
    # equations for three unknowns, solved in closed form, so that only round-off is left.
    servo = load_servo(name)
    motor = servo.motor
    voltage = servo.rated_voltage
    assert motor.stall_torque(voltage) == pytest.approx(servo.rated_stall_torque, rel=1e-12)
    assert motor.no_load_speed(voltage) == pytest.approx(servo.rated_no_load_speed, rel=1e-12)
    assert voltage / motor.resistance == pytest.approx(servo.stall_current, rel=1e-12)
    assert 0 < motor.load_loss < 1


# The makers' points at other voltages than that of the fit: torque [N m], speed [rpm]. For the
# AX-12A the maker gives 12 V alone; its row is that point scaled by the voltage.
@pytest.mark.parametrize(
    ("name", "voltage", "torque", "rpm"),
    [
        ("AX-12A", 9.0, 1.125, 44.25),
        ("XL430-W250", 11.1, 1.4, 57.0),
        ("MX-28", 11.1, 2.3, 50.0),
        ("MX-28", 14.8, 3.1, 67.0),
        # 19.5 kgf cm, of the seller's sheet.
        ("STS3215-7.4V", 7.4, 1.912, 52.0),
    ],
)
def test_the_makers_points_at_other_voltages_are_met_within_3_percent(name, voltage, torque, rpm):
    motor = load_servo(name).motor
    assert motor.stall_torque(voltage) == pytest.approx(torque, rel=0.03)
    assert motor.no_load_speed(voltage) == pytest.approx(rpm * RPM, rel=0.03)


def test_currents_that_lift_and_hold_obey_the_law_of_the_friction():
    """With c0 and c1 alone: k i (1 - c1) = T + c0 to lift, and k i (1 + c1) + c0 = T to hold.

    The holding current is an iteration that stops at 1e-12 N·m.
    """
    motor = load_servo("AX-12A").motor
    k, c0, c1 = motor.constant, motor.coulomb, motor.load_loss
    assert (motor.friction.stribeck, motor.friction.external_loss) == (0, 0)
    torque = np.array([0.0, 0.5 * c0, c0, 0.3, 1.5])
    lifts, holds = motor.lifting_current(torque), motor.holding_current(torque)
    np.testing.assert_allclose(k * lifts * (1 - c1), torque + c0, rtol=1e-12)
    np.testing.assert_array_equal(holds[:3], 0)
    np.testing.assert_allclose(k * holds[3:] * (1 + c1) + c0, torque[3:], rtol=1e-10)
    assert motor.lifting_current(1.5) == pytest.approx(1.5, rel=1e-12)
    rms = np.sqrt((lifts**2 + holds**2) / 2)
    np.testing.assert_allclose(motor.working_current(torque), rms, rtol=1e-12)


@pytest.mark.parametrize("name", servo_names())
def test_a_load_is_lifted_by_more_current_than_holds_it(name):
    motor = load_servo(name).motor
    torque = np.linspace(0, load_servo(name).stall_torque, 50)
    holds, works, lifts = (
        law(torque) for law in (motor.holding_current, motor.working_current, motor.lifting_current)
    )
    assert (holds < works).all()
    assert (works < lifts).all()
    # The gears hold, and no more: friction at this current is what is missing.
    held = motor.constant * holds + motor.friction.limit(motor.constant * holds, torque, 0.0)
    assert (held >= torque - 1e-9).all()
    np.testing.assert_allclose(held[holds > 0], torque[holds > 0], atol=1e-9)


def test_a_servo_without_a_stall_current_has_no_motor():
    servo = replace(load_servo("AX-12A"), stall_current=None)
    with pytest.raises(InvalidInput, match="AX-12A has no stall_current; its own law needs one"):
        _ = servo.motor


@pytest.mark.parametrize(("written", "counts"), [(0, 2), (3, 2), (25, 16), (32, 32), (254, 128)])
def test_the_slope_that_counts_is_the_power_of_two_below(written, counts):
    # The maker's table of the seven values that are used.
    servo = replace(load_servo("AX-12A"), compliance_slope=(written, 32))
    assert servo.effective_slope == (counts, 32)


@pytest.mark.parametrize("name", servo_names())
def test_every_number_of_a_servo_survives_its_robots_file(name, tmp_path):
    robot = replace(load_robot("phantomx-ax"), servo=load_servo(name))
    (tmp_path / "own.toml").write_text(robot_to_toml(robot), encoding="utf-8")
    assert load_robot(tmp_path / "own.toml").servo == robot.servo


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"stall_current": 0.5}, "gears cannot create power"),
        ({"friction": 3.0, "viscous_friction": 1.0}, "the stall torque of 1.5 N·m cannot"),
        ({"punch": 1024.0}, "punch is 1024; it must be 0 or more and 1023 or less"),
        ({"torque_limit": 1.5}, "torque_limit is 1.5; it must be greater than 0 and 1 or less"),
        ({"delay": 11.0}, "delay is 11 s; it must be 0 or more and 0.2 or less"),
        ({"resolution": 0.0}, "resolution is 0 rad; it must be greater than 0"),
        ({"compliance_margin": (1.0, -1.0)}, "compliance_margin.1. is -1; it must be 0 or more"),
        ({"temperature_limit": math.nan}, "temperature_limit is nan; it must be a finite number"),
        ({"law": "magic"}, 'law is "magic"; it must be "compliance" or "pid"'),
    ],
)
def test_a_servo_that_cannot_be_is_refused(changes, said):
    with pytest.raises(InvalidRobot, match=said):
        _ = replace(load_servo("AX-12A"), **changes).motor
