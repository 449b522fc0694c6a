"""Torques and foot forces of one instant are those of the batch functions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from general_robot import general_robot
from phasmid import dynamics, forces, kinematics
from phasmid.control.dynamics import EffortSettings, FeedForward, load_shares
from phasmid.errors import InvalidInput
from phasmid.forces import Contacts, JointLoad, share_load
from phasmid.robot import Robot, load_robot, preset_names

ROBOTS = [*preset_names(), "general"]


def robot_called(name: str) -> Robot:
    return general_robot() if name == "general" else load_robot(name)


def states(robot: Robot, count: int, *, spread: float = 0.3):
    """Random states near the neutral stance, in order of `FeedForward.update`."""
    rng = np.random.default_rng(7)
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


def batch_answer(robot, state, model, *, rotor=0.0):
    """Torques and forces by `phasmid.dynamics` and `phasmid.forces`."""
    R, w, dw, a, q, qd, qdd, share, normals = state
    body = dynamics.BodyMotion(np.zeros(3), R, np.zeros(3), w, a, dw)
    torque, wrench = dynamics.inverse_dynamics(robot, body, q, qd, qdd)
    J = R @ robot.arrays.R_body_hip @ kinematics.jacobian(robot.arrays, q)
    joints = JointLoad(J, torque + rotor * qdd)
    feet = kinematics.body_from_hip(robot, kinematics.foot_position(robot.arrays, q)) @ R.T
    contacts = Contacts(feet, share, normals, 100.0)
    force = share_load(contacts, wrench, model, joints=joints)
    return joints.with_ground(force), force, wrench, feet


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("model", ["minimum-norm", "weighted-minimum-norm", "minimum-torque"])
def test_an_instant_has_the_torques_and_forces_of_the_batch(name: str, model: str) -> None:
    # Both solve the same equations; forces reach 1e3 N where legs are nearly stretched, so that
    # round-off of 2e-16 times a condition number of up to 1e3 stays below 1e-9 of the largest.
    robot = robot_called(name)
    settings = EffortSettings(force_model=model, friction=10.0, friction_used=1.0)
    # Servos without limits, and feet that may pull: what is made least is all that counts.
    servo = replace(robot.servo, stall_torque=1e6, no_load_speed=1e6)
    feed = FeedForward(replace(robot, servo=servo), settings, rotor=0.01)
    feed.friction = np.inf
    for state in states(robot, 40):
        torque, force, _, _ = batch_answer(robot, state, model, rotor=0.01)
        effort = feed.update(*state)
        scale = max(1.0, np.abs(force).max())
        np.testing.assert_allclose(effort.force, force, rtol=0, atol=1e-9 * scale)
        np.testing.assert_allclose(effort.torque, torque, rtol=0, atol=1e-9 * scale)
