"""The paper's kinematics as printed, with every misprint mended."""

import numpy as np
import pytest

from phasmid.kinematics import dh_transform, foot_position, joint_angles, rotation_rpy
from phasmid.kinematics.printed import (
    printed_body_rotation,
    printed_dh_transform,
    printed_joint_angles,
    printed_leg_pose,
)
from phasmid.robot import load_robot, preset_names

PRESETS = preset_names()


@pytest.mark.parametrize("preset", PRESETS)
def test_eqs_3_to_9_mended_are_the_joint_angles(preset):
    # Knees bent by 0.2 rad or more: the arc cosine multiplies round-off by at most 1/sin(0.2),
    # so that 5 * 2.2e-16 * a few terms stays below 1e-13.
    leg = load_robot(preset).legs[0]
    q = np.random.default_rng(0).uniform([-3.0, -0.7, -2.0], [3.0, 0.7, -0.2], (1000, 3))
    p = foot_position(leg, q[foot_position(leg, q * [0, 1, 1])[:, 0] > 0.01])
    assert len(p) > 500
    mended = printed_joint_angles(leg, p, misprints=())
    np.testing.assert_allclose(mended, joint_angles(leg, p), rtol=0, atol=1e-13)


def test_a_foot_out_of_reach_has_no_angles():
    leg = load_robot("phantomx-paper").legs[0]
    q = printed_joint_angles(leg, np.array([1.0, 0.0, 0.0]), misprints=())
    assert np.isnan(q).tolist() == [False, True, True]


def test_eq_1_mended_is_the_transform_of_the_chain():
    numbers = np.random.default_rng(1).uniform(-2.0, 2.0, (4, 50))
    mended = printed_dh_transform(*numbers, misprints=())
    np.testing.assert_array_equal(mended, dh_transform(*numbers))


def test_eq_2_mended_is_the_pose_of_the_hip():
    for leg in load_robot("phantomx-paper").legs:
        p = leg.mount_position + np.array([0.0, 0.0, 0.01])
        X = printed_leg_pose(p, np.array(leg.mount_yaw), misprints=())
        np.testing.assert_allclose(X[:3, :3], leg.X_body_hip[:3, :3], rtol=0, atol=1e-15)
        np.testing.assert_array_equal(X[:, 3], [*p, 1.0])


def test_the_body_rotation_mended_is_that_of_the_package_with_y_ahead():
    # Rz(γ) Rx(β) Ry(α) in axes with y ahead is Rz(γ) Ry(-β) Rx(α) in axes with x ahead.
    roll, pitch, yaw = np.random.default_rng(2).uniform(-1.5, 1.5, (3, 50))
    paper = printed_body_rotation(roll, pitch, yaw, misprints=())
    ours_from_paper = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = ours_from_paper @ paper @ ours_from_paper.T
    np.testing.assert_allclose(turned, rotation_rpy(roll, -pitch, yaw), rtol=0, atol=1e-15)


def test_the_printed_rotation_has_a_cosine_for_a_sine():
    # T_B^G's entry (2,1) is printed with cos α cos γ where it needs cos α sin γ.
    roll, pitch, yaw = np.random.default_rng(4).uniform(-1.5, 1.5, (3, 50))
    expected = np.zeros((50, 3, 3))
    expected[:, 1, 0] = np.cos(roll) * (np.cos(yaw) - np.sin(yaw))
    # Numbers of at most 2, a few roundings each.
    angles = roll, pitch, yaw
    wrong = printed_body_rotation(*angles) - printed_body_rotation(*angles, misprints=())
    np.testing.assert_allclose(wrong, expected, rtol=0, atol=2e-15)
