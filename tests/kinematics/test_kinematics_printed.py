"""The paper's kinematics as printed, with every misprint corrected."""

import numpy as np

from phasmid.kinematics import dh_transform, rotation_rpy
from phasmid.kinematics.printed import printed_body_rotation, printed_dh_transform, printed_leg_pose
from phasmid.robot import load_robot

LEG = load_robot("phantomx-paper").legs[0]


def test_eqs_1_and_2_corrected_are_the_transforms_of_chain_and_hip():
    numbers = np.random.default_rng(1).uniform(-2.0, 2.0, (4, 50))
    corrected = printed_dh_transform(*numbers, misprints=())
    np.testing.assert_array_equal(corrected, dh_transform(*numbers))
    p = LEG.mount_position + np.array([0.0, 0.0, 0.01])
    X = printed_leg_pose(p, np.array(LEG.mount_yaw), misprints=())
    np.testing.assert_allclose(X[:3, :3], LEG.X_body_hip[:3, :3], rtol=0, atol=1e-15)
    np.testing.assert_array_equal(X[:, 3], [*p, 1.0])


def test_the_body_rotation_has_a_cosine_for_a_sine():
    # Rz(γ) Rx(β) Ry(α) in axes with y ahead is Rz(γ) Ry(-β) Rx(α) in axes with x ahead.
    roll, pitch, yaw = np.random.default_rng(2).uniform(-1.5, 1.5, (3, 50))
    corrected = printed_body_rotation(roll, pitch, yaw, misprints=())
    R_ours_paper = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = R_ours_paper @ corrected @ R_ours_paper.T
    np.testing.assert_allclose(turned, rotation_rpy(roll, -pitch, yaw), rtol=0, atol=1e-15)
    # T_B^G's entry (2,1) is printed with cos α cos γ where it needs cos α sin γ.
    expected = np.zeros((50, 3, 3))
    expected[:, 1, 0] = np.cos(roll) * (np.cos(yaw) - np.sin(yaw))
    wrong = printed_body_rotation(roll, pitch, yaw) - corrected
    np.testing.assert_allclose(wrong, expected, rtol=0, atol=2e-15)
