"""Verdict on the servos: statics, heat and margins by hand, and the limits of the data sheet."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from advice.by_hand import with_massless_legs, with_numbers
from phasmid.advice import Grade, Holding, servo_verdict
from phasmid.advice.answer import GOOD
from phasmid.advice.bounds import LEAST_FRICTION
from phasmid.advice.verdict import HOUR
from phasmid.errors import Unreachable
from phasmid.kinematics import neutral_feet
from phasmid.robot import load_robot, with_payload
from phasmid.scenario import Scenario
from phasmid.servo import load_servo
from phasmid.servo.heat import HEAT_RANGE

PAPER = load_robot("phantomx-paper")
MASS, STEP = 2.5, 0.04


def verdict_of(robot=PAPER, **changes):
    return servo_verdict(Scenario(robot=robot, gait="tripod").replace(**changes))


def unknown_heat(**numbers):
    """The paper's robot with servos whose torque and speed alone are known."""
    return with_numbers(PAPER, stall_current=None, **numbers)


def femur_torques_by_hand(s, mass=MASS, gravity=9.81):
    """Torques of the femora, shape (6,): of each tripod the load times its lever.

    The weight is shared so that forces and moments about the trunk's origin vanish. The trunk has
    gone s of a step: feet are s behind their neutral places. The lever is the foot's distance from
    the coxa axis less the coxa's length; links weigh nothing.
    """
    neutral, torques = neutral_feet(PAPER), np.zeros(6)
    for tripod in ([0, 2, 4], [1, 3, 5]):
        feet = neutral[tripod] - [s, 0.0, 0.0]
        rows = np.vstack([np.ones(3), feet[:, 0], feet[:, 1]])
        load = np.linalg.solve(rows, [mass * gravity, 0.0, 0.0])
        hips = np.array([PAPER.legs[i].mount_position for i in tripod])
        lever = np.hypot(*(feet - hips)[:, :2].T) - [PAPER.legs[i].coxa.length for i in tripod]
        torques[tripod] = load * lever
    return torques


def test_the_torque_is_statics_by_hand_on_the_three_feet_of_the_gait():
    # Solved alike but for round-off and the links' nanograms.
    verdict = verdict_of(with_massless_legs(PAPER, MASS))
    largest = max(femur_torques_by_hand(s).max() for s in (-STEP / 2, 0.0, STEP / 2))
    assert verdict.torque == pytest.approx(largest, rel=1e-6)
    assert verdict.peak_share[0] == pytest.approx(largest / 1.5, rel=1e-6)
    assert verdict.joint == "right_middle.femur"
    assert verdict.feet == (2, 4, 6)


def test_a_robot_is_held_up_to_the_stall_torque_and_for_long_up_to_the_continuous_torque():
    torque = verdict_of(unknown_heat()).torque
    rms = verdict_of(unknown_heat()).rms_torque[0]

    def holding(**numbers):
        return verdict_of(unknown_heat(**numbers), friction=0.0).holding

    known = {"sources": {"continuous_torque": "data sheet"}}
    assert holding(rated_stall_torque=0.999 * torque) is Holding.DOES_NOT_HOLD
    weak = {"rated_stall_torque": 1.001 * torque, "continuous_torque": 0.1}
    assert holding(**weak, **known) is Holding.LIMITED
    strong = {"rated_stall_torque": 9.0} | known
    assert holding(continuous_torque=0.999 * rms, **strong) is Holding.LIMITED
    assert holding(continuous_torque=1.001 * rms, **strong) is Holding.HOLDS
    # A tripod bears for half of the cycle: its rms torque is the largest over the root of two.
    assert rms == pytest.approx(torque / math.sqrt(2), rel=0.02)


def test_friction_decides_between_servos_that_hold_and_that_do_not():
    torque = verdict_of().torque
    weak = with_numbers(PAPER, rated_stall_torque=0.8 * torque)
    on_ice = verdict_of(weak, friction=0.01)
    needed = on_ice.least_friction
    assert 0.01 < needed < 0.5
    assert on_ice.holding is Holding.DOES_NOT_HOLD
    assert on_ice.grade is Grade.NO
    # Rounded up: what is printed is enough.
    printed = math.ceil(100 * needed) / 100
    assert f"whose friction is 0.01 and not {printed:g}:" in on_ice.lines[0]
    rough = verdict_of(weak, friction=1.01 * needed)
    assert rough.holding is Holding.NEEDS_FRICTION
    assert rough.grade is Grade.TIGHT
    # The best help brings the largest share to no more than 1, the linear pyramids' round-off.
    assert rough.margins["peak"][0] == pytest.approx(0.8, rel=1e-9)
    assert rough.margins["peak"][1] >= 1 - 1e-5
    assert verdict_of(friction=0.01).least_friction == 0
    # A patch of ice on the floor counts.
    icy = verdict_of(weak, patches=[[0, 1, 0, 1, 0.02]])
    assert (icy.floor_friction, icy.holding) == (0.02, Holding.DOES_NOT_HOLD)


