"""Rewards, references and randomisation against their formulas."""

import mujoco
import numpy as np
import pytest

from phasmid.kinematics import body_from_hip, foot_position
from phasmid.learning import WalkVectorEnv
from phasmid.learning.control_period import reference_leg
from phasmid.learning.task import TERMS
from phasmid.scenario import Scenario
from phasmid.simulation.model import build_model
from phasmid.simulation.servo_drive import ServoDrive
from phasmid.simulation.start import standing

WEIGHTS = dict.fromkeys(TERMS, 1.0)


def stepped(count=6, seed=0, steps=7, **changes):
    """An environment after some random actions, and the reward sums before its last step."""
    env = WalkVectorEnv(count, rewards=WEIGHTS, autoreset_mode="Disabled", **changes)
    env.reset(seed=seed)
    rng = np.random.default_rng(seed)
    for _ in range(steps):
        before = env.physics.episodes.sums.copy()
        kept = [getattr(env.physics.episodes, k).copy() for k in ("contact", "foot", "position")]
        result = env.step(rng.uniform(-0.5, 0.5, env.action_space.shape))
    return env, before, kept, result


def test_every_term_is_its_formula():
    """The same numbers by NumPy and SciPy; 1e-9 is round-off of sums of seven terms."""
    from scipy.spatial.transform import Rotation

    env, before, (old_contact, old_foot, old_position), (_, rewards, fell, _, _) = stepped()
    p, e, c = env.physics, env.physics.episodes, env.physics.constants
    q, v, dt, table = p.qpos, p.qvel, c.dt, env.task.rewards
    world_from_body = Rotation.from_quat(q[:, [4, 5, 6, 3]])
    velocity = world_from_body.inv().apply(v[:, :3])
    mean_velocity = world_from_body.inv().apply(q[:, :3] - old_position) / dt
    up = world_from_body.inv().apply([0.0, 0.0, 1.0])
    command = e.command
    error = np.sum((mean_velocity[:, :2] - command[:, :2]) ** 2, axis=1)
    moving = (command != 0).any(axis=1)
    contact = p.states.sensors[:, :24].reshape(-1, 6, 4)[:, :, 0] > 0
    foot = p.states.sensors[:, 24:].reshape(-1, 6, 3)
    slides = np.hypot(*np.moveaxis((foot - old_foot)[..., :2], -1, 0)) * contact * (old_contact > 0)
    stance = ~moving[:, None] | ((e.phase[:, None] - c.lifts) % 1.0 >= c.swing)
    wanted = {
        "velocity": np.exp(-error / table.velocity_scale**2),
        "yaw_rate": np.exp(-((v[:, 5] - command[:, 2]) ** 2) / table.yaw_scale**2),
        "reference": np.exp(
            -np.mean((q[:, 7:] - e.reference) ** 2, axis=1) / table.reference_scale**2
        ),
        "clock": np.mean(stance == contact, axis=1),
        "vertical_velocity": velocity[:, 2] ** 2,
        "tilt_rate": np.sum(v[:, 3:5] ** 2, axis=1),
        "tilt": up[:, 0] ** 2 + up[:, 1] ** 2,
        "height": (q[:, 2] - c.height) ** 2,
        "torque": np.mean((e.torque / c.stall) ** 2, axis=1),
        "power": e.work / dt,
        "action_rate": np.mean((e.action - e.previous_action) ** 2, axis=1),
        "slip": slides.sum(axis=1) / dt,
        "symmetry": np.mean((e.duty - e.duty[:, c.mirror]) ** 2, axis=1),
        "standing": np.where(moving, 0.0, np.mean(v[:, 6:] ** 2, axis=1)),
        "fall": fell / dt,
    }
    assert tuple(wanted) == TERMS
    got = dict(zip(TERMS, (e.sums - before).T / dt, strict=True))
    for name in TERMS:
        np.testing.assert_allclose(got[name], wanted[name], atol=1e-9, rtol=1e-9, err_msg=name)
    np.testing.assert_allclose(rewards, dt * sum(wanted.values()), atol=1e-9)


def test_a_fallen_robot_ends_its_episode_and_pays_once():
    env = WalkVectorEnv(2, rewards={"fall": -10.0}, autoreset_mode="Disabled")
    env.reset(seed=0)
    env.physics.qpos[1, 3:7] = [0.0, 1.0, 0.0, 0.0]
    _, _, fell, over, information = env.step(np.zeros((2, 18)))
    assert fell.tolist() == [False, True]
    assert not over.any()
    assert information["reward_sums"]["fall"].tolist() == [0.0, -10.0]


def test_a_robot_whose_state_is_not_finite_ends_its_episode(here, capfd):
    env = WalkVectorEnv(2)
    env.reset(seed=0)
    env.physics.qpos[0, 9] = np.nan
    observations, rewards, fell, _, _ = env.step(np.zeros((2, 18)))
    assert fell.tolist() == [True, False]
    assert np.isfinite(observations).all()
    assert np.isfinite(rewards).all()
    observations, _, fell, _, _ = env.step(np.zeros((2, 18)))
    assert not fell.any()
    assert np.isfinite(env.physics.qpos).all()
    # MuJoCo would print a warning, and write it to a file.
    assert capfd.readouterr() == ("", "")
    assert not list(here.iterdir())


