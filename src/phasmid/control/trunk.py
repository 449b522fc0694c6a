"""The body's motion: a path on the ground, and the body's pose beside it, without corners."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import internal
from phasmid.control.body_kernels import rotation
from phasmid.control.types import Model, Parameters, State


@internal
def follow(stages: np.ndarray, omega: float, h: float) -> None:
    """Let a chain of equal first-order lags follow its first stage, which stays.

    Each lag's step response rises without overshoot, so that the last stage is at every time a
    mean of what the first one has been: it never leaves what that has kept to, and of n lags the
    n - 1 first derivatives have no jumps. Exact for any step.

    Args:
        stages: The reference and the lags' outputs, shape (1 + n, k).
        omega: The lags' bandwidth [1/s].
        h: Step of time [s].
    """
    x = omega * h
    decay = math.exp(-x)
    count = len(stages) - 1
    for k in range(stages.shape[1]):
        r = stages[0, k]
        for n in range(count, 0, -1):
            # y_n - r gets the earlier stages' shares x^m / m!.
            total, term = 0.0, 1.0
            for m in range(n):
                total += term * (stages[n - m, k] - r)
                term *= x / (m + 1)
            stages[n, k] = r + decay * total


@internal
def approach(
    reference: np.ndarray, target: np.ndarray, first: int, scale: float, most: float
) -> None:
    """Move three numbers of a reference straight towards a target, by no more than a length.

    Args:
        reference: Changed, shape (k,).
        target: Where to, shape (k,).
        first: Index of the first of the three.
        scale: What the third of them is multiplied with for that length.
        most: That length.
    """
    dx = target[first] - reference[first]
    dy = target[first + 1] - reference[first + 1]
    dz = (target[first + 2] - reference[first + 2]) * scale
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    share = 1.0 if length <= most else most / length
    for i in range(3):
        gap = target[first + i] - reference[first + i]
        reference[first + i] = (
            target[first + i] if share == 1.0 else reference[first + i] + share * gap
        )


@internal
def integrate_twist(path: np.ndarray, twist: np.ndarray, time: float, out: np.ndarray) -> None:
    """Write the place after a constant velocity in the path's own axes: an arc or a line.

    Args:
        path: Place and heading, shape (3,).
        twist: Ahead, left and turn, shape (3,).
        time: For how long [s].
        out: Written; may be the path itself, shape (3,).
    """
    turn = twist[2] * time
    if abs(turn) < 1e-4:
        along, across = 1.0 - turn * turn / 6, turn / 2
    else:
        along, across = math.sin(turn) / turn, (1.0 - math.cos(turn)) / turn
    dx = (along * twist[0] - across * twist[1]) * time
    dy = (across * twist[0] + along * twist[1]) * time
    c, s = math.cos(path[2]), math.sin(path[2])
    out[0], out[1], out[2] = path[0] + c * dx - s * dy, path[1] + s * dx + c * dy, path[2] + turn


@internal
def set_body_motion(state: State, model: Model, parameters: Parameters) -> None:
    """Write the body's rotation, place, velocities and accelerations in odom from the filters."""
    path, speed, pose, sway = (
        state.path,
        state.velocity_filter,
        state.pose_filter,
        state.sway_filter,
    )
    c, s = math.cos(path[2]), math.sin(path[2])
    w1, w3, w2 = parameters.velocity_bandwidth, parameters.pose_bandwidth, parameters.sway_bandwidth
    v, a = speed[2], np.empty(3)
    for i in range(3):
        a[i] = w1 * (speed[1, i] - speed[2, i])
    # The body beside the path, in the path's axes.
    b, bd, bdd = np.empty(6), np.empty(6), np.empty(6)
    for i in range(6):
        b[i] = pose[3, i]
        bd[i] = w3 * (pose[2, i] - pose[3, i])
        bdd[i] = w3 * w3 * (pose[1, i] - 2 * pose[2, i] + pose[3, i])
    for i in range(2):
        b[i] += sway[3, i]
        bd[i] += w2 * (sway[2, i] - sway[3, i])
        bdd[i] += w2 * w2 * (sway[1, i] - 2 * sway[2, i] + sway[3, i])
    w, wd = v[2], a[2]
    # d/dt of R(yaw) b is R (b' + w J b), with J a quarter turn to the left.
    vx, vy = v[0] + bd[0] - w * b[1], v[1] + bd[1] + w * b[0]
    ax = a[0] - w * v[1] + bdd[0] - 2 * w * bd[1] - wd * b[1] - w * w * b[0]
    ay = a[1] + w * v[0] + bdd[1] + 2 * w * bd[0] + wd * b[0] - w * w * b[1]
    ground, position, velocity = state.ground_filter, state.body_position, state.body_velocity
    acceleration, w_body, dw_body = (
        state.body_acceleration,
        state.angular_velocity,
        state.angular_acceleration,
    )
    position[0] = path[0] + c * b[0] - s * b[1]
    position[1] = path[1] + s * b[0] + c * b[1]
    # The path rises with the plane under it.
    g, gd, gdd = np.empty(3), np.empty(3), np.empty(3)
    for i in range(3):
        g[i] = ground[3, i]
        gd[i] = w3 * (ground[2, i] - ground[3, i])
        gdd[i] = w3 * w3 * (ground[1, i] - 2 * ground[2, i] + ground[3, i])
    sx, sy = g[1], g[2]
    px, py = c * v[0] - s * v[1], s * v[0] + c * v[1]
    qx, qy = a[0] - w * v[1], a[1] + w * v[0]
    position[2] = g[0] + sx * path[0] + sy * path[1] + model.height + b[2]
    velocity[0], velocity[1] = c * vx - s * vy, s * vx + c * vy
    velocity[2] = sx * px + sy * py + gd[0] + gd[1] * path[0] + gd[2] * path[1] + bd[2]
    acceleration[0], acceleration[1] = c * ax - s * ay, s * ax + c * ay
    acceleration[2] = sx * (c * qx - s * qy) + sy * (s * qx + c * qy) + bdd[2]
    acceleration[2] += gdd[0] + gdd[1] * path[0] + gdd[2] * path[1] + 2 * (gd[1] * px + gd[2] * py)
    roll, pitch, yaw = b[3], b[4], b[5] + path[2]
    rotation(roll, pitch, yaw, state.R_odom_body)
    # Angular velocity of fixed-axes angles, and its derivative.
    r1, p1, y1 = bd[3], bd[4], bd[5] + w
    r2, p2, y2 = bdd[3], bdd[4], bdd[5] + wd
    cy, sy2, cp, sp = math.cos(yaw), math.sin(yaw), math.cos(pitch), math.sin(pitch)
    w_body[0] = cy * cp * r1 - sy2 * p1
    w_body[1] = sy2 * cp * r1 + cy * p1
    w_body[2] = y1 - sp * r1
    dw_body[0] = cy * cp * r2 - sy2 * p2 - (sy2 * cp * y1 + cy * sp * p1) * r1 - cy * y1 * p1
    dw_body[1] = sy2 * cp * r2 + cy * p2 + (cy * cp * y1 - sy2 * sp * p1) * r1 - sy2 * y1 * p1
    dw_body[2] = y2 - sp * r2 - cp * p1 * r1
