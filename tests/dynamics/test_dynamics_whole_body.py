"""Inverse dynamics of the whole robot."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from phasmid import dynamics, kinematics
from phasmid.errors import InvalidInput
from phasmid.robot import Robot

# Forces here reach 200 N, sums of some thousand terms in which round-off adds at random: about
# 30 * 2.2e-16 * 200 = 1e-12. The bound leaves room for other machines' arithmetic; a wrong term
# shows at 1e-4.
WHOLE = 1e-8


def _random_motion(rng: np.random.Generator, *lead: int) -> tuple[np.ndarray, dynamics.BodyMotion]:
    quaternion = rng.normal(size=(*lead, 4))
    quaternion /= np.linalg.norm(quaternion, axis=-1, keepdims=True)
    p, v, w, a, dw = rng.normal(size=(5, *lead, 3)) * np.reshape([1, 1, 3, 5, 20], (5, 1, 1))
    R = kinematics.quaternion_rotation(quaternion)
    return quaternion, dynamics.BodyMotion(p, R, v, w, a, dw)


def _random_joints(rng: np.random.Generator, robot: Robot, *lead: int) -> list[np.ndarray]:
    shape = (*lead, len(robot.legs), 3)
    q = rng.uniform(-np.pi, np.pi, size=shape)
    return [q, 5 * rng.normal(size=shape), 20 * rng.normal(size=shape), 10 * rng.normal(size=shape)]


def test_a_robot_in_free_fall_with_locked_joints_feels_nothing(
    robot: Robot, rng: np.random.Generator
) -> None:
    # a = (0, 0, -g), nothing turns: every link falls by itself. -9.81 + 9.81 is exactly 0.
    _, pose = _random_motion(rng, 10)
    q, *_ = _random_joints(rng, robot, 10)
    still, zero = np.zeros_like(q), np.zeros(3)
    fall = dynamics.BodyMotion(
        pose.position, pose.rotation, pose.velocity, zero, np.array([0.0, 0.0, -9.81]), zero
    )
    result = dynamics.inverse_dynamics(robot, fall, q, still, still)
    np.testing.assert_array_equal(result.joint_torque, 0.0)
    np.testing.assert_array_equal(result.wrench, 0.0)


def test_without_feet_on_the_ground_the_wrench_at_rest_carries_the_weight(
    robot: Robot, rng: np.random.Generator
) -> None:
    # f = (0, 0, m g), n = r × f with r from the body's origin to the centre of mass. Weights
    # reach 50 N in sums of twenty links: 20 * 2.2e-16 * 50 = 2e-13; WHOLE is the house's bound.
    _, pose = _random_motion(rng, 10)
    body = dynamics.BodyMotion.at_rest(pose.position, pose.rotation)
    q, *_ = _random_joints(rng, robot, 10)
    still = np.zeros_like(q)
    wrench = dynamics.inverse_dynamics(robot, body, q, still, still).wrench
    weight = np.array([0.0, 0.0, robot.mass * 9.81])
    arm = (pose.rotation @ kinematics.centre_of_mass(robot, q)[..., None])[..., 0]
    expected = np.concatenate([np.broadcast_to(weight, arm.shape), np.cross(arm, weight)], axis=-1)
    np.testing.assert_allclose(wrench, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("lead", [(), (4,), (2, 3)])
def test_one_trunk_serves_any_number_of_joint_states(robot: Robot, lead: tuple[int, ...]) -> None:
    # The same arithmetic whatever the leading axes; forces of 1e2 N within some units in the
    # last place, 1e-14 each.
    rng = np.random.default_rng(5)
    _, motions = _random_motion(rng, 1)
    body = dynamics.BodyMotion(
        *(getattr(motions, name)[0] for name in dynamics.BodyMotion.__dataclass_fields__)
    )
    q, qd, qdd, force = _random_joints(rng, robot, *lead)
    result = dynamics.inverse_dynamics(robot, body, q, qd, qdd, foot_force=force)
    energy = dynamics.kinetic_energy(robot, body, q, qd)
    height = dynamics.potential_energy(robot, body, q)
    assert result.joint_torque.shape == q.shape
    assert result.wrench.shape == (*lead, 6)
    assert energy.shape == height.shape == lead
    for i in np.ndindex(*lead):
        one = dynamics.inverse_dynamics(robot, body, q[i], qd[i], qdd[i], foot_force=force[i])
        np.testing.assert_allclose(result.joint_torque[i], one.joint_torque, rtol=0, atol=1e-12)
        np.testing.assert_allclose(result.wrench[i], one.wrench, rtol=0, atol=1e-12)


def test_angles_of_the_wrong_number_of_legs_are_refused(robot: Robot) -> None:
    count = len(robot.legs)
    q = np.zeros((count - 1, 3))
    with pytest.raises(InvalidInput, match=rf"q has shape \({count - 1}, 3\); it must end in"):
        dynamics.inverse_dynamics(robot, dynamics.BodyMotion.at_rest(), q, q, q)


def test_gravity_as_a_vector_is_refused(robot: Robot) -> None:
    q = np.zeros((len(robot.legs), 3))
    down: Any = np.array([0.0, 0.0, -9.81])
    for call in (
        lambda: dynamics.inverse_dynamics(
            robot, dynamics.BodyMotion.at_rest(), q, q, q, gravity=down
        ),
        lambda: dynamics.leg_torque(robot.arrays, q, q, q, gravity=down),
    ):
        with pytest.raises(InvalidInput, match=r"gravity has shape \(3,\); it must be one number"):
            call()