def test_four_feet_that_must_share_the_load_unevenly_need_help():
    """An even load exceeds the stall torque; vertical forces that spare that joint do not."""
    verdict = verdict_of("phantomx-ax", gait="metachronal", payload=3.0)
    high, low = verdict.peak_share
    assert high > 1 > low
    assert verdict.holding is Holding.NEEDS_FRICTION
    assert verdict.least_friction == LEAST_FRICTION
    assert "of 0.01 or more" in verdict.lines[0]


def test_a_stride_without_room_is_judged_on_the_spot_and_says_so():
    verdict = verdict_of("phantomx-ax", step_length=0.4)
    assert "speed" not in verdict.margins
    assert math.isnan(verdict.speed_share)
    assert verdict.as_dict()["speed_share"] is None
    assert verdict.lines[0].endswith("no room for this stride: judged in steps on the spot.")


def test_grades_are_by_the_least_margin_without_help():
    torque = verdict_of().torque
    for share, grade in ((1.001 * GOOD, Grade.GOOD), (0.999 * GOOD, Grade.TIGHT)):
        robot = unknown_heat(
            rated_stall_torque=share * torque,
            continuous_torque=9.0,
            rated_no_load_speed=99.0,
            sources={},
        )
        # The continuous torque is at most the stall torque.
        verdict = verdict_of(robot)
        assert verdict.deciding == "peak"
        assert verdict.margin[0] == pytest.approx(share, rel=1e-9)
        assert verdict.grade is grade
    assert GOOD == 1.25


def test_the_speed_is_a_margin_of_its_own():
    fastest = 1 / verdict_of().margins["speed"][0] * PAPER.servo.no_load_speed
    numbers = {"rated_no_load_speed": 0.5 * fastest, "continuous_torque": 9.0}
    slow = verdict_of(unknown_heat(**numbers, rated_stall_torque=9.0))
    assert slow.margins["speed"] == (pytest.approx(0.5), pytest.approx(0.5))
    assert (slow.deciding, slow.holding, slow.grade) == ("speed", Holding.TOO_SLOW, Grade.NO)
    assert slow.lines[0].startswith("TOO SLOW: the walk needs 200 % of a servo's no-load speed.")
    # Half of the period, twice the speed.
    shares = [verdict_of(period=period).speed_share for period in (2.0, 1.0)]
    assert shares[1] == pytest.approx(2 * shares[0], rel=1e-9)


def test_a_heavy_robot_on_small_servos_is_told_with_joint_torque_and_feet():
    verdict = verdict_of(with_payload(PAPER, 10.6 - PAPER.mass))
    assert verdict.holding is Holding.DOES_NOT_HOLD
    assert not verdict.holding.is_possible
    share = verdict.peak_share[1]
    assert share > 1
    assert (
        "right_middle.femur needs 4.01 N·m on feet 2, 4, 6 of the tripod gait, 267 % of"
        in (verdict.lines[0])
    )
    assert verdict.lines[0].endswith(f"{100 * share:.0f} % with its best help.")
    assert any("AX-12A at 12 V: stall 1.5 N·m, continuous 0.3" in line for line in verdict.lines)