@pytest.mark.parametrize("command", [(0.1, 0.0, 0.0), (0.0, -0.08, 0.0), (0.05, 0.05, 0.4)])
def test_feet_of_the_reference_move_as_the_ground_while_they_stand(command):
    """In body axes a point of the ground at p has the velocity -v - w × p, at the neutral foot."""
    p = WalkVectorEnv(1).physics
    c, robot, h = p.constants, p.robot, 1e-5
    command = np.array(command)

    def feet(phase):
        q = np.array([reference_leg(c, command, phase % 1.0, leg) for leg in range(6)])
        return body_from_hip(robot, foot_position(robot.arrays, q))

    for leg in range(6):
        middle = (c.lifts[leg] + c.swing + (1 - c.swing) / 2) % 1.0
        np.testing.assert_allclose(feet(middle)[leg], c.feet[leg], atol=1e-12)
        speed = (feet(middle + h) - feet(middle - h))[leg] / (2 * h * c.task.gait.period)
        x, y, _ = c.feet[leg]
        ground = [-command[0] + command[2] * y, -command[1] - command[2] * x, 0.0]
        np.testing.assert_allclose(speed, ground, atol=1e-8)
        top = feet(c.lifts[leg] + c.swing / 2)[leg]
        np.testing.assert_allclose(top, c.feet[leg] + [0, 0, c.task.gait.step_height], atol=1e-12)


def test_randomised_masses_are_consistent():
    """Total mass is the robot's times its factor, and the payload; MuJoCo sums up the subtree."""
    ranges = {"mass": 0.2, "payload": 0.5, "centre_of_mass": 0.01, "friction": (0.3, 1.5)}
    env = WalkVectorEnv(50, randomisation=ranges)
    env.reset(seed=0)
    p, e = env.physics, env.physics.episodes
    trunk = p.model.body("trunk").id
    models = [p.batch.get_model(n) for n in range(3)]
    for n, model in enumerate(models):
        total = e.mass[n] * p.robot.mass + e.payload[n]
        np.testing.assert_allclose(model.body_subtreemass[trunk], total, atol=2e-6)
        shift = model.body_ipos[trunk] - p.model.body_ipos[trunk]
        np.testing.assert_allclose(shift, e.centre_of_mass[n], atol=1e-15)
        feet = model.geom_friction[model.geom_priority > 0, 0]
        np.testing.assert_allclose(feet, e.friction[n])
        # A principal moment of a body is at most the sum of the other two.
        inertia = np.sort(model.body_inertia[1:], axis=1)
        assert (inertia[:, 2] <= inertia[:, 0] + inertia[:, 1] + 1e-15).all()
    for values, low, high in (
        (e.mass, 0.8, 1.2),
        (e.payload, 0.0, 0.5),
        (e.centre_of_mass, -0.01, 0.01),
        (e.friction, 0.3, 1.5),
    ):
        assert low <= values.min() < low + 0.15 * (high - low)
        assert high - 0.15 * (high - low) < values.max() <= high


def test_full_fidelity_is_the_simulation_of_driven_robots():
    """A robot of a batch, and `ServoDrive` on one MuJoCo state with the same targets, bit for bit.

    The model is that of `build_model` with one body more: the payload, of a millionth of a
    kilogram here, which changes the contact by less than a millionth.
    """
    env = WalkVectorEnv(1, fidelity="full", autoreset_mode="Disabled")
    env.reset(seed=0)
    p = env.physics
    scenario = Scenario().replace(robot=env.task.robot, drive="servo", dt=0.001)
    model = p.batch.get_model(0)
    plain = build_model(scenario)
    for name in ("geom_pos", "geom_solref", "geom_solimp", "geom_friction", "jnt_pos"):
        np.testing.assert_allclose(getattr(model, name), getattr(plain, name), rtol=1e-6)
    payload = model.body("payload").id
    np.testing.assert_array_equal(np.delete(model.body_mass, payload), plain.body_mass)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = p.qpos[0], p.qvel[0]
    mujoco.mj_forward(model, data)
    drive = ServoDrive(model, data, standing(scenario.build()))
    for step in range(20):
        env.step(0.3 * np.sin(0.4 * step + np.arange(18))[None])
        for _ in range(20):
            drive.command(p.episodes.target[0])
            mujoco.mj_step(model, data)
    np.testing.assert_array_equal(data.qpos, p.qpos[0])
    np.testing.assert_array_equal(drive.servos["torque"], p.episodes.torque[0])


def test_a_fast_motor_holds_and_stalls_as_its_servo():
    """At standstill the torque is the gain times the error, at most the stall torque.

    The servo's own law gives the same slope: full output over its compliance slope.
    """
    p = WalkVectorEnv(1).physics
    motor, servo = p.motor, p.robot.servo
    assert motor.gain == pytest.approx(motor.stall / (32 * servo.resolution))
    # Without friction the motor turns freely at the servo's no-load speed, or a little faster.
    free = motor.stall / motor.damping
    assert 1.0 < free / servo.no_load_speed < 1.1
    # Friction that grows with the load brings the output down to the stall torque.
    out = motor.stall - motor.friction - motor.load_loss * motor.stall
    assert out == pytest.approx(servo.stall_torque, rel=0.02)
