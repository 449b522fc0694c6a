"""Every joint of a robot is judged by its own torque, speed, armature and friction."""

from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np
import pytest

import phasmid
from phasmid.advice import Holding, servo_verdict
from phasmid.control import LocomotionEngine
from phasmid.control.safety_filter import SafetyFilter
from phasmid.errors import InfeasibleWalk, InvalidInput
from phasmid.formats import load_robot, save_robot
from phasmid.formats.judge import judge_robot
from phasmid.reporting import read_run
from phasmid.reporting.path_figures import beyond, servo_limits
from phasmid.robot import JOINTS
from phasmid.simulation import build_model
from phasmid.studio.bench import bench
from phasmid.studio.messages import Bench

GRAVITY = 9.81

ARRAYS = {
    "effort": "stall_torque",
    "velocity": "no_load_speed",
    "armature": "armature",
    "friction": "friction",
}
"""Numbers of a URDF's joints, and the arrays of a robot that have them."""

NUMBERS = {
    "coxa": {"effort": 3.0, "velocity": 6.0, "armature": 0.004, "friction": 0.0},
    "femur": {"effort": 4.0, "velocity": 5.0, "armature": 0.006, "friction": 0.05},
    "tibia": {"effort": 6.0, "velocity": 4.0, "armature": 0.012, "friction": 0.08},
}


def table(number, numbers=NUMBERS):
    """One number of all joints, shape (6, 3)."""
    return np.tile([numbers[joint][number] for joint in JOINTS], (6, 1))


@pytest.fixture(scope="module")
def robot_with(tmp_path_factory):
    """Read a robot from a URDF with numbers of its own for each kind of joint."""
    folder = tmp_path_factory.mktemp("robots")
    bare = replace(phasmid.load_robot("phantomx-mk4"), appearance=None)
    save_robot(bare, folder / "bare.urdf")

    def read(numbers=NUMBERS):
        file = ET.parse(folder / "bare.urdf")
        for joint in file.iter("joint"):
            kind = joint.get("name").rpartition("_")[2]
            for number, value in numbers.get(kind, {}).items():
                for element in joint:
                    if number in element.attrib:
                        element.set(number, repr(value))
        file.write(folder / "own.urdf")
        return load_robot(folder / "own.urdf")

    return read


def simulated(scenario):
    return phasmid.simulate(scenario, phasmid.plan(scenario))


def walking(robot, **changes):
    changes = {"duration": 0.3, "drive": "ideal-servo"} | changes
    return phasmid.Scenario(robot=robot).replace(**changes)


@pytest.mark.parametrize("suffix", [".urdf", ".xml", ".toml"])
def test_a_file_s_joints_keep_their_own_numbers(robot_with, suffix, tmp_path):
    robot = robot_with()
    save_robot(robot, tmp_path / f"again{suffix}")
    for one in (robot, load_robot(tmp_path / f"again{suffix}")):
        for number, name in ARRAYS.items():
            # A division by the servo's number and a product with it.
            np.testing.assert_allclose(getattr(one.arrays, name), table(number), rtol=1e-15)


def test_a_strong_knee_is_judged_by_its_own_torque(robot_with):
    # Hips have half the torque of the knees, and need less than that. The floor gives no help.
    def judged(robot):
        return servo_verdict(walking(robot, gait="tripod", friction=0.0))

    needed = judged(robot_with())
    kind = needed.joint.rpartition(".")[2]
    weak, strong = needed.torque / 1.17, needed.torque / 0.58
    for efforts, share, holding in (
        (dict.fromkeys(JOINTS, weak), 1.17, Holding.DOES_NOT_HOLD),
        (dict.fromkeys(JOINTS, weak) | {kind: strong}, 0.58, Holding.LIMITED),
    ):
        numbers = {joint: NUMBERS[joint] | {"effort": efforts[joint]} for joint in JOINTS}
        verdict = judged(robot_with(numbers))
        assert (verdict.joint, verdict.holding) == (needed.joint, holding)
        assert verdict.torque / verdict.stall_torque == pytest.approx(share, rel=1e-12)


def test_the_joint_that_is_refused_is_the_one_beyond_its_own_speed(robot_with):
    # Samples of a cycle miss less than 5 % of a peak.
    fastest = np.abs(phasmid.plan(walking(robot_with(), duration=2.0)).qd).max(axis=(0, 1))
    slow, quick = int(np.argmin(fastest)), float(fastest.max())

    def scenario(share):
        speeds = {joint: {"velocity": 1.5 * quick} for joint in JOINTS}
        speeds[JOINTS[slow]] = {"velocity": share * float(fastest[slow])}
        return walking(robot_with(speeds)), table("velocity", speeds)

    (enough, limits), (less, _) = scenario(1.05), scenario(0.95)
    walk = phasmid.plan(enough)
    speed = phasmid.summarise(phasmid.simulate(enough, walk))["speed"]
    assert speed["largest_over_no_load"] == pytest.approx((speed["peak"] / limits).max(), rel=1e-12)
    words = rf"\.{JOINTS[slow]} would turn .* allows {0.95 * fastest[slow]:.3g} rad/s"
    with pytest.raises(InfeasibleWalk, match=words):
        phasmid.plan(less)


