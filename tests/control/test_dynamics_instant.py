"""Torques and foot forces of one instant are those of the batch functions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from phasmid import dynamics, kinematics
from phasmid.control import EngineSettings
from phasmid.control.feed_forward import feed_forward
from phasmid.control.feed_forward.feed_forward import FeedForward
from phasmid.control.feed_forward.settings import FeedForwardSettings
from phasmid.control.feed_forward.state import Motion, State
from phasmid.control.memory import MEMORY
from phasmid.control.records import fill
from phasmid.errors import InvalidInput
from phasmid.forces import Contacts, FrictionCone, JointLoad, MinimumNorm, share_load
from phasmid.robot import Robot, load_robot
from phasmid.units import STANDARD_GRAVITY
from support.general_robot import general_robot

ROBOTS = ["phantomx-ax", "quadruped", "octopod", "general"]


def robot_called(name: str) -> Robot:
    return general_robot() if name == "general" else load_robot(name)


class Instant(FeedForward):
    """Feed-forward of single motions, whatever the gait of an engine."""

    def __init__(self, robot: Robot, settings=None, armature: float | None = None) -> None:
        self.memory = np.zeros(1, MEMORY)
        super().__init__(robot, settings, gravity=STANDARD_GRAVITY, memory=self.memory)
        if armature is not None:
            self.parameters.armature = armature

    def solve(self, motion: Motion, load_share: np.ndarray, normals: np.ndarray) -> State:
        """Return the state with forces and torques of a motion."""
        fill(self.state.motion, motion)
        self.state.load_share[:], self.state.normals[:] = load_share, normals
        memory = self.memory[0]
        feed_forward.solve(memory["feed_forward"], memory["feed_forward_parameters"])
        self.apply_limits()
        return self.state


def states(robot: Robot, count: int):
    """Random states near the neutral stance, in order of `Instant.solve`."""
    rng, spread = np.random.default_rng(7), 0.3
    legs = len(robot.legs)
    for _ in range(count):
        quaternion = np.array([1.0, 0, 0, 0]) + spread * rng.normal(size=4)
        R = kinematics.quaternion_rotation(quaternion / np.linalg.norm(quaternion))
        w, dw, a = rng.normal(size=(3, 3)) * np.array([[1.0], [5.0], [2.0]])
        neutral = kinematics.joint_angles(
            robot.arrays, np.array([leg.neutral_foot for leg in robot.legs])
        )
        q = neutral + spread * rng.normal(size=(legs, 3))
        qd, qdd = 2 * rng.normal(size=(legs, 3)), 10 * rng.normal(size=(legs, 3))
        share = np.where(rng.permutation(legs) < max(4, legs - 2), rng.uniform(0.2, 1, legs), 0.0)
        normals = np.array([0, 0, 1.0]) + 0.2 * rng.normal(size=(legs, 3))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        yield R, w, dw, a, q, qd, qdd, share, normals


def batch_answer(robot, state, model, *, armature=0.0, friction=100.0):
    """Torques and forces by `phasmid.dynamics` and `phasmid.forces`."""
    R, w, dw, a, q, qd, qdd, share, normals = state
    body = dynamics.BodyMotion(np.zeros(3), R, np.zeros(3), w, a, dw)
    torque, wrench = dynamics.inverse_dynamics(robot, body, q, qd, qdd, gravity=STANDARD_GRAVITY)
    J = R @ robot.arrays.R_body_hip @ kinematics.jacobian(robot.arrays, q)
    joints = JointLoad(J, torque + armature * qdd)
    feet = kinematics.body_from_hip(robot, kinematics.foot_position(robot.arrays, q)) @ R.T
    contacts = Contacts(feet, share, normals, friction)
    force = share_load(contacts, wrench, model, joints=joints)
    return joints.with_ground(force), force, wrench, feet


@pytest.mark.parametrize("name", ROBOTS)
def test_an_instant_has_the_torques_and_forces_of_the_batch(name: str) -> None:
    # Both solve the same equations; forces reach 1e3 N where legs are nearly stretched, so that
    # round-off of 2e-16 times a condition number of up to 1e3 stays below 1e-9 of the largest.
    robot = robot_called(name)
    settings = FeedForwardSettings(friction=10.0, friction_used=1.0)
    # Servos without limits, and feet that may pull: what is made least is all that counts.
    servo = replace(robot.servo, rated_stall_torque=1e6, rated_no_load_speed=1e6)
    feed = Instant(replace(robot, servo=servo), settings, armature=0.01)
    feed.parameters.friction = np.inf
    for state in states(robot, 40):
        torque, force, _, _ = batch_answer(robot, state, "minimum-norm", armature=0.01)
        effort = feed.solve(Motion(*state[:7]), *state[7:])
        scale = max(1.0, np.abs(force).max())
        np.testing.assert_allclose(effort.foot_force, force, rtol=0, atol=1e-9 * scale)
        np.testing.assert_allclose(effort.joint_torque, torque, rtol=0, atol=1e-9 * scale)


def standing(robot: Robot, **motion):
    """The robot at its neutral stance, in order of `Instant.solve`, with some motion."""
    legs = len(robot.legs)
    feet = np.array([leg.neutral_foot for leg in robot.legs])
    q, still = kinematics.joint_angles(robot.arrays, feet), np.zeros((legs, 3))
    state = {
        "R_world_body": np.eye(3),
        "angular_velocity": np.zeros(3),
        "angular_acceleration": np.zeros(3),
        "acceleration": np.zeros(3),
        "q": q,
        "qd": still,
        "qdd": still,
        "share": np.ones(legs),
        "normals": np.tile([0.0, 0.0, 1.0], (legs, 1)),
    }
    return {name: np.array(value) for name, value in (state | motion).items()}


def solve(feed: Instant, motion):
    """The answer to a motion that `standing` made."""
    values = list(motion.values())
    return feed.solve(Motion(*values[:7]), *values[7:])


def test_beyond_friction_the_nearest_forces_within_it_are_taken() -> None:
    # The pyramid lies inside the cone of mu and around that of mu cos(pi/8): its cost lies between
    # those of the two cones, to 1e-6 of it, to which the solver is right.
    robot, mu = load_robot("phantomx-paper"), 0.25
    state = standing(robot, acceleration=[2.0, 0.8, 0.0])
    settings = FeedForwardSettings(friction=mu, friction_used=1.0)
    effort = solve(Instant(robot, settings, armature=0.0), state)
    free = solve(Instant(robot, replace(settings, friction=10.0), armature=0.0), state)
    assert free.friction > mu
    assert effort.friction <= mu * (1 + 1e-9)
    assert effort.motion_scale == 1.0
    values = list(state.values())
    _, _, wrench, feet = batch_answer(robot, values, "minimum-norm")
    given = np.concatenate(
        [effort.foot_force.sum(axis=0), np.cross(feet, effort.foot_force).sum(axis=0)]
    )
    np.testing.assert_allclose(given, wrench, rtol=0, atol=1e-7)

    least, most = (
        np.sum(batch_answer(robot, values, FrictionCone(MinimumNorm()), friction=cone)[1] ** 2)
        for cone in (mu, mu * np.cos(np.pi / 8))
    )
    assert least * (1 - 1e-6) <= np.sum(effort.foot_force**2) <= most * (1 + 1e-6)


def test_of_too_much_acceleration_as_much_is_given_as_friction_allows() -> None:
    # Level ground: sum of tangential forces = m a, of normal ones = m g, so that a part s of
    # a = 6 m/s² is possible where s a <= mu g; the pyramid takes cos(pi/8) of mu at the least.
    robot = load_robot("phantomx-paper")
    settings = FeedForwardSettings(friction=0.5, friction_used=0.6)
    feed = Instant(robot, settings)
    effort = solve(feed, standing(robot, acceleration=[6.0, 0, 0]))
    most = 0.3 * 9.81 / 6.0
    assert np.cos(np.pi / 8) * most * (1 - 1e-3) <= effort.motion_scale <= most * (1 + 1e-6)
    assert effort.friction <= 0.3 * (1 + 1e-6)
    assert feed.limit_reason == "the feet need a friction of 0.61 of 0.30."


def test_a_load_beyond_the_servos_is_told_with_its_joint() -> None:
    robot = load_robot("phantomx-paper")
    heavy = replace(robot, body=replace(robot.body, mass=20.0))
    feed = Instant(heavy)
    effort = solve(feed, standing(heavy))
    worst = int(np.argmax(np.abs(effort.joint_torque)))
    joint = f"{robot.legs[worst // 3].name}.{['coxa', 'femur', 'tibia'][worst % 3]}"
    needed = np.abs(effort.joint_torque).max()
    assert effort.motion_scale == 0.0
    assert effort.torque_utilisation == pytest.approx(needed / 1.5)
    assert feed.limit_reason == f"{joint} needs {needed:.2f} N·m of 1.50."


def test_two_feet_cannot_carry_a_robot_and_it_is_told() -> None:
    robot = load_robot("phantomx-paper")
    share = np.array([1.0, 0, 0, 0, 0, 1.0])
    feed = Instant(robot)
    effort = solve(feed, standing(robot, share=share))
    assert np.isfinite(effort.foot_force).all()
    assert np.isfinite(effort.joint_torque).all()
    assert feed.limit_reason == (
        "the standing feet cannot carry the robot: fewer than three, or on one line."
    )


def test_settings_that_cannot_be_are_refused() -> None:
    with pytest.raises(InvalidInput, match=r"friction is -1; it must be from 0 to 10\."):
        FeedForwardSettings(friction=-1.0)
    with pytest.raises(InvalidInput, match='dynamics is "yes"; it must be feed-forward or none'):
        EngineSettings(dynamics="yes")
