"""Motion of the body: its path on the ground, its pose relative to that, and the gait's sway."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import internal
from phasmid.control.body_kernels import rotation
from phasmid.control.types import Model, Reference, State
from phasmid.kinematics.leg_kernels import Triple

VELOCITY_BANDWIDTH, POSE_BANDWIDTH, SWAY_BANDWIDTH = 20.0, 15.0, 15.0
"""Bandwidths of the filters of velocity, pose and ground, and sway [1/s]."""

Path = np.ndarray | Triple
"""Place and heading in odom [m, rad]."""


@internal
def is_zero(velocity: np.ndarray) -> bool:
    """Return whether a velocity is exactly zero."""
    return bool(velocity[0] == 0.0 and velocity[1] == 0.0 and velocity[2] == 0.0)


@internal
def ground_height(state: State, x: float, y: float) -> float:
    """Return the height of the estimated ground plane at a point of odom [m]."""
    g = state.ground_filter[3]
    return float(g[0] + g[1] * x + g[2] * y)


@internal
def com_in_odom(state: State) -> tuple[float, float]:
    """Return the centre of mass in odom, from above [m]."""
    R, com, body = state.R_odom_body, state.com, state.body_position
    return (
        R[0, 0] * com[0] + R[0, 1] * com[1] + R[0, 2] * com[2] + body[0],
        R[1, 0] * com[0] + R[1, 1] * com[1] + R[1, 2] * com[2] + body[1],
    )


@internal
def in_odom(path: Path, x: float, y: float) -> tuple[float, float]:
    """Return a point of the path's axes in odom [m]."""
    c, s = math.cos(path[2]), math.sin(path[2])
    return path[0] + c * x - s * y, path[1] + s * x + c * y


@internal
def in_path(path: Path, x: float, y: float) -> tuple[float, float]:
    """Return a point of odom in the path's axes [m]."""
    c, s = math.cos(path[2]), math.sin(path[2])
    x, y = x - path[0], y - path[1]
    return c * x + s * y, c * y - s * x


@internal
def point_velocity(path: Path, velocity: np.ndarray, x: float, y: float) -> tuple[float, float]:
    """Return the velocity in odom of a point of odom that moves with the path [m/s]."""
    c, s = math.cos(path[2]), math.sin(path[2])
    return (
        c * velocity[0] - s * velocity[1] - velocity[2] * (y - path[1]),
        s * velocity[0] + c * velocity[1] + velocity[2] * (x - path[0]),
    )


@internal
def follow(stages: np.ndarray, omega: float, h: float) -> None:
    """Advance a chain of n equal first-order lags, exactly, while its input stays constant.

    Rows of `stages` are the input and the lags' outputs, `omega` is their bandwidth [1/s]. The last
    output is a weighted mean of past inputs, so it never leaves their range. Its first n - 1
    derivatives are continuous.
    """
    x = omega * h
    decay = math.exp(-x)
    count = len(stages) - 1
    for k in range(stages.shape[1]):
        r = stages[0, k]
        for n in range(count, 0, -1):
            # y_n - r receives the earlier stages' shares x^m / m!.
            total, term = 0.0, 1.0
            for m in range(n):
                total += term * (stages[n - m, k] - r)
                term *= x / (m + 1)
            stages[n, k] = r + decay * total


@internal
def lag_motion(stages: np.ndarray, omega: float, i: int) -> Triple:
    """Return one number of the last output of a chain of lags, and its first two derivatives."""
    n = len(stages) - 1
    before, y = stages[n - 1, i], stages[n, i]
    return y, omega * (before - y), omega * omega * (stages[n - 2, i] - 2 * before + y)


@internal
def approach(
    reference: np.ndarray, target: np.ndarray, first: int, scale: float, most: float
) -> None:
    """Move three numbers of a reference straight towards a target, by `most` at most.

    They begin at index `first`; the third counts `scale` times in that length.
    """
    dx = target[first] - reference[first]
    dy = target[first + 1] - reference[first + 1]
    dz = (target[first + 2] - reference[first + 2]) * scale
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    share = 1.0 if length <= most else most / length
    for i in range(first, first + 3):
        gap = target[i] - reference[i]
        reference[i] = target[i] if share == 1.0 else reference[i] + share * gap


@internal
def integrate_twist(path: Path, twist: np.ndarray, time: float) -> Triple:
    """Return the path after a time [s] at constant vx, vy, wz in its axes: an arc or a line."""
    turn = twist[2] * time
    if abs(turn) < 1e-4:
        along, across = 1.0 - turn * turn / 6, turn / 2
    else:
        along, across = math.sin(turn) / turn, (1.0 - math.cos(turn)) / turn
    dx = (along * twist[0] - across * twist[1]) * time
    dy = (across * twist[0] + along * twist[1]) * time
    x, y = in_odom(path, dx, dy)
    return x, y, path[2] + turn


