"""Foot forces from joint torques; deflection of the legs."""

import numpy as np
import pytest

from estimation_records import new_parameters, new_state
from phasmid.control.estimation.foot_force import normal_force
from phasmid.control.estimation.joint_compliance import estimate_compliance
from phasmid.dynamics import leg_torque
from phasmid.kinematics import body_from_hip, foot_position, joint_angles
from phasmid.robot import load_robot

ROBOT = load_robot("phantomx-mk4")
Q = np.random.default_rng(5).uniform([-0.5, -0.3, -2.0], [0.5, 0.8, -0.8], (6, 3))


def forces(q, torque):
    parameters = new_parameters()
    return np.array([normal_force(parameters, leg, q[leg], torque[leg]) for leg in range(6)])


def test_static_torques_determine_the_force():
    """The torques by the dynamics' own equations, Eq. 11 at rest."""
    F = np.random.default_rng(6).uniform([-3, -3, -2], [3, 3, 15], (6, 3))
    still = np.zeros((6, 3))
    torque = leg_torque(ROBOT.arrays, Q, still, still, foot_force=F)
    np.testing.assert_allclose(forces(Q, torque), F[:, 2], atol=1e-9)


def test_a_stretched_leg_determines_no_force():
    q = Q.copy()
    q[2, 2] = 0.0
    force = forces(q, np.zeros((6, 3)))
    assert np.isnan(force[2])
    assert np.isfinite(np.delete(force, 2)).all()


def mean_sag(given, standing, target=Q, places=None):
    """Of the body, and of the feet in the air."""
    state = new_state()
    state.feet["standing"][:6] = state.feet["bearing"][:6] = standing
    places = np.array(ROBOT.arrays.neutral_foot) if places is None else places
    mean = estimate_compliance(target, given, places, state, new_parameters())
    return mean, state.feet["sag"][:6]


def test_the_sag_is_the_mean_height_that_standing_feet_lack():
    """By the feet's places in their hip frames."""
    standing = np.array([True, True, False, True, True, True])
    given = Q + np.random.default_rng(7).uniform(-0.05, 0.05, Q.shape)
    given[4] = np.nan
    z = foot_position(ROBOT.arrays, given)[:, 2] - foot_position(ROBOT.arrays, Q)[:, 2]
    np.testing.assert_allclose(mean_sag(given, standing)[0], z[[0, 1, 3, 5]].mean(), rtol=1e-12)
    assert mean_sag(given, np.zeros(6, dtype=bool))[0] == 0.0


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
    given = joint_angles(ROBOT.arrays, higher)
    mean, sag = mean_sag(given, standing, wanted, places)
    assert mean == pytest.approx(height[standing].mean())
    np.testing.assert_array_equal(sag[standing], 0.0)
    np.testing.assert_allclose(sag[~standing], height[~standing] + 0.004, atol=2.5e-4)
