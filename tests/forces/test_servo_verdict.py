"""Whether servos hold a robot: against statics by hand and the limits of the data sheet."""

import math
from dataclasses import replace

import numpy as np
import pytest

from phasmid.forces import Holding, servo_verdict
from phasmid.gait import load_gait
from phasmid.kinematics import neutral_feet
from phasmid.robot import load_robot, with_payload
from phasmid.servo import load_servo
from phasmid.units import STANDARD_GRAVITY

PAPER = load_robot("phantomx-paper")
TRIPOD = load_gait("tripod")
STEP = 0.04


def with_massless_legs(robot, mass):
    """All of the mass in the trunk, at its origin: links of a millionth of a gram."""
    legs = tuple(
        replace(
            leg,
            **{
                link.name: replace(link, mass=1e-9, inertia=1e-12 * np.eye(3)) for link in leg.links
            },
        )
        for leg in robot.legs
    )
    return replace(robot, legs=legs, body=replace(robot.body, mass=mass, com=np.zeros(3)))


def with_servo(robot, **numbers):
    return replace(robot, servo=replace(robot.servo, **numbers))


def femur_torque_by_hand(mass, gravity=9.81):
    """Largest torque of a femur on three feet: load times its lever from the femur's axis.

    The weight is shared so that forces and moments about the trunk's origin vanish. The trunk has
    gone s of a step: feet are s behind their neutral places. The lever is the foot's distance from
    the coxa axis less the coxa's length; links weigh nothing.
    """
    neutral, largest = neutral_feet(PAPER), 0.0
    for tripod in ([0, 2, 4], [1, 3, 5]):
        for s in (-STEP / 2, 0.0, STEP / 2):
            feet = neutral[tripod] - [s, 0.0, 0.0]
            rows = np.vstack([np.ones(3), feet[:, 0], feet[:, 1]])
            load = np.linalg.solve(rows, [mass * gravity, 0.0, 0.0])
            hips = np.array([PAPER.legs[i].mount_position for i in tripod])
            lever = np.hypot(*(feet - hips)[:, :2].T) - [PAPER.legs[i].coxa.length for i in tripod]
            largest = max(largest, float((load * lever).max()))
    return largest


def test_the_verdict_is_statics_by_hand_on_the_three_feet_of_the_gait():
    # Solved alike but for round-off and the links' nanograms.
    mass = 2.5
    verdict = servo_verdict(with_massless_legs(PAPER, mass), TRIPOD, gravity=STANDARD_GRAVITY)
    assert verdict.torque == pytest.approx(femur_torque_by_hand(mass), rel=1e-6)
    assert verdict.joint == "right_middle.femur"
    assert verdict.feet == (2, 4, 6)


def test_a_robot_is_held_up_to_the_stall_torque_and_for_long_up_to_the_continuous_torque():
    needed = servo_verdict(PAPER, TRIPOD, gravity=STANDARD_GRAVITY)

    def holding(**numbers):
        return servo_verdict(
            with_servo(PAPER, stall_current=None, **numbers), TRIPOD, gravity=STANDARD_GRAVITY
        ).holding

    torque, rms = needed.torque, needed.rms_torque
    assert holding(rated_stall_torque=0.999 * torque) is Holding.DOES_NOT_HOLD
    assert holding(rated_stall_torque=1.001 * torque, continuous_torque=0.1) is Holding.LIMITED
    assert holding(rated_stall_torque=9.0, continuous_torque=0.999 * rms) is Holding.LIMITED
    assert holding(rated_stall_torque=9.0, continuous_torque=1.001 * rms) is Holding.HOLDS
    # A tripod bears for half of the cycle: its rms torque is the largest over the root of two.
    assert rms == pytest.approx(torque / math.sqrt(2), rel=0.02)


def test_a_heavy_robot_on_small_servos_is_told_with_joint_torque_and_feet():
    verdict = servo_verdict(
        with_payload(PAPER, 10.6 - PAPER.mass), TRIPOD, gravity=STANDARD_GRAVITY
    )
    assert verdict.holding is Holding.DOES_NOT_HOLD
    assert verdict.lines[0] == (
        "DOES NOT HOLD: right_middle.femur needs 4.01 N·m on feet 2, 4, 6 of the tripod gait, "
        "267 % of stall."
    )
    assert verdict.lines[1].startswith(
        "AX-12A at 12 V: stall 1.5 N·m, continuous 0.3 N·m; rms of the gait"
    )


