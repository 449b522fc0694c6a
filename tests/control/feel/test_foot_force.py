"""What a foot carries, by its joints' torques; how far legs give way."""

import numpy as np

from phasmid.control.feel.foot_force import foot_forces
from phasmid.control.feel.sag import mean_sag
from phasmid.dynamics import leg_torque
from phasmid.kinematics import foot_position
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


def test_the_sag_is_the_mean_height_that_standing_feet_lack():
    """By the feet's places in their hip frames."""
    standing = np.array([True, True, False, True, True, True])
    given = Q + np.random.default_rng(7).uniform(-0.05, 0.05, Q.shape)
    given[4] = np.nan
    z = foot_position(ROBOT.arrays, given)[:, 2] - foot_position(ROBOT.arrays, Q)[:, 2]
    told = mean_sag(Q, given, np.array(ROBOT.arrays.lengths), standing)
    np.testing.assert_allclose(told, z[[0, 1, 3, 5]].mean(), rtol=1e-12)
    assert mean_sag(Q, given, np.array(ROBOT.arrays.lengths), np.zeros(6, dtype=bool)) == 0.0
