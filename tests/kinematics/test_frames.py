"""Frames, poses and the centre of mass."""

import math

import numpy as np
import pytest

from phasmid.kinematics import (
    angular_motion,
    body_from_hip,
    centre_of_mass,
    hip_from_body,
    leg_frames,
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
    feet = neutral_feet(load_robot("phantomx-paper"))
    assert (feet[:3, 1] < 0).all()
    assert (feet[3:, 1] > 0).all()
    assert feet[0, 0] > 0
    assert feet[5, 0] > 0
    assert feet[1] == pytest.approx([0, -0.2534, -0.1], abs=1e-15)


def test_hip_and_body_frames_invert_each_other():
    robot = load_robot("phantomx-mk4")
    p = np.random.default_rng(0).normal(size=(7, 6, 3))
    assert np.abs(hip_from_body(robot, body_from_hip(robot, p)) - p).max() < 1e-15


def test_roll_pitch_yaw_turns_about_fixed_axes_in_that_order():
    # R = Rz Ry Rx on the unit axes, by hand for quarter turns.
    R = rotation_rpy(np.array(math.pi / 2), np.array(0.0), np.array(math.pi / 2))
    assert R @ [1, 0, 0] == pytest.approx([0, 1, 0], abs=1e-15)
    assert R @ [0, 1, 0] == pytest.approx([0, 0, 1], abs=1e-15)


def test_a_yaw_quaternion_is_its_rotation_and_its_heading():
    yaw = np.linspace(-3, 3, 13)
    q = yaw_quaternion(yaw)
    expected = rotation_rpy(np.zeros(13), np.zeros(13), yaw)
    assert np.abs(quaternion_rotation(q) - expected).max() < 1e-15
    assert np.abs(quaternion_yaw(q) - yaw).max() < 1e-15


def test_the_centre_of_mass_is_the_sum_over_all_links_by_their_frames():
    # The same sum by another way: each link's frame from the DH chain, one leg at a time.
    robot = load_robot("phantomx-paper")
    q = np.random.default_rng(1).uniform(-1, 1, (5, 6, 3))
    moment = robot.body.mass * np.tile(robot.body.com, (5, 1))
    for i, leg in enumerate(robot.legs):
        X = leg.X_body_hip @ leg_frames(leg, q[:, i])
        for k, link in enumerate(leg.links):
            moment += link.mass * (X[:, k] @ [*link.com, 1.0])[:, :3]
    assert np.abs(centre_of_mass(robot, q) - moment / robot.mass).max() < 1e-15


def test_equal_steps_compose_to_one_arc():
    # Pose after s + t steps = pose after s, then t more in its frame.
    step = np.array([0.04, -0.01, 0.3])
    a, b, both = step_pose(step, np.array([1.7])), step_pose(step, np.array([2.6])), None
    both = step_pose(step, np.array([4.3]))[0]
    c, s = math.cos(a[0, 2]), math.sin(a[0, 2])
    x = a[0, 0] + c * b[0, 0] - s * b[0, 1]
    y = a[0, 1] + s * b[0, 0] + c * b[0, 1]
    assert both == pytest.approx([x, y, a[0, 2] + b[0, 2]], abs=1e-15)


@pytest.mark.parametrize("turn", [0.0, 1e-12, 1e-6, 0.5, -2.0])
def test_one_step_is_the_displacement_that_was_asked(turn):
    step = np.array([0.04, 0.02, turn])
    assert step_pose(step, np.array(1.0)) == pytest.approx(step, abs=1e-15)
    # The twist is the pose's derivative at the start; the difference errs by h |turn|^2 |step|.
    slope = step_pose(step, np.array(1e-7)) / 1e-7
    assert step_twist(step) == pytest.approx(slope, abs=1e-7)


def test_the_quaternion_of_roll_pitch_and_yaw_is_their_rotation():
    # Products of three sines and cosines: 1e-15.
    rng = np.random.default_rng(5)
    angles = rng.uniform(-1.4, 1.4, size=(3, 50))
    R = quaternion_rotation(rpy_quaternion(*angles))
    assert np.abs(R - rotation_rpy(*angles)).max() < 1e-15


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