def test_a_supply_above_the_data_sheet_adds_no_torque_and_is_a_warning():
    small = with_servo(PAPER, name="MG996R", rated_voltage=6.0, maximum_voltage=6.0)
    at_rated, above = (
        servo_verdict(small, TRIPOD, gravity=STANDARD_GRAVITY),
        servo_verdict(with_servo(small, supply=12.0), TRIPOD, gravity=STANDARD_GRAVITY),
    )
    assert at_rated.voltage == 6.0
    assert above.stall_torque == at_rated.stall_torque == pytest.approx(1.5)
    assert above.holding is at_rated.holding
    assert above.lines[-1].startswith("WARNING: the supply of 12 V is above the 6 V of the MG996R;")
    assert not any("WARNING" in line for line in at_rated.lines)
    # The maker of the MX-28 gives 3.1 N·m at 14.8 V, the end of its range.
    strong = replace(PAPER, servo=load_servo("MX-28").at(14.8))
    assert servo_verdict(strong, TRIPOD, gravity=STANDARD_GRAVITY).stall_torque == pytest.approx(
        3.1, rel=0.01
    )
    # Less than the rated voltage is less torque.
    low = with_servo(PAPER, supply=9.0)
    assert servo_verdict(low, TRIPOD, gravity=STANDARD_GRAVITY).stall_torque == pytest.approx(
        1.114, abs=1e-3
    )


def test_heat_and_hot_air_limit_servos_whose_torque_is_continuous():
    """A servo that reaches its limit even by the lowest estimate does not hold for ever."""
    warm = with_servo(PAPER, continuous_torque=1.4, thermal_resistance=40.0)
    verdict = servo_verdict(warm, TRIPOD, gravity=STANDARD_GRAVITY)
    assert verdict.holding is Holding.LIMITED
    assert math.isfinite(verdict.time_to_limit[1])
    assert any("Estimate" in line for line in verdict.lines)
    hot = servo_verdict(
        with_servo(PAPER, ambient_temperature=90.0), TRIPOD, gravity=STANDARD_GRAVITY
    )
    assert hot.holding is Holding.DOES_NOT_HOLD
    assert any("The air of 90 °C" in line for line in hot.lines)


def test_a_robot_that_topples_is_named_before_its_servos():
    leaning = replace(PAPER, body=replace(PAPER.body, com=np.array([0.24, 0.0, 0.0])))
    verdict = servo_verdict(leaning, TRIPOD, gravity=STANDARD_GRAVITY)
    assert verdict.holding is Holding.NOT_STABLE
    assert verdict.lines == (
        "NOT STABLE: while legs 2, 4, 6 stand in the tripod gait, the centre of mass is not "
        "between their feet.",
        f"Where the robot is stable, {verdict.joint} needs {verdict.torque:.3g} N·m, "
        f"{100 * verdict.torque / 1.5:.0f} % of stall.",
    )
    # Standing on all feet counts where the gait's stances are not stable.
    heavy = servo_verdict(with_payload(leaning, 30.0), TRIPOD, gravity=STANDARD_GRAVITY)
    assert heavy.holding is Holding.DOES_NOT_HOLD
    assert not heavy.is_possible
    assert heavy.torque > heavy.stall_torque


def test_heat_is_a_range_that_holds_the_steady_warming_by_hand():
    """T = T_air + R_th R mean(i²), half and twice of the rise; i = (τ + c0)/(k (1 - c1)).

    The femur bears its torque for half of the cycle and in the air its leg's weight, whose share
    of the heat is below 3 %.
    """
    verdict, servo = servo_verdict(PAPER, TRIPOD, gravity=STANDARD_GRAVITY), PAPER.servo
    motor = servo.motor
    current = (verdict.torque + motor.coulomb) / (motor.constant * (1 - motor.load_loss))
    rise = servo.thermal_resistance * motor.resistance * current**2 / 2
    low, high = verdict.heat
    assert low - 25 == pytest.approx(rise / 2, rel=0.05)
    assert high - 25 == pytest.approx(2 * rise, rel=0.05)
    soon, late = verdict.time_to_limit
    constant = servo.thermal_resistance * servo.heat_capacity
    assert soon == pytest.approx(constant * math.log((high - 25) / (high - 70)), rel=1e-9)
    assert math.isinf(late)