def test_a_supply_above_the_data_sheet_adds_no_torque_and_is_a_warning():
    small = with_numbers(PAPER, name="MG996R", rated_voltage=6.0, maximum_voltage=6.0)
    at_rated, above = verdict_of(small), verdict_of(with_numbers(small, supply=12.0))
    assert at_rated.voltage == 6.0
    assert above.stall_torque == at_rated.stall_torque == pytest.approx(1.5)
    assert above.holding is at_rated.holding
    assert above.lines[1].startswith("WARNING: the supply of 12 V is above the 6 V of the MG996R;")
    assert above.grade is Grade.NO
    assert above.answer == f"{at_rated.answer}; the supply is too high"
    # Three full cells on servos of 12 V are usual.
    full = verdict_of(voltage=12.6)
    assert any("WARNING" in line for line in full.lines)
    assert full.grade is verdict_of().grade
    assert not any("WARNING" in line for line in at_rated.lines)
    # The maker of the MX-28 gives 3.1 N·m at 14.8 V, the end of its range.
    strong = replace(PAPER, servo=load_servo("MX-28").at(14.8))
    assert verdict_of(strong).stall_torque == pytest.approx(3.1, rel=0.01)
    # Less than the rated voltage is less torque.
    low = verdict_of(with_numbers(PAPER, supply=9.0))
    assert low.stall_torque == pytest.approx(1.114, abs=1e-3)


def test_a_robot_that_topples_is_named_before_its_servos():
    def leaning(mass, *com):
        body = replace(PAPER.body, mass=mass, com=np.array(com))
        return replace(unknown_heat(rated_stall_torque=20.0), body=body)

    # To the left, the centre of mass leaves the tripod of the middle right leg.
    left = leaning(5.0, 0.0, 0.25, 0.0)
    verdict = verdict_of(left)
    assert verdict.holding is Holding.NOT_STABLE
    assert not verdict.holding.is_possible
    assert verdict.feet == (2, 4, 6)
    assert verdict.lines[0] == (
        "NOT STABLE: while legs 2, 4, 6 stand in the tripod gait, the centre of mass is not "
        "between their feet."
    )
    assert not any("Heat" in line or "Margin" in line for line in verdict.lines)
    assert verdict.hour_temperature is None
    # Servos that do not hold where it stands do not change that.
    weak = verdict_of(with_numbers(left, rated_stall_torque=1.0))
    assert weak.holding is Holding.NOT_STABLE
    assert weak.torque > weak.stall_torque
    # And ahead of all feet.
    nowhere = verdict_of(leaning(50.0, 0.25, 0.0, 0.0))
    assert nowhere.holding is Holding.NOT_STABLE
    assert math.isnan(nowhere.torque)


def squared_current_by_hand(motor, torque):
    """Mean squares of the currents that lift and that hold a load, by c0 and c1 alone [A²]."""
    c0, c1, k = motor.coulomb, motor.load_loss, motor.constant
    lifts = (torque + c0) / (k * (1 - c1))
    holds = np.maximum(torque - c0, 0) / (k * (1 + c1))
    return (lifts**2 + holds**2) / 2


def test_heat_is_a_range_by_hand():
    """T = T_air + P R_th (1 - exp(-t/(R_th C))) with P = R mean(i²) + V I of the electronics.

    The lowest is a third of it.

    The mean is one over a step from rest to rest, and of the swing without load, of the femur that
    bears most. The error of Simpson's rule over four parts of it is below 1e-3.
    """
    robot = with_massless_legs(PAPER, MASS)
    verdict, servo = verdict_of(robot), robot.servo
    motor = servo.motor
    u = np.linspace(0, 1, 401)
    places = STEP * (10 * u**3 - 15 * u**4 + 6 * u**5 - 0.5)
    bearing = [squared_current_by_hand(motor, femur_torques_by_hand(s)) for s in places]
    swinging = squared_current_by_hand(motor, 0.0)
    power = motor.resistance * ((np.trapezoid(bearing, u, axis=0) + swinging) / 2).max()
    power += servo.voltage * servo.standby_current
    time, resistance = servo.thermal_resistance * servo.heat_capacity, servo.thermal_resistance
    warmth = power * resistance * (1 - math.exp(-HOUR / time))
    hottest, coolest = verdict.hour_temperature
    assert hottest - 25 == pytest.approx(warmth * HEAT_RANGE[1], rel=1e-3)
    # Friction of the floor lowers the currents, too.
    assert 0 < coolest - 25 < warmth * HEAT_RANGE[0]
    limit = 25 + 0.5 * power * resistance
    soon, late = verdict_of(with_numbers(robot, temperature_limit=limit)).time_to_limit
    assert soon == pytest.approx(time * math.log(2), rel=3e-3)
    assert math.isinf(late)


