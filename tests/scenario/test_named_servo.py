"""The servo of the catalogue that a scenario names: one field of files, Python and options."""

from dataclasses import replace

import numpy as np
import pytest

import phasmid
from phasmid.errors import InvalidInput
from phasmid.robot import load_robot, robot_to_toml, with_servo
from phasmid.scenario import (
    Scenario,
    load_scenario,
    option_keys,
    recorded_scenario,
    scenario_to_toml,
)
from phasmid.servo import load_servo

MX = load_servo("MX-28")


def own_joints():
    """A robot whose joints are stronger and slower than its servo."""
    robot = load_robot("phantomx-ax")
    legs = tuple(
        replace(leg, strength=2 * np.ones(3), speed_ratio=np.array([0.5, 1.0, 1.0]))
        for leg in robot.legs
    )
    return replace(robot, legs=legs)


@pytest.mark.parametrize("text", ['servo = "MX-28"', '[servo]\nservo = "MX-28"'])
def test_a_file_names_the_servo_as_python_does(tmp_path, text):
    path = tmp_path / "s.toml"
    path.write_text(text, encoding="utf-8")
    scenario = load_scenario(path)
    assert scenario == Scenario().replace(servo="MX-28") == Scenario(servo="MX-28")
    assert option_keys()["servo"] == ("servo", "servo")
    path.write_text(scenario_to_toml(scenario, "phantomx-paper"), encoding="utf-8")
    assert load_scenario(path) == scenario


@pytest.mark.parametrize("robot", [load_robot("phantomx-mk4"), own_joints()], ids=["mk4", "own"])
def test_every_joint_has_the_named_servo(robot):
    """All that depends on the servo is as on a robot with that servo in its file."""
    named = Scenario().replace(robot=robot, servo="MX-28", drive="servo")
    given = Scenario().replace(robot=with_servo(robot, MX), drive="servo")
    one, other = named.build(), given.build()
    for ours, theirs in ((one.robot, other.robot), (one.file_robot, other.file_robot)):
        assert robot_to_toml(ours) == robot_to_toml(theirs)
        assert ours.servo == theirs.servo
        np.testing.assert_array_equal(ours.arrays.stall_torque, theirs.arrays.stall_torque)
    assert (one.scale, one.world) == (other.scale, other.world)
    assert named.replace(drive=None).driven() == named


def test_settings_stay_with_another_servo_and_its_supply_is_the_rated_one():
    scenario = Scenario().replace(servo="MX-28", torque_limit=0.5)
    assert scenario.load_robot().servo.voltage == MX.rated_voltage
    other = scenario.replace(voltage=11.0).replace(servo="XL430-W250")
    assert (
        other.servo == Scenario().replace(voltage=11.0, servo="XL430-W250", torque_limit=0.5).servo
    )
    assert other.load_robot().servo.voltage == 11.0
    own = other.replace(servo=None)
    assert own.load_robot().servo.name == "AX-12A"
    assert own.servo.torque_limit == 0.5
    assert scenario.replace(robot="phantomx-mk4").load_robot().servo.name == "MX-28"


def test_values_of_the_robots_servo_count_beside_the_name():
    values = {"robot.servo.stall_torque": 9.0, "servo": "MX-28"}
    servo = Scenario().replace(**values).load_robot().servo
    assert (servo.name, servo.rated_stall_torque) == ("MX-28", 9.0)
    assert Scenario().replace(servo="MX-28").replace(**values).load_robot().servo == servo


@pytest.mark.parametrize(
    ("name", "hint"), [("MX-82", '"MX-28"'), ("mg996r", '"MG996R"'), ("motor", "one of AX-12A, ")]
)
def test_an_unknown_servo_is_told_with_the_nearest(tmp_path, name, hint):
    path = tmp_path / "s.toml"
    path.write_text(f'[servo]\nservo = "{name}"\n', encoding="utf-8")
    for load, where in (
        (lambda: load_scenario(path), "s.toml"),
        (lambda: Scenario().replace(servo=name), ""),
    ):
        with pytest.raises(InvalidInput) as refusal:
            load()
        assert refusal.value.what == f'no servo called "{name}".'
        assert refusal.value.hint.startswith(hint)
        assert refusal.value.where == where
    with pytest.raises(InvalidInput, match="servo is 3; it must be a table"):
        Scenario().replace(servo=3)


def test_heavier_servos_count_in_the_trunk_and_lighter_ones_leave_the_masses():
    """An MX-28 weighs 77 g, an AX-12A 54.6 g and an LX-16A 52 g."""
    own = Scenario().replace(payload=0.2).load_robot()
    heavier = Scenario().replace(payload=0.2, servo="MX-28").load_robot()
    assert heavier.mass - own.mass == pytest.approx(18 * (MX.mass - own.servo.mass), rel=1e-12)
    assert MX.mass - own.servo.mass == pytest.approx(0.0224)
    for ours, theirs in zip(heavier.legs, own.legs, strict=True):
        assert [link.mass for link in ours.links] == [link.mass for link in theirs.links]
    lighter = Scenario().replace(payload=0.2, servo="LX-16A").load_robot()
    assert lighter.servo.mass < own.servo.mass
    assert lighter.mass == own.mass
    # A servo of unknown mass, and the way back, change nothing.
    unknown = with_servo(own, replace(MX, mass=None))
    assert unknown.mass == own.mass
    assert with_servo(unknown, MX).mass == own.mass
    back = Scenario().replace(payload=0.2, servo="MX-28").replace(servo=None)
    assert back.load_robot().mass == own.mass


@pytest.mark.parametrize(("one", "other"), [(None, "MX-28"), ("MX-28", None)])
def test_a_walk_serves_other_servos_that_are_quick_enough(one, other):
    """An MX-28 turns 5.8 rad/s without load, an AX-12A 6.2; the walk needs 1.5."""
    walk = phasmid.plan(Scenario().replace(servo=one))
    scenario = Scenario().replace(servo=other)
    served = walk.for_experiment(scenario)
    assert robot_to_toml(served.robot) == robot_to_toml(scenario.load_robot())
    np.testing.assert_array_equal(served.q, walk.q)


def test_a_run_repeats_with_the_servo_that_it_had():
    scenario = Scenario().replace(servo="MX-28", drive="servo", duration=0.1)
    run = phasmid.simulate(scenario, phasmid.plan(scenario))
    assert 'servo = "MX-28"' in run.attrs["scenario"]
    assert run.attrs["servo"] == "MX-28"
    assert recorded_scenario(run.attrs).load_robot().servo == MX
    assert phasmid.replay(run).difference is None
    # The numbers are those of the record, whatever the catalogue says by now.
    stronger = with_servo(load_robot("phantomx-paper"), replace(MX, rated_stall_torque=9.0))
    attributes = run.attrs | {"robot": robot_to_toml(stronger)}
    assert recorded_scenario(attributes).load_robot().servo.rated_stall_torque == 9.0
