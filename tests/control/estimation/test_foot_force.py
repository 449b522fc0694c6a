"""What a foot carries, by its joints' torques; how far legs give way."""

import numpy as np
import pytest

from phasmid.control.estimation.foot_force import foot_forces
from phasmid.control.estimation.joint_compliance import fit_joint_compliance
from phasmid.dynamics import leg_torque
from phasmid.kinematics import body_from_hip, foot_position, joint_angles
from phasmid.robot import load_robot
from phasmid.units import STANDARD_GRAVITY

ROBOT = load_robot("phantomx-mk4")
Q = np.random.default_rng(5).uniform([-0.5, -0.3, -2.0], [0.5, 0.8, -0.8], (6, 3))


def forces(q, torque):
    arrays, told = ROBOT.arrays, np.empty(6)
    foot_forces(
        q, torque, *map(np.array, (arrays.lengths, arrays.mass, arrays.com)), STANDARD_GRAVITY, told
    )
    return told


def test_static_torques_tell_the_force_that_made_them():
    """The torques by the dynamics' own equations, Eq. 11 at rest."""
    F = np.random.default_rng(6).uniform([-3, -3, -2], [3, 3, 15], (6, 3))
    still = np.zeros((6, 3))
    torque = leg_torque(ROBOT.arrays, Q, still, still, foot_force=F)
    np.testing.assert_allclose(forces(Q, torque), F[:, 2], atol=1e-9)


def test_a_stretched_leg_tells_no_force():
    q = Q.copy()
    q[2, 2] = 0.0
    told = forces(q, np.zeros((6, 3)))
    assert np.isnan(told[2])
    assert np.isfinite(np.delete(told, 2)).all()


def mean_sag(given, standing):
    """Of the body."""
    places, lengths = np.array(ROBOT.arrays.neutral_foot), np.array(ROBOT.arrays.lengths)
    return fit_joint_compliance(Q, given, lengths, standing, standing, places, np.zeros(6))


def test_the_sag_is_the_mean_height_that_standing_feet_lack():
    """By the feet's places in their hip frames."""
    standing = np.array([True, True, False, True, True, True])
    given = Q + np.random.default_rng(7).uniform(-0.05, 0.05, Q.shape)
    given[4] = np.nan
    z = foot_position(ROBOT.arrays, given)[:, 2] - foot_position(ROBOT.arrays, Q)[:, 2]
    np.testing.assert_allclose(mean_sag(given, standing), z[[0, 1, 3, 5]].mean(), rtol=1e-12)
    assert mean_sag(given, np.zeros(6, dtype=bool)) == 0.0


def test_feet_in_the_air_hang_lower_by_the_body_s_sag_there_and_by_their_own():
    """Of a stiff body on three feet, h = a + b x + c y: the other feet's own joints are off by d.

    The plane is drawn to level by 3 (30 mm)² over the feet's sum of squares, 0.1 m²: by 3 % of at
    most 7 mm.
    """
    standing = np.array([True, False, True, False, True, False])
    wanted = joint_angles(ROBOT.arrays, ROBOT.arrays.neutral_foot)
    places = body_from_hip(ROBOT, np.array(ROBOT.arrays.neutral_foot))
    height = 0.008 + 0.02 * places[:, 0] - 0.01 * places[:, 1]
    own = np.where(standing, height, -0.004)
    higher = np.array(ROBOT.arrays.neutral_foot)
    higher[:, 2] += own
    given, told = joint_angles(ROBOT.arrays, higher), np.zeros(6)
    lengths = np.array(ROBOT.arrays.lengths)
    mean = fit_joint_compliance(wanted, given, lengths, standing, standing, places, told)
    assert mean == pytest.approx(height[standing].mean())
    np.testing.assert_array_equal(told[standing], 0.0)
    np.testing.assert_allclose(told[~standing], height[~standing] + 0.004, atol=2.5e-4)