@internal
def sway_wave(model: Model, reference: Reference, phase: float, out: np.ndarray) -> None:
    """Write the gait's sway and its two derivatives by phase: see `phasmid.gait.sway`.

    Each is a displacement forward and left [m]; `out` has shape (3, 2).
    """
    out[:] = 0.0
    if reference.sway == 0.0:
        return
    used, rate = reference.used, 2 * math.pi
    mx, my, count = 0.0, 0.0, 0
    for leg in range(model.leg_count):
        if used[leg]:
            mx += model.neutral[leg, 0]
            my += model.neutral[leg, 1]
            count += 1
    mx, my = mx / max(count, 1), my / max(count, 1)
    for leg in range(model.leg_count):
        if not used[leg]:
            continue
        x = reference.sway * (mx - model.neutral[leg, 0])
        y = reference.sway * (my - model.neutral[leg, 1])
        angle = rate * (phase - reference.lift_phase[leg] - (1 - reference.duty_factor) / 2)
        c, s = math.cos(angle), math.sin(angle)
        out[0, 0] += c * x
        out[0, 1] += c * y
        out[1, 0] -= rate * s * x
        out[1, 1] -= rate * s * y
        out[2, 0] -= rate * rate * c * x
        out[2, 1] -= rate * rate * c * y


@internal
def place_body(
    state: State,
    model: Model,
    path: Path,
    pose: np.ndarray,
    x: float,
    y: float,
    R: np.ndarray,
    body: np.ndarray,
) -> None:
    """Write rotation and place of a body with a pose relative to a path, and (x, y) beside it."""
    rotation(pose[3], pose[4], pose[5] + path[2], R)
    body[0], body[1] = in_odom(path, x + pose[0], y + pose[1])
    body[2] = ground_height(state, path[0], path[1]) + model.height + pose[2]


@internal
def set_body_motion(state: State, model: Model) -> None:
    """Write the body's rotation, place, velocities and accelerations in odom from the filters."""
    path, v, a = state.path, state.velocity_filter[2], np.empty(3)
    c, s = math.cos(path[2]), math.sin(path[2])
    # Pose relative to the path, in the path's axes; the ground's height and slopes.
    b, bd, bdd = np.empty(6), np.empty(6), np.empty(6)
    g, gd, gdd = np.empty(3), np.empty(3), np.empty(3)
    for i in range(3):
        _, a[i], _ = lag_motion(state.velocity_filter, VELOCITY_BANDWIDTH, i)
        g[i], gd[i], gdd[i] = lag_motion(state.ground_filter, POSE_BANDWIDTH, i)
    for i in range(6):
        b[i], bd[i], bdd[i] = lag_motion(state.pose_filter, POSE_BANDWIDTH, i)
    for i in range(2):
        sway, rate, acceleration = lag_motion(state.sway_filter, SWAY_BANDWIDTH, i)
        b[i], bd[i], bdd[i] = b[i] + sway, bd[i] + rate, bdd[i] + acceleration
    w, wd = v[2], a[2]
    # d/dt of R(yaw) b is R (b' + w J b), with J a quarter turn to the left.
    vx, vy = v[0] + bd[0] - w * b[1], v[1] + bd[1] + w * b[0]
    ax = a[0] - w * v[1] + bdd[0] - 2 * w * bd[1] - wd * b[1] - w * w * b[0]
    ay = a[1] + w * v[0] + bdd[1] + 2 * w * bd[0] + wd * b[0] - w * w * b[1]
    position, velocity = state.body_position, state.body_velocity
    # The path rises with the plane under it.
    sx, sy = g[1], g[2]
    px, py = c * v[0] - s * v[1], s * v[0] + c * v[1]
    qx, qy = a[0] - w * v[1], a[1] + w * v[0]
    position[0], position[1] = in_odom(path, b[0], b[1])
    position[2] = g[0] + sx * path[0] + sy * path[1] + model.height + b[2]
    velocity[0], velocity[1] = c * vx - s * vy, s * vx + c * vy
    velocity[2] = sx * px + sy * py + gd[0] + gd[1] * path[0] + gd[2] * path[1] + bd[2]
    state.body_acceleration[0] = c * ax - s * ay
    state.body_acceleration[1] = s * ax + c * ay
    state.body_acceleration[2] = (sx * (c * qx - s * qy) + sy * (s * qx + c * qy) + bdd[2]) + (
        gdd[0] + gdd[1] * path[0] + gdd[2] * path[1] + 2 * (gd[1] * px + gd[2] * py)
    )
    roll, pitch, yaw = b[3], b[4], b[5] + path[2]
    rotation(roll, pitch, yaw, state.R_odom_body)
    # Angular velocity of fixed-axes angles, and its derivative.
    r1, p1, y1 = bd[3], bd[4], bd[5] + w
    r2, p2, y2 = bdd[3], bdd[4], bdd[5] + wd
    cy, sy2, cp, sp = math.cos(yaw), math.sin(yaw), math.cos(pitch), math.sin(pitch)
    w_body, dw_body = state.angular_velocity, state.angular_acceleration
    w_body[0] = cy * cp * r1 - sy2 * p1
    w_body[1] = sy2 * cp * r1 + cy * p1
    w_body[2] = y1 - sp * r1
    dw_body[0] = cy * cp * r2 - sy2 * p2 - (sy2 * cp * y1 + cy * sp * p1) * r1 - cy * y1 * p1
    dw_body[1] = sy2 * cp * r2 + cy * p2 + (cy * cp * y1 - sy2 * sp * p1) * r1 - sy2 * y1 * p1
    dw_body[2] = y2 - sp * r2 - cp * p1 * r1