def test_the_simulation_gives_each_joint_its_own_rotor_friction_and_torque(robot_with):
    robot = robot_with()
    for drive in ("ideal-servo", "torque"):
        model = build_model(walking(robot, drive=drive))
        for name, number in (("dof_armature", "armature"), ("dof_frictionloss", "friction")):
            np.testing.assert_allclose(
                getattr(model, name)[6:].reshape(6, 3), table(number), rtol=1e-15
            )
        most = model.actuator_forcerange[:, 1].reshape(6, 3)
        np.testing.assert_allclose(most, table("effort"), rtol=1e-15)
        run = simulated(walking(robot, drive=drive))
        friction = np.abs(run["servo_friction_torque"].values).max(axis=0)
        # Coxae have no friction, and so no row of the engine; others slide at their own.
        assert (friction[:, 0] == 0).all()
        np.testing.assert_allclose(friction[:, 1:], table("friction")[:, 1:], rtol=1e-3)
        motor = np.abs(run["servo_motor_torque"].values).max(axis=0)
        assert (motor <= table("effort") - table("friction") + 1e-12).all()


def test_a_servo_s_own_law_needs_joints_that_are_alike(robot_with):
    alike = robot_with({})
    servo = phasmid.load_robot("phantomx-mk4").servo
    assert walking(replace(alike, servo=servo), drive=None).driven().simulation.drive == "servo"
    for number in ARRAYS:
        numbers = {"tibia": {number: 2.5 * float(getattr(alike.arrays, ARRAYS[number])[0, 2])}}
        differs = replace(robot_with(numbers), servo=servo)
        assert walking(differs, drive=None).driven().simulation.drive == "ideal-servo"
        with pytest.raises(InvalidInput, match='drive "servo" has one law for all of them'):
            simulated(walking(differs, drive="servo"))


@pytest.mark.usefixtures("compiled_engine")
def test_the_controller_keeps_each_joint_within_its_own_limits(robot_with):
    robot = robot_with()
    engine = LocomotionEngine(robot)
    stage, used = engine.feed_forward.parameters, engine.settings.feed_forward.torque_used
    for value, number in (
        (engine.model.joint_speed / 0.95, "velocity"),
        (SafetyFilter(engine, robot).speed / 1.02, "velocity"),
        (stage.stall_torque / used, "effort"),
        (stage.stall_torque / stage.torque_drop, "velocity"),
        (stage.armature, "armature"),
    ):
        np.testing.assert_allclose(value, table(number), rtol=1e-14)


def test_the_report_takes_each_joint_s_own_limits(robot_with):
    """Without load a joint reaches its own no-load speed, at rest its own stall torque."""
    robot = robot_with()
    run = read_run(simulated(walking(robot)))
    fastest, stall = table("velocity"), table("effort")
    lowest, highest = servo_limits(run)[0](fastest)
    np.testing.assert_allclose(highest, 0.0, atol=1e-12)
    np.testing.assert_allclose(lowest, -stall, rtol=1e-12)
    for joint in range(3):
        at_rest = servo_limits(run, joint)[0](np.zeros((1, 1)))[1]
        np.testing.assert_allclose(at_rest, stall[None, :, joint], rtol=1e-12)
    shares = run.joint_continuous_torque / run.continuous_torque
    np.testing.assert_allclose(shares, stall / stall.min(), rtol=1e-12)
    assert not beyond(run, 0.99 * stall[None], np.zeros((1, 6, 3))).any()


def test_the_leg_bench_takes_each_joint_s_own_torque(robot_with):
    told = bench(robot_with(), Bench(leg=1, force=(0.0, 0.0, 20.0)), GRAVITY)
    torques = np.abs(told["torque"]["sum"])
    np.testing.assert_allclose(told["share"], torques / table("effort")[0], rtol=1e-12)


def test_one_placeholder_among_the_joints_is_found(robot_with):
    numbers = NUMBERS | {"tibia": NUMBERS["tibia"] | {"velocity": 1000.0}}
    (found,) = (f for f in judge_robot(robot_with(numbers)) if "rad/s" in f.what)
    assert "speed is 1000 rad/s" in found.what
