"""Frames, poses and quaternions."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from phasmid.kinematics import (
    angular_motion,
    body_from_hip,
    hip_from_body,
    neutral_feet,
    quaternion_rotation,
    quaternion_yaw,
    rotation_rpy,
    rpy_quaternion,
    step_pose,
    step_twist,
    yaw_quaternion,
)
from phasmid.robot import load_robot


def test_feet_on_the_right_are_on_the_right():
    # x forward, y left: legs 1 to 3 have negative y, legs 1 and 6 are in front.
    robot = load_robot("phantomx-paper")
    feet = neutral_feet(robot)
    assert (feet[:3, 1] < 0).all()
    assert (feet[3:, 1] > 0).all()
    assert (feet[[0, 5], 0] > 0).all()
    assert feet[1] == pytest.approx([0, -0.2534, -0.1], abs=1e-15)
    p = np.random.default_rng(0).normal(size=(7, 6, 3))
    assert np.abs(hip_from_body(robot, body_from_hip(robot, p)) - p).max() < 1e-15


def test_rotations_and_quaternions_are_those_of_scipy():
    # Roll, pitch and yaw about fixed axes, in that order. Products of three sines: 1e-15.
    angles = np.random.default_rng(5).uniform(-1.4, 1.4, size=(3, 50))
    expected = Rotation.from_euler("xyz", angles.T)
    quaternion = rpy_quaternion(*angles)
    assert np.abs(rotation_rpy(*angles) - expected.as_matrix()).max() < 1e-15
    assert np.abs(quaternion_rotation(quaternion) - expected.as_matrix()).max() < 1e-15
    assert np.abs(quaternion[:, [1, 2, 3, 0]] - expected.as_quat(canonical=True)).max() < 1e-15
    yaw = 2 * angles[2]
    assert np.abs(quaternion_yaw(yaw_quaternion(yaw)) - yaw).max() < 1e-15


@pytest.mark.parametrize("turn", [0.0, 1e-12, 1e-6, 0.5, -2.0])
def test_equal_steps_compose_to_one_arc(turn):
    # Pose after s + t steps = pose after s, then t more in its frame.
    step = np.array([0.04, 0.02, turn])
    assert step_pose(step, np.array(1.0)) == pytest.approx(step, abs=1e-15)
    (x, y, heading), second, both = step_pose(step, np.array([1.7, 2.6, 4.3]))
    R = Rotation.from_euler("z", heading).as_matrix()
    expected = [x, y, heading] + R @ second
    assert both == pytest.approx(expected, abs=1e-15)
    # The twist is the pose's derivative at the start; the difference errs by h |turn|^2 |step|.
    slope = step_pose(step, np.array(1e-7)) / 1e-7
    assert step_twist(step) == pytest.approx(slope, abs=1e-7)


def test_angular_motion_is_the_derivative_of_the_rotation():
    # dR/dt = [w] R and dw/dt, for angles a + b t + c t^2 / 2 at t = 0. Central differences of
    # 1e-4: h^2/6 times third derivatives below 20, 3e-8.
    rng = np.random.default_rng(6)
    a, b, c = rng.uniform(-1, 1, size=(3, 40, 3))
    h = 1e-4

    def at(t):
        return a + b * t + c * t**2 / 2, b + c * t, c

    def R(t):
        return rotation_rpy(*np.moveaxis(at(t)[0], -1, 0))

    w, dw = angular_motion(*at(0.0))
    turning = (R(h) - R(-h)) / (2 * h) @ np.swapaxes(R(0.0), 1, 2)
    seen = np.stack([turning[:, 2, 1], turning[:, 0, 2], turning[:, 1, 0]], axis=-1)
    assert np.abs(seen - w).max() < 1e-7
    faster = (angular_motion(*at(h))[0] - angular_motion(*at(-h))[0]) / (2 * h)
    assert np.abs(faster - dw).max() < 1e-7