def test_heat_and_hot_air_limit_servos_whose_torque_is_continuous():
    """A servo that may reach its limit by the highest estimate holds for a limited time."""
    warm = verdict_of(with_numbers(PAPER, continuous_torque=1.4, thermal_resistance=40.0))
    assert warm.holding is Holding.LIMITED
    soon, late = warm.time_to_limit
    assert soon < HOUR < late
    (line,) = (line for line in warm.lines if line.startswith("Heat"))
    assert f"the limit of 70 °C after {soon / 60:.0f} min (no help)" in line
    assert line.endswith("The servo then shuts down.")
    hot = verdict_of(ambient_temperature=90.0)
    assert hot.holding is Holding.DOES_NOT_HOLD
    assert hot.grade is Grade.NO
    assert hot.lines[0].startswith("DOES NOT HOLD in air of 90 °C.")
    assert hot.margins["heat"] == (0, 0)
    assert any("the air is not below the limit of 70 °C" in line for line in hot.lines)


@pytest.mark.parametrize(
    ("interface", "end"),
    [
        ("pwm", "Nothing stops this servo there: it wears out or burns."),
        ("bus", "The servo then shuts down."),
        ("smart", "The servo then shuts down."),
        (None, "(best help)."),
    ],
)
def test_what_happens_at_the_temperature_limit_depends_on_the_interface(interface, end):
    hot = verdict_of(with_numbers(PAPER, thermal_resistance=99.0, interface=interface))
    (line,) = (line for line in hot.lines if line.startswith("Heat"))
    assert line.endswith(end)
    cool = verdict_of(with_numbers(PAPER, interface=interface))
    assert not any(end in line for line in cool.lines)


def test_without_a_stall_current_heat_is_unknown_and_the_continuous_torque_counts():
    known = verdict_of(with_numbers(PAPER, continuous_torque=0.4))
    unknown = verdict_of(unknown_heat(continuous_torque=0.4))
    assert unknown.hour_temperature is None
    assert unknown.time_to_limit is None
    assert "heat" not in unknown.margins
    assert any(line.startswith("Heat: unknown") for line in unknown.lines)
    assert unknown.margins["continuous"] == pytest.approx(
        tuple(0.4 / torque for torque in unknown.rms_torque)
    )
    assert unknown.margins["continuous"][0] < 1
    # Where heat is known, the continuous torque is told, and does not decide.
    assert "continuous" not in known.margins
    assert "continuous 0.4 N·m, rms of the walk" in known.lines[-1]
    assert (known.holding, unknown.holding) == (Holding.HOLDS, Holding.LIMITED)
    weak = verdict_of(unknown_heat(continuous_torque=0.05))
    assert weak.margins["continuous"][1] < 1
    assert weak.grade is Grade.NO


def test_every_joint_is_judged_by_its_own_strength():
    """Stronger femora need smaller shares, and their currents are those of smaller torques."""
    own = verdict_of()
    legs = tuple(replace(leg, strength=np.array([1.0, 2.0, 1.0])) for leg in PAPER.legs)
    strong = verdict_of(replace(PAPER, legs=legs))
    kind = own.joint.rpartition(".")[2]
    assert kind == "femur"
    half = 0.5 * own.peak_share[0]
    assert strong.peak_share[0] >= half * (1 - 1e-9)
    assert strong.peak_share[0] < own.peak_share[0]
    if strong.joint.endswith("femur"):
        assert strong.stall_torque == pytest.approx(2 * own.stall_torque)
        assert strong.peak_share[0] == pytest.approx(half)
    assert strong.hour_temperature[0] < own.hour_temperature[0]
    assert strong.margins["heat"][0] > 1.5 * own.margins["heat"][0]


def test_a_dictionary_has_plain_numbers_and_the_sentences():
    verdict = verdict_of()
    found = json.loads(json.dumps(verdict.as_dict(), allow_nan=False))
    assert found["holding"] == "HOLDS"
    assert found["least_margin"] == pytest.approx(verdict.margin[0])
    assert found["lines"] == list(verdict.lines)
    assert found["time_to_limit"] == [None, None]
    assert found["margins"]["peak"] == pytest.approx(verdict.margins["peak"])


def test_a_foot_out_of_reach_is_refused():
    legs = tuple(replace(leg, neutral_foot=np.array([0.9, 0.0, -0.1])) for leg in PAPER.legs)
    with pytest.raises(Unreachable, match="leg 1, point 0: foot target"):
        verdict_of(replace(PAPER, legs=legs))
