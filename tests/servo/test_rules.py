"""Sources of a servo's numbers, and the rules for those that nobody gives."""

import math
from dataclasses import replace

import pytest

from phasmid.robot import load_robot, robot_to_toml
from phasmid.servo import load_servo, servo_names
from phasmid.servo.catalogue import ServoTable
from phasmid.servo.rules import contradictions
from phasmid.servo.servo import LAW_FIELDS

OPTIONAL_TERMS = {
    "external_loss",
    "stribeck_friction",
    "stribeck_load_loss",
    "stribeck_external_loss",
    "quadratic_load_loss",
    "quadratic_external_loss",
    "stribeck_speed",
    "stribeck_exponent",
    "gain_scale",
}
"""Numbers whose default leaves a term of the model out."""

SHEET = {"name": "mine", "stall_torque": 2.0, "no_load_speed_rpm": 60.0, "rated_voltage": 7.4}


def own(**numbers):
    """A servo as a robot's table gives it."""
    return ServoTable.model_validate(SHEET | numbers).servo()


@pytest.mark.parametrize("name", servo_names())
def test_every_number_of_the_catalogue_says_where_it_comes_from(name):
    servo = load_servo(name)
    idle = {n for law, names in LAW_FIELDS.items() if law != servo.law for n in names}
    used = servo.numbers.keys() - {"name"} - OPTIONAL_TERMS - idle
    assert set(servo.sources) == used
    for number, source in servo.sources.items():
        status, _, publication = source.partition(" (")
        assert status in {"data sheet", "identified", "assumed"}, number
        # Who measured a number, and whose sheet it is, is named.
        assert bool(publication) == (status != "assumed"), number


@pytest.mark.parametrize("name", servo_names())
def test_identified_armatures_lie_around_the_rule_for_the_others(name):
    # The rule is the geometric mean of identified servos, whose ends are a factor of 3 away.
    servo = load_servo(name)
    rotor_time = servo.armature * servo.no_load_speed / servo.stall_torque
    assert 0.02 / 3.1 < rotor_time < 0.02 * 3.2


def test_the_rules_give_a_servo_of_ones_own_what_its_sheet_lacks():
    # 2 N m at 2 pi rad/s and 7.4 V, by the rules of docs/servos.md.
    servo = own()
    assert servo.stall_current == pytest.approx(2 * 2 * math.pi / (0.5 * 7.4))
    assert servo.armature == pytest.approx(0.02 * 2 / (2 * math.pi))
    assert servo.friction == pytest.approx(0.06)
    assert servo.viscous_friction == pytest.approx(0.05 * 2 / (2 * math.pi))
    assert servo.damping == pytest.approx(2 / (2 * math.pi))
    assert servo.gear_stiffness == pytest.approx(80)
    assert servo.stiffness == pytest.approx(20)
    assert servo.continuous_torque == pytest.approx(0.4)
    assert (servo.delay, servo.maximum_voltage) == (0.01, 7.4)
    assert 0 < servo.motor.load_loss < 1
    given = {number for number, source in servo.sources.items() if source == "robot file"}
    assert given == {"stall_torque", "no_load_speed", "rated_voltage"}


@pytest.mark.parametrize("stiffness", [5.0, 90.0])
def test_gain_and_slope_follow_from_the_stiffness(stiffness):
    # Full output, the stall torque, at an error of stall torque over stiffness.
    error = 2.0 / stiffness
    servo = own(stiffness=stiffness)
    assert servo.law == "pid"
    assert servo.p_gain / 128 / 885 * error / servo.resolution == pytest.approx(1.0)
    slope = own(stiffness=stiffness, law="compliance").compliance_slope
    assert [ticks * servo.resolution for ticks in slope] == pytest.approx([error, error])


def test_the_stiffness_of_the_ideal_servo_follows_from_the_law():
    assert own(p_gain=850.0).stiffness == pytest.approx(2 * 850 / 128 / 885 * 4096 / (2 * math.pi))
    servo = own(compliance_slope=32, resolution_deg=0.3)
    assert servo.law == "compliance"
    assert servo.stiffness == pytest.approx(2 / (32 * math.radians(0.3)))


def test_a_number_that_a_drive_does_not_use_is_found():
    assert contradictions(own(stiffness=20.0)) == []
    assert contradictions(load_robot("phantomx-mk4").servo) == []
    # 261 ticks for 2.5 N m/rad; the servo takes 128 at the most, which makes it twice as stiff.
    for numbers in (
        {"stiffness": 20.0, "p_gain": 400.0},
        {"stiffness": 2.5, "compliance_margin": 1},
    ):
        (found,) = contradictions(own(**numbers))
        assert found.startswith(f"stiffness {numbers['stiffness']:g} N·m/rad acts with drive ")
    (found,) = contradictions(own(law="pid", punch=20))
    assert found == 'punch has no effect with law "pid".'
    (found,) = contradictions(own(damping=0.1))
    assert found.startswith('damping 0.1 N·m·s/rad acts with drive "ideal-servo" alone')


def test_one_number_stands_for_both_directions():
    both = own(compliance_margin=3, compliance_slope=[16, 64])
    assert (both.compliance_margin, both.compliance_slope) == ((3, 3), (16, 64))


@pytest.mark.parametrize(
    "servo",
    [
        own(sources={"unknown": ["stall_current"]}),
        replace(load_servo("AX-12A"), stall_current=None, sources={}),
        replace(load_servo("AX-12A"), law="pid"),
        replace(load_servo("XL430-W250"), law="compliance"),
    ],
    ids=["unknown current", "no sources", "a law changed to pid", "a law changed to compliance"],
)
def test_no_rule_changes_a_servo_that_is_read_again(servo, tmp_path):
    # Numbers of its law that no source names are written, too, and an unknown one stays so.
    robot = replace(load_robot("phantomx-ax"), servo=servo)
    (tmp_path / "own.toml").write_text(robot_to_toml(robot), encoding="utf-8")
    assert load_robot(tmp_path / "own.toml").servo == servo
