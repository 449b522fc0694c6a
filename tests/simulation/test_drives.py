"""Torques of motors, friction and joints, by drive."""

import mujoco
import numpy as np
import pytest

from phasmid.dynamics import inverse_dynamics
from phasmid.motion import plan
from phasmid.reporting import summarise
from phasmid.scenario import load_scenario
from phasmid.simulation import Run, simulate
from physics.bench import joint_state, trunk_motion

DRIVES = "prescribed", "torque", "ideal-servo", "servo"

WALK = load_scenario("paper").replace(robot="phantomx-ax")


@pytest.fixture(scope="module")
def runs():
    """The level walk with each drive, at every time step."""
    scenarios = {drive: WALK.replace(drive=drive) for drive in DRIVES}
    return {drive: simulate(each, plan(each)) for drive, each in scenarios.items()}


@pytest.mark.parametrize("drive", ["torque", "ideal-servo"])
def test_the_joint_torque_of_a_swinging_leg_is_what_its_links_need(drive):
    # The links of a leg without contact take the torques of inverse dynamics, which knows no servo.
    # Sums of some hundred terms below 10 N·m, rounded by 1e-15 each, at the engine's acceleration;
    # friction is 0.03 N·m.
    scenario = WALK.replace(drive=drive, duration=0.6)
    run = Run(scenario, plan(scenario))
    run.advance()
    data = run.data
    run.model.opt.tolerance = 1e-24
    mujoco.mj_forward(run.model, data)
    state = trunk_motion(data), *joint_state(data)
    needed = inverse_dynamics(run.robot, *state, gravity=WALK.model.gravity).joint_torque
    swings = data.sensordata[: 4 * len(needed) : 4] == 0
    assert swings.sum() == 3
    torque = run.drive.torque().reshape(-1, 3)
    assert np.abs(torque - needed)[swings].max() < 1e-9
    rotor = run.robot.servo.armature * np.abs(data.qacc[6:]).reshape(-1, 3)[swings]
    assert rotor.max() > 1e-4
    # A sliding joint has its Coulomb friction, against its speed.
    speed, friction = data.qvel[6:], run.drive.channels(run.drive.state[None])
    slides = np.abs(speed) > 0.3
    assert slides.sum() >= 3
    assert friction["servo_friction_torque"].ravel()[slides] == pytest.approx(
        -run.robot.servo.friction * np.sign(speed[slides]), rel=1e-9
    )


def test_friction_of_a_turning_rotor_is_that_of_its_motor_and_gears(runs):
    # Where the rotor turns on in its direction, friction is -(b w + s F): F is the dry friction
    # under the motor's and the gears' torque. The balance J w' = k i + friction - torque holds by
    # construction; that it has the right friction shows here, within the rounding of J w'/dt.
    scenario, run = WALK.replace(drive="servo"), runs["servo"]
    servo = scenario.load_robot().servo
    law, speed = servo.motor.friction, run.servo_speed.values
    before, after = speed[:-1], speed[1:]
    motor = run.servo_motor_torque.values[1:]
    torque, friction = run.joint_torque.values[1:], run.servo_friction_torque.values[1:]
    dry = law.limit(motor, -torque, before) - law.viscous * np.abs(before)
    expected = -np.sign(after) * dry - law.viscous * before
    turns = (before * after > 0) & (np.abs(torque) < servo.stall_torque)
    assert turns.mean() > 0.3
    assert np.abs(friction - expected)[turns].max() < 1e-12
    assert motor == pytest.approx(servo.motor.constant * run.servo_current.values[1:], rel=1e-12)


@pytest.mark.parametrize(
    ("drive", "tolerance"), [("torque", 1e-2), ("ideal-servo", 1e-2), ("servo", 1e-12)]
)
def test_motors_work_becomes_joint_work_friction_and_the_energy_of_rotors(runs, drive, tolerance):
    # At the mean speed of a step the balance J w' = motor + friction - joint gives the change of
    # ½ J w², to the rounding. MuJoCo's step is implicit in the servos' damping, so that the speed
    # changes by less than the recorded acceleration at impacts; over the walk that makes less than
    # 1 % of the motors' positive work.
    run = runs[drive]
    is_servo = drive == "servo"
    servo = WALK.load_robot().servo
    speed = run["servo_speed" if is_servo else "joint_velocity"].values
    mean = (speed[1:] + speed[:-1]) / 2
    # A recorded servo's speed is that after the step.
    names = "servo_motor_torque", "servo_friction_torque", "joint_torque"
    rows = slice(1, None) if is_servo else slice(None, -1)
    motor, friction, joint = (run[name].values[rows] for name in names)
    dt = float(run.attrs["time_step"])
    change = servo.armature / 2 * float(np.sum(speed[-1] ** 2 - speed[0] ** 2))
    gained = dt * float(np.sum((motor + friction - joint) * mean))
    given = dt * float(np.maximum(motor * mean, 0.0).sum())
    assert given > 1.0
    assert gained == pytest.approx(change, abs=tolerance * given)
    assert np.sum(friction * mean) < 0


def test_drives_do_the_same_joint_work_on_a_level_walk(runs):
    # One definition of work: on the paper's walk, planned joints need it whatever drives them.
    # Stiff drives agree within 5 %. The servos' own law is compliant: feet press against each
    # other and relieve the femurs, 20 %. Friction takes another 70 % and more of it.
    energy = {}
    for drive, run in runs.items():
        summary = summarise(run)
        energy[drive] = {
            name: value / summary["travel"]["distance"]
            for name, value in summary["energy"].items()
            if name != "channel"
        }
    work = {drive: each["work"] for drive, each in energy.items()}
    assert work["torque"] == pytest.approx(work["prescribed"], rel=0.05)
    assert work["ideal-servo"] == pytest.approx(work["prescribed"], rel=0.05)
    assert work["servo"] == pytest.approx(work["prescribed"], rel=0.2)
    assert "friction_work" not in energy["prescribed"]
    for drive in ("torque", "ideal-servo", "servo"):
        assert energy[drive]["friction_work"] > 0.5 * work[drive]
    # The supply gives what the joints and friction take, and heat; braking returns nothing.
    assert energy["servo"]["electrical_energy"] > work["servo"] + energy["servo"]["friction_work"]
