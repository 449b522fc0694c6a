"""Every part of phasmid takes servos and gravity as the experiment has them."""

from xml.etree import ElementTree as ET

import numpy as np
import pytest

import phasmid
from phasmid.advice import servo_verdict
from phasmid.control import LocomotionEngine
from phasmid.control.safety_filter import SafetyFilter
from phasmid.experiment import Command, Observation
from phasmid.kinematics import joint_angles
from phasmid.servo import load_servo
from phasmid.simulation.drive import scenario_controller
from phasmid.studio.bench import bench
from phasmid.studio.messages import Bench
from phasmid.studio.setting import Setting

RATE = 200.0

MARS = 3.71
"""Gravity [m/s²]."""


def walking(**changes):
    return phasmid.load_scenario("paper").replace(robot="phantomx-ax", duration=0.5, **changes)


@pytest.mark.usefixtures("compiled_engine")
@pytest.mark.parametrize("drive", ["servo", "ideal-servo"])
@pytest.mark.parametrize(
    ("voltage", "limit"),
    [(12.0, 1.0), (11.1, 1.0), (9.0, 1.0), (7.4, 1.0), (11.1, 0.7), (14.0, 0.9)],
)
def test_all_limits_are_those_of_the_servo_at_its_supply(voltage, limit, drive, tmp_path):
    scenario = walking(drive=drive, voltage=voltage, torque_limit=limit)
    motor = load_servo("AX-12A").motor
    # The limit is one of the winding's voltage; the maker vouches for 12 V at most.
    applied = limit * min(voltage, 12.0)
    speed, torque = motor.no_load_speed(applied), motor.stall_torque(applied)

    controller = scenario_controller(scenario, RATE)
    engine = controller.controller.walker
    used = engine.settings.feed_forward.torque_used
    feed_forward = engine.feed_forward.parameters
    walk = phasmid.plan(scenario)
    report = phasmid.summarise(phasmid.simulate(scenario, walk))["robot"]
    phasmid.save_robot(scenario.load_robot(), tmp_path / "robot.xml")
    file = ET.parse(tmp_path / "robot.xml")
    studio = bench(Setting(scenario).robot, Bench(leg=1), 9.81)["servo"]
    speeds = {
        "plan": walk.robot.servo.no_load_speed,
        "engine": engine.model.joint_speed / 0.95,
        "safety": controller.speed / 1.02,
        "feed-forward": feed_forward.stall_torque / feed_forward.torque_drop,
        "report": report["no_load_speed"],
        "export": float(file.find("custom/numeric").get("data")),
        "studio": studio["speed"],
    }
    torques = {
        "feed-forward": feed_forward.stall_torque / used,
        "verdict": servo_verdict(scenario).stall_torque,
        "report": report["stall_torque"],
        "export": float(file.find("actuator/position").get("forcerange").split()[1]),
        "studio": studio["torque"],
    }
    # A motor meets the two points of its data sheet to round-off.
    for found, known in ((speeds, speed), (torques, torque)):
        for name, value in found.items():
            np.testing.assert_allclose(value, known, rtol=1e-12, err_msg=name)


def test_a_servo_is_taken_to_another_supply_and_back():
    servo = load_servo("MX-28")
    low = servo.at(9.0)
    assert low.stall_torque < servo.stall_torque
    assert low.at(None) == low.at(servo.rated_voltage).at(None) == servo
    assert low.at(14.8).at(9.0) == low
    # Unscaled, so that nothing of a run at the rated voltage depends on how it was told.
    assert servo.at(servo.rated_voltage).stall_torque == servo.rated_stall_torque
    assert servo.at(servo.rated_voltage).no_load_speed == servo.rated_no_load_speed


