"""Foot forces from joint torques; deflection of the legs."""

import numpy as np
import pytest

from phasmid.control.estimation.leg_statics import estimate_compliance, normal_force
from phasmid.dynamics import BodyMotion, inverse_dynamics
from phasmid.kinematics import body_from_hip, foot_position, joint_angles
from phasmid.robot import load_robot
from phasmid.units import STANDARD_GRAVITY
from support.estimation_records import new_parameters, new_state
from support.general_robot import general_robot

ROBOT = load_robot("phantomx-mk4")
Q = np.random.default_rng(5).uniform([-0.5, -0.3, -2.0], [0.5, 0.8, -0.8], (6, 3))


@pytest.mark.parametrize("robot", [ROBOT, general_robot()], ids=lambda robot: robot.name)
def test_static_torques_determine_the_vertical_force(robot):
    """The torques are the dynamics' own; hips tilt by up to 0.6 rad, feet have lateral offsets.

    Force and weights, 40 N in all, are divided by a knee's sine of 0.7 and by the distance of the
    foot from the coxa axis in lengths of the leg, 0.1: round-off of 1e-15 becomes 1e-12 N.
    """
    legs, rng = len(robot.legs), np.random.default_rng(6)
    F, still = rng.uniform([-3, -3, -2], [3, 3, 15], (legs, 3)), np.zeros((legs, 3))
    body = BodyMotion(*np.zeros((1, 3)), np.eye(3), *np.zeros((4, 3)))
    torque, _ = inverse_dynamics(
        robot, body, Q[:legs], still, still, foot_force=F, gravity=STANDARD_GRAVITY
    )
    parameters = new_parameters(robot=robot)
    for leg in range(legs):
        force = normal_force(parameters, leg, Q[leg], torque[leg])
        assert force == pytest.approx(F[leg, 2], abs=1e-10)


def test_a_stretched_leg_determines_no_force():
    parameters = new_parameters()
    assert np.isnan(normal_force(parameters, 2, np.array([0.1, 0.3, 0.0]), np.zeros(3)))
    assert np.isfinite(normal_force(parameters, 2, Q[2], np.zeros(3)))


def compliance(robot, measured, bearing, target, feet):
    """Mean sag of the body, and that of each foot in the air."""
    legs, state = len(robot.legs), new_state()
    state.feet["standing"][:legs] = state.feet["bearing"][:legs] = bearing
    mean = estimate_compliance(target, measured, feet, state, new_parameters(robot=robot))
    return mean, state.feet["sag"][:legs]


@pytest.mark.parametrize("robot", [ROBOT, general_robot()], ids=lambda robot: robot.name)
def test_the_sag_is_the_mean_height_that_standing_feet_lack(robot):
    """By the feet's heights in the body frame."""
    legs = len(robot.legs)
    bearing = np.array([True, True, False, True, True, True])[:legs]
    measured = Q[:legs] + np.random.default_rng(7).uniform(-0.05, 0.05, (legs, 3))
    target, feet = Q[:legs], np.array(robot.arrays.neutral_foot)
    before, after = (
        body_from_hip(robot, foot_position(robot.arrays, q)) for q in (target, measured)
    )
    measured[4] = np.nan
    sag = (after - before)[[0, 1, 3, *range(5, legs)], 2].mean()
    assert compliance(robot, measured, bearing, target, feet)[0] == pytest.approx(sag, rel=1e-11)
    assert compliance(robot, measured, ~np.ones(legs, bool), target, feet)[0] == 0.0


def test_feet_in_the_air_hang_lower_by_the_body_s_sag_there_and_by_their_own():
    """Of a stiff body on three feet, h = a + b x + c y: the other feet's own joints are off by d.

    The plane is drawn to level by 3 (30 mm)² over the feet's sum of squares, 0.1 m²: by 3 % of at
    most 7 mm.
    """
    standing = np.array([True, False, True, False, True, False])
    target = joint_angles(ROBOT.arrays, ROBOT.arrays.neutral_foot)
    feet = body_from_hip(ROBOT, np.array(ROBOT.arrays.neutral_foot))
    height = 0.008 + 0.02 * feet[:, 0] - 0.01 * feet[:, 1]
    higher = np.array(ROBOT.arrays.neutral_foot)
    higher[:, 2] += np.where(standing, height, -0.004)
    measured = joint_angles(ROBOT.arrays, higher)
    mean, sag = compliance(ROBOT, measured, standing, target, feet)
    assert mean == pytest.approx(height[standing].mean())
    np.testing.assert_array_equal(sag[standing], 0.0)
    np.testing.assert_allclose(sag[~standing], height[~standing] + 0.004, atol=2.5e-4)
