"""Keeps the frame odom upright: what was dead-reckoned in it turns with what is measured."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import internal
from phasmid.control.estimation.body_levelling import UP
from phasmid.control.estimation.ground_plane import AT_X, AT_Y, HEIGHT, SLOPE_X, SLOPE_Y
from phasmid.control.types import State

UPRIGHT_TIME, UPRIGHT_RATE = 0.5, 0.35
"""Within what time odom comes upright [s], and how fast it may turn [rad/s]."""


@internal
def turn(R: np.ndarray, vectors: np.ndarray) -> None:
    """Turn vectors in place, shape (N, 3)."""
    for i in range(len(vectors)):
        x, y, z = vectors[i, 0], vectors[i, 1], vectors[i, 2]
        for k in range(3):
            vectors[i, k] = R[k, 0] * x + R[k, 1] * y + R[k, 2] * z


@internal
def turn_about(R: np.ndarray, p: np.ndarray, places: np.ndarray) -> None:
    """Turn places about a point in place, shape (N, 3)."""
    for i in range(len(places)):
        x, y, z = places[i, 0] - p[0], places[i, 1] - p[1], places[i, 2] - p[2]
        for k in range(3):
            places[i, k] = p[k] + R[k, 0] * x + R[k, 1] * y + R[k, 2] * z


@internal
def slopes_of(R: np.ndarray, slope_x: float, slope_y: float) -> tuple[float, float]:
    """Slopes of a plane once it is turned."""
    x = -R[0, 0] * slope_x - R[0, 1] * slope_y + R[0, 2]
    y = -R[1, 0] * slope_x - R[1, 1] * slope_y + R[1, 2]
    z = -R[2, 0] * slope_x - R[2, 1] * slope_y + R[2, 2]
    return -x / z, -y / z


@internal
def align_odometry(
    dt: float,
    state: State,
    level: Float[np.ndarray, " 9"],
    stood: Float[np.ndarray, "legs 4"],
    planes: Float[np.ndarray, "3 5"],
    turned: Float[np.ndarray, "N 3 3"],
) -> None:
    """Turn all that is known in odom about the body, towards where its z is upwards.

    Heights of feet that slip, give way or meet a riser add up to a slope that is none; what is
    felt of gravity takes it out again. Body and feet turn as one, so that no joint moves.

    Args:
        dt: Since the last update [s].
        state: Where the engine is, is changed.
        level: Memory of `level_body`, whose measured direction of up is in odom; is changed.
        stood: Places of the feet in `fit_plane`, is changed, shape (L, 4).
        planes: The planes in `fit_plane`, is changed, shape (3, 5).
        turned: Commanded attitudes of the last moments, is changed, shape (N, 3, 3).
    """
    up = level[UP]
    flat = math.hypot(up[0], up[1])
    if flat < 1e-9:
        return
    lean = math.atan2(flat, up[2])
    angle = min(lean * dt / UPRIGHT_TIME, UPRIGHT_RATE * dt)
    # About the horizontal axis (up x z) / |up x z|.
    x, y = up[1] / flat, -up[0] / flat
    c, s = math.cos(angle), math.sin(angle)
    R = np.empty((3, 3))
    R[0, 0], R[0, 1], R[0, 2] = c + x * x * (1 - c), x * y * (1 - c), y * s
    R[1, 0], R[1, 1], R[1, 2] = x * y * (1 - c), c + y * y * (1 - c), -x * s
    R[2, 0], R[2, 1], R[2, 2] = -y * s, x * s, c
    p = state.body_position.copy()
    turn(R, up.reshape((1, 3)))
    for i in range(len(turned)):
        turn(R, turned[i].T)
    turn(R, state.R_odom_body.T)
    body, pose = state.R_odom_body, state.pose_filter
    pitch = -math.asin(min(max(body[2, 0], -1.0), 1.0))
    roll = math.atan2(body[2, 1], body[2, 2])
    yaw = math.atan2(body[1, 0], body[0, 0]) - state.path[2]
    change = np.empty(3)
    change[0], change[1] = roll - pose[3, 3], pitch - pose[3, 4]
    change[2] = (yaw - pose[3, 5] + math.pi) % (2 * math.pi) - math.pi
    for k in range(4):
        for i in range(3):
            pose[k, 3 + i] += change[i]
    turn(R, state.body_velocity.reshape((1, 3)))
    turn(R, state.body_acceleration.reshape((1, 3)))
    turn(R, state.angular_velocity.reshape((1, 3)))
    turn(R, state.angular_acceleration.reshape((1, 3)))
    turn_about(R, p, state.foot)
    turn_about(R, p, state.line_position)
    turn_about(R, p, state.touchdown)
    turn_about(R, p, state.search_goal)
    turn_about(R, p, state.missed_foothold)
    turn_about(R, p, state.last_foothold)
    turn(R, state.line_velocity)
    turn(R, state.line_acceleration)
    turn(R, state.foot_velocity)
    turn(R, state.foot_acceleration)
    turn_about(R, p, stood[:, :3])
    q = np.empty((1, 3))
    for k in range(3):
        q[0, 0], q[0, 1], q[0, 2] = planes[k, AT_X], planes[k, AT_Y], planes[k, HEIGHT]
        a, b = slopes_of(R, planes[k, SLOPE_X], planes[k, SLOPE_Y])
        turn_about(R, p, q)
        planes[k, SLOPE_X], planes[k, SLOPE_Y] = a, b
        planes[k, HEIGHT] = q[0, 2] + a * (planes[k, AT_X] - q[0, 0])
        planes[k, HEIGHT] += b * (planes[k, AT_Y] - q[0, 1])
    # The body's own height over its plane stays what it was, over its path's place.
    ground, path = state.ground_filter, state.path
    for k in range(4):
        a, b = slopes_of(R, ground[k, 1], ground[k, 2])
        ground[k, 0] += (ground[k, 1] - a) * path[0] + (ground[k, 2] - b) * path[1]
        ground[k, 1], ground[k, 2] = a, b