@pytest.mark.parametrize("drive", ["servo", "ideal-servo", "prescribed"])
def test_a_walk_that_the_supplied_servos_cannot_follow_is_refused_with_their_supply(drive):
    # The walk needs 3.7 rad/s.
    scenario = walking(drive=drive, voltage=5.0, period=1.0)
    with pytest.raises(phasmid.InfeasibleWalk, match=r"allows 2\.47 rad/s at 5 V"):
        phasmid.plan(scenario)
    walk = phasmid.plan(scenario.replace(voltage=None))
    with pytest.raises(phasmid.InfeasibleWalk, match=r"allows 2\.47 rad/s at 5 V"):
        phasmid.simulate(scenario, walk)


def test_a_walk_is_simulated_with_the_servos_and_the_payload_of_the_scenario():
    scenario = walking(drive="servo")
    walk = phasmid.plan(scenario)
    loaded = scenario.replace(voltage=9.0, payload=0.3)
    given, own = (phasmid.simulate(loaded, each) for each in (walk, phasmid.plan(loaded)))
    assert np.array_equal(given.joint_torque, own.joint_torque)
    assert np.array_equal(given.servo_current, own.servo_current)


@pytest.mark.usefixtures("compiled_engine")
def test_all_weights_are_those_of_the_scenarios_gravity():
    scenario = walking(gravity=MARS)
    robot = scenario.load_robot()
    weight = robot.mass * MARS
    walk = phasmid.plan(scenario)
    # Feet carry the weight and what accelerates the trunk up and down: on level ground nothing.
    model = phasmid.analyse(scenario, walk).foot_normal_force_model.sum("leg")
    assert model.mean() == pytest.approx(weight, rel=0.01)
    run = phasmid.simulate(scenario, walk).foot_normal_force.sum("leg")
    assert run.mean() == pytest.approx(weight, rel=0.02)
    earth = scenario.replace(gravity=9.81)
    # Statics is proportional to gravity, to the solver's round-off.
    assert servo_verdict(scenario).torque == pytest.approx(
        servo_verdict(earth).torque * MARS / 9.81, rel=1e-6
    )
    standing = Observation(
        time=0.0, joint_position=joint_angles(robot.arrays, robot.arrays.neutral_foot)
    )
    torques, thresholds, times, benches = [], [], [], []
    for one in (scenario, earth):
        controller = scenario_controller(one, RATE)
        assert isinstance(controller, SafetyFilter)
        engine = controller.controller.walker
        assert isinstance(engine, LocomotionEngine)
        engine.reset(standing)
        torques.append(engine.update(standing, Command()).torque)
        thresholds.append(engine.memory["estimator_parameters"]["contact_on"][0, 1])
        times.append(controller.monitor.tip_time)
        benches.append(bench(robot, Bench(leg=1), one.model.gravity))
    assert torques[0] == pytest.approx(torques[1] * MARS / 9.81, rel=1e-6, abs=1e-6)
    # A foot touches from a share of the weight; a pendulum falls in a time as 1/√g.
    assert thresholds[0] == pytest.approx(thresholds[1] * MARS / 9.81)
    assert times[0] == pytest.approx(times[1] * (9.81 / MARS) ** 0.5)
    assert benches[0]["weight"] == pytest.approx(weight)
    here, there = (np.array(each["torque"]["gravity"]) for each in benches)
    assert here == pytest.approx(there * MARS / 9.81)


def test_an_engine_of_another_world_is_refused():
    scenario = walking(drive="servo", gravity=MARS)
    with pytest.raises(phasmid.InvalidInput, match=r"the engine has a gravity of 9\.81 m/s²"):
        phasmid.drive(scenario, LocomotionEngine(scenario.load_robot()), Command())
    low = walking(drive="servo", voltage=9.0)
    with pytest.raises(phasmid.InvalidInput, match=r"the scenario, at 9 V, give 1\.11 N·m"):
        phasmid.drive(low, LocomotionEngine(walking().load_robot()), Command())


@pytest.mark.parametrize("voltage", [0.0, -3.0, float("nan"), float("inf")])
def test_a_supply_that_cannot_be_is_refused(voltage):
    with pytest.raises(phasmid.InvalidRobot, match="servo AX-12A: supply is"):
        load_servo("AX-12A").at(voltage)
