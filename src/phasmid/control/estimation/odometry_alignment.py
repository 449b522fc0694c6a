"""Align the odometry frame with gravity."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.control.estimation.state import EstimatorParameters, EstimatorState
from phasmid.control.types import State

ALIGNMENT_TIME = 0.5
"""Time constant of the alignment [s]."""

ALIGNMENT_RATE = 0.35
"""Largest angular velocity of the alignment [rad/s]."""


@compiled
def align_odometry(
    state: State, estimator: EstimatorState, parameters: EstimatorParameters
) -> None:
    """Rotate all estimates in odom about the body, towards the measured direction of up.

    Heights of feet that slip, deflect or meet a riser add up to an apparent slope; gravity removes
    it. Body and feet rotate as one, so that no joint moves.
    """
    up, dt = estimator.levelling.up, parameters.dt
    flat = math.hypot(up[0], up[1])
    if flat < 1e-9:
        return
    tilt = math.atan2(flat, up[2])
    angle = min(tilt * dt / ALIGNMENT_TIME, ALIGNMENT_RATE * dt)
    # About the horizontal axis (up x z) / |up x z|.
    x, y = up[1] / flat, -up[0] / flat
    c, s = math.cos(angle), math.sin(angle)
    xy = x * y * (1 - c)
    R = np.array(
        [
            [c + x * x * (1 - c), xy, y * s],
            [xy, c + y * y * (1 - c), -x * s],
            [-y * s, x * s, c],
        ]
    )
    origin, p = np.zeros(3), state.body_position.copy()
    rotate_points(R, origin, up.reshape((1, 3)))
    for k in range(parameters.attitude_delay):
        rotate_points(R, origin, estimator.body_attitudes[k].T)
    rotate_points(R, origin, state.R_odom_body.T)
    align_pose(state)
    for vector in (
        state.body_velocity,
        state.body_acceleration,
        state.angular_velocity,
        state.angular_acceleration,
    ):
        rotate_points(R, origin, vector.reshape((1, 3)))
    for vectors in (
        state.line_velocity,
        state.line_acceleration,
        state.foot_velocity,
        state.foot_acceleration,
    ):
        rotate_points(R, origin, vectors)
    for points in (
        state.foot,
        state.line_position,
        state.touchdown,
        state.search_goal,
        state.missed_foothold,
        state.last_foothold,
        state.next_foothold,
    ):
        rotate_points(R, p, points)
    for leg in range(parameters.leg_count):
        rotate_points(R, p, estimator.feet[leg].foothold.reshape((1, 3)))
    for plane in (estimator.fitted_plane, estimator.lagged_plane, estimator.ground_plane):
        # The reference point keeps x and y.
        q = np.array([plane.x, plane.y, plane.height])
        moved = p + R @ (q - p)
        plane.slope_x, plane.slope_y = rotated_slopes(R, plane.slope_x, plane.slope_y)
        rise = plane.slope_x * (q[0] - moved[0]) + plane.slope_y * (q[1] - moved[1])
        plane.height = moved[2] + rise
    # The ground's height under the path stays the same.
    ground, path = state.ground_filter, state.path
    for k in range(4):
        a, b = rotated_slopes(R, ground[k, 1], ground[k, 2])
        ground[k, 0] += (ground[k, 1] - a) * path[0] + (ground[k, 2] - b) * path[1]
        ground[k, 1], ground[k, 2] = a, b


@compiled
def align_pose(state: State) -> None:
    """Take the angles of the body's attitude over into all stages of the pose filter."""
    body, pose = state.R_odom_body, state.pose_filter
    pitch = -math.asin(min(max(body[2, 0], -1.0), 1.0))
    roll = math.atan2(body[2, 1], body[2, 2])
    yaw = math.atan2(body[1, 0], body[0, 0]) - state.path[2]
    pose[:, 5] += (yaw - pose[3, 5] + math.pi) % (2 * math.pi) - math.pi
    pose[:, 3] += roll - pose[3, 3]
    pose[:, 4] += pitch - pose[3, 4]


@compiled
def rotate_points(
    R: Float[np.ndarray, "3 3"], p: Float[np.ndarray, "3"], points: Float[np.ndarray, "count 3"]
) -> None:
    """Rotate points about a point in place; a loop, 8 times as fast as a product of matrices."""
    for i in range(len(points)):
        x, y, z = points[i, 0] - p[0], points[i, 1] - p[1], points[i, 2] - p[2]
        for k in range(3):
            points[i, k] = p[k] + R[k, 0] * x + R[k, 1] * y + R[k, 2] * z


@compiled
def rotated_slopes(
    R: Float[np.ndarray, "3 3"], slope_x: float, slope_y: float
) -> tuple[float, float]:
    """Return the slopes of a plane after a rotation."""
    x = -R[0, 0] * slope_x - R[0, 1] * slope_y + R[0, 2]
    y = -R[1, 0] * slope_x - R[1, 1] * slope_y + R[1, 2]
    z = -R[2, 0] * slope_x - R[2, 1] * slope_y + R[2, 2]
    return -x / z, -y / z
