"""The frame odom comes upright without a joint's motion."""

import numpy as np

from phasmid.control.engine import LocomotionEngine
from phasmid.control.estimation.odometry_alignment import align_odometry
from phasmid.control.records import record_behind
from phasmid.experiment import Command, Observation
from phasmid.kinematics import hip_from_body, joint_angles
from phasmid.robot import load_robot
from support.estimation_records import new_parameters, new_state

ROBOT = load_robot("phantomx-mk4")
DT = 0.005


def walking_engine():
    """An engine amid a swing, whose body is off its neutral pose."""
    engine = LocomotionEngine(ROBOT, ground_sensing=False, dynamics="none")
    command = Command(velocity=(0.06, 0.02, 0.1), pose=(0.0, 0.0, 0.01, 0.05, -0.04, 0.0))
    q = ROBOT.arrays.neutral_foot
    q = joint_angles(ROBOT.arrays, q)
    for k in range(250):
        engine.update(Observation(time=k * DT, joint_position=q), command)
    return engine


def seen_by_joints(state):
    """Joint angles that put the feet where they are from the body where it is."""
    p_body = (state.foot - state.body_position) @ state.R_odom_body
    return joint_angles(ROBOT.arrays, hip_from_body(ROBOT, p_body))


def test_odom_turns_upright_and_no_joint_moves():
    """R_body and p_foot - p_body turn as one: R' p' = R p; pose and planes hold the same turn."""
    engine = walking_engine()
    state = engine.state
    lean = np.array([0.2, -0.1, 1.0]) / np.linalg.norm([0.2, -0.1, 1.0])
    estimator = new_state()
    estimator.levelling.up = lean
    estimator.feet["foothold"][:6] = state.foot
    # Places where feet look for ground, beside them.
    state.search_goal[:] = np.add(state.foot, [0.06, 0.0, 0.0])
    looks = (state.search_goal - state.body_position) @ state.R_odom_body
    plane = estimator.ground_plane
    plane.height, plane.slope_x, plane.slope_y = 0.01, 0.1, -0.2
    plane.x, plane.y = state.path[:2]
    estimator.body_attitudes[:2] = state.R_odom_body
    up_body = state.R_odom_body.T @ lean
    before, body = seen_by_joints(state), state.R_odom_body.copy()
    state.ground_filter[:, 1:] = 0.1, -0.2
    # Height of the body over the plane at its path's place, as `set_body_motion` has it.
    height = state.ground_filter[3, 0] + state.ground_filter[3, 1:] @ state.path[:2]
    normal = body.T @ [-0.1, 0.2, 1.0]
    parameters = new_parameters(attitude_delay=2)
    for _ in range(2000):
        align_odometry(record_behind(state), estimator, parameters)
    assert np.arccos(estimator.levelling.up[2]) < 1e-6
    np.testing.assert_allclose(seen_by_joints(state), before, atol=1e-12)
    np.testing.assert_allclose(state.R_odom_body @ up_body, [0.0, 0.0, 1.0], atol=1e-6)
    np.testing.assert_allclose(estimator.body_attitudes[0], state.R_odom_body, atol=1e-12)
    np.testing.assert_allclose(estimator.feet["foothold"][:6], state.foot, atol=1e-12)
    np.testing.assert_allclose(
        (state.search_goal - state.body_position) @ state.R_odom_body, looks, atol=1e-12
    )
    np.testing.assert_allclose(
        state.ground_filter[3, 0] + state.ground_filter[3, 1:] @ state.path[:2], height, atol=1e-12
    )
    # Both planes' normals are fixed to the body.
    for slope in ((plane.slope_x, plane.slope_y), state.ground_filter[3, 1:]):
        turned = state.R_odom_body.T @ [-slope[0], -slope[1], 1.0]
        np.testing.assert_allclose(np.cross(turned, normal), 0.0, atol=1e-12)
    roll, pitch = state.pose_filter[3, 3:5]
    assert np.isclose(-np.sin(pitch), state.R_odom_body[2, 0], atol=1e-12)
    assert np.isclose(np.cos(pitch) * np.sin(roll), state.R_odom_body[2, 1], atol=1e-12)
