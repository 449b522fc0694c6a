"""Motion of the body: its path on the ground, its pose relative to that, and the gait's sway."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled
from phasmid.control.types import LegPhase, Model, Reference, State
from phasmid.control.vectors import Path, in_odom, rotate, rotation
from phasmid.kinematics.vector_kernels import turned

VELOCITY_BANDWIDTH, POSE_BANDWIDTH, SWAY_BANDWIDTH = 20.0, 15.0, 15.0
"""Bandwidths of the filters of velocity, pose and ground, and sway [1/s]."""


@compiled
def ground_height(state: State, x: float, y: float) -> float:
    """Return the height of the estimated ground plane at a point of odom [m]."""
    g = state.ground_filter[3]
    return float(g[0] + g[1] * x + g[2] * y)


@compiled
def com_in_odom(state: State) -> tuple[float, float]:
    """Return the centre of mass in odom, from above [m]."""
    com = rotate(state.R_odom_body, state.com)
    return com[0] + state.body_position[0], com[1] + state.body_position[1]


@compiled
def bears_load(state: State, reference: Reference, leg: int) -> bool:
    """Return whether a foot stands on which the robot may rely.

    A robot that walks does not rely on lost legs; one that only stands relies on needed ones.
    """
    relied = reference.used[leg] == 1 or (reference.walks == 0 and state.needed[leg] == 1)
    return bool(state.leg_phase[leg] == LegPhase.STANCE and relied)


@compiled
def standing_feet(state: State, reference: Reference) -> np.ndarray:
    """Return which feet bear load, shape (L,)."""
    stance = np.zeros(state.leg_count, dtype=np.bool_)
    for leg in range(state.leg_count):
        stance[leg] = bears_load(state, reference, leg)
    return stance


@compiled
def leg_moment(model: Model, leg: int, q: np.ndarray) -> np.ndarray:
    """Return a leg's first moment of mass about the body's origin, body axes [kg·m], shape (3,)."""
    lengths, com, mass = model.lengths[leg], model.link_com[leg], model.link_mass[leg]
    c2, s2 = math.cos(q[1]), math.sin(q[1])
    c3, s3 = math.cos(q[1] + q[2]), math.sin(q[1] + q[2])
    # Outwards, to the side and up in the leg's plane.
    out = mass[0] * com[0, 0] + mass[1] * (lengths[0] + com[1, 0] * c2 - com[1, 1] * s2)
    out += mass[2] * (lengths[0] + lengths[1] * c2 + com[2, 0] * c3 - com[2, 1] * s3)
    side = mass[0] * com[0, 1] - mass[1] * com[1, 2] - mass[2] * com[2, 2]
    up = mass[0] * com[0, 2] + mass[1] * (com[1, 0] * s2 + com[1, 1] * c2)
    up += mass[2] * (lengths[1] * s2 + com[2, 0] * s3 + com[2, 1] * c3)
    x, y = turned(q[0], out, side)
    return mass.sum() * model.p_body_hip[leg] + rotate(model.R_body_hip[leg], np.array((x, y, up)))


@compiled
def follow(stages: np.ndarray, omega: float, h: float) -> None:
    """Advance a chain of n equal first-order lags, exactly, while its input stays constant.

    Rows of `stages` are the input and the lags' outputs, `omega` is their bandwidth [1/s]. The last
    output is a weighted mean of past inputs, so it never leaves their range. Its first n - 1
    derivatives are continuous.
    """
    x = omega * h
    decay = math.exp(-x)
    for k in range(stages.shape[1]):
        r = stages[0, k]
        for n in range(len(stages) - 1, 0, -1):
            # y_n - r receives the earlier stages' shares x^m / m!.
            total, term = 0.0, 1.0
            for m in range(n):
                total += term * (stages[n - m, k] - r)
                term *= x / (m + 1)
            stages[n, k] = r + decay * total


@compiled
def lag_motion(stages: np.ndarray, omega: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the last output of a chain of lags, and its first two derivatives."""
    earlier, before, y = stages[-3], stages[-2], stages[-1]
    return y.copy(), omega * (before - y), omega * omega * (earlier - 2 * before + y)


@compiled
def speed_of(velocity: np.ndarray, radius: float) -> float:
    """Return the size of a velocity vx, vy, wz whose yaw rate counts at a radius [m/s]."""
    return math.sqrt(velocity[0] ** 2 + velocity[1] ** 2 + (radius * velocity[2]) ** 2)


@compiled
def approach(reference: np.ndarray, target: np.ndarray, radius: float, most: float) -> None:
    """Move three numbers straight towards a target, by `most` at most as by `speed_of`."""
    gap = target - reference
    length = speed_of(gap, radius)
    if length <= most:
        reference[:] = target
    else:
        reference += most / length * gap


@compiled
def sway_wave(model: Model, reference: Reference, phase: float) -> np.ndarray:
    """Return the gait's sway and its derivative by phase: see `phasmid.gait.sway`.

    Each is a displacement forward and left [m]; the shape is (2, 2).
    """
    wave = np.zeros((2, 2))
    if reference.sway == 0.0:
        return wave
    centre, rate = np.zeros(2), 2 * math.pi
    for leg in range(model.leg_count):
        if reference.used[leg]:
            centre += model.neutral[leg, :2]
    centre /= max(reference.used[: model.leg_count].sum(), 1)
    for leg in range(model.leg_count):
        if reference.used[leg]:
            arm = reference.sway * (centre - model.neutral[leg, :2])
            angle = rate * (phase - reference.lift_phase[leg] - (1 - reference.duty_factor) / 2)
            wave[0] += math.cos(angle) * arm
            wave[1] -= rate * math.sin(angle) * arm
    return wave


@compiled
def place_body(
    state: State, model: Model, path: Path, pose: np.ndarray, x: float, y: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return rotation and place of a body with a pose relative to a path, and (x, y) beside it."""
    px, py = in_odom(path, x + pose[0], y + pose[1])
    pz = ground_height(state, path[0], path[1]) + model.height + pose[2]
    return rotation(pose[3], pose[4], pose[5] + path[2]), np.array((px, py, pz))


@compiled
def set_body_motion(state: State, model: Model) -> None:
    """Write the body's rotation, place, velocities and accelerations in odom from the filters."""
    path, v = state.path, state.velocity_filter[2]
    _, a, _ = lag_motion(state.velocity_filter, VELOCITY_BANDWIDTH)
    # Pose relative to the path, in the path's axes; the ground's height and slopes.
    b, bd, bdd = lag_motion(state.pose_filter, POSE_BANDWIDTH)
    g, gd, gdd = lag_motion(state.ground_filter, POSE_BANDWIDTH)
    sway, sway_rate, sway_acceleration = lag_motion(state.sway_filter, SWAY_BANDWIDTH)
    b[:2] += sway
    bd[:2] += sway_rate
    bdd[:2] += sway_acceleration
    w, wd = v[2], a[2]
    position, velocity = state.body_position, state.body_velocity
    acceleration = state.body_acceleration
    # d/dt of R(yaw) b is R (b' + w J b), with J a quarter turn to the left.
    position[0], position[1] = in_odom(path, b[0], b[1])
    velocity[0], velocity[1] = turned(path[2], v[0] + bd[0] - w * b[1], v[1] + bd[1] + w * b[0])
    acceleration[0], acceleration[1] = turned(
        path[2],
        a[0] - w * v[1] + bdd[0] - 2 * w * bd[1] - wd * b[1] - w * w * b[0],
        a[1] + w * v[0] + bdd[1] + 2 * w * bd[0] + wd * b[0] - w * w * b[1],
    )
    # The path rises with the plane under it.
    px, py = turned(path[2], v[0], v[1])
    qx, qy = turned(path[2], a[0] - w * v[1], a[1] + w * v[0])
    position[2] = g[0] + g[1] * path[0] + g[2] * path[1] + model.height + b[2]
    velocity[2] = g[1] * px + g[2] * py + gd[0] + gd[1] * path[0] + gd[2] * path[1] + bd[2]
    acceleration[2] = (g[1] * qx + g[2] * qy + bdd[2]) + (
        gdd[0] + gdd[1] * path[0] + gdd[2] * path[1] + 2 * (gd[1] * px + gd[2] * py)
    )
    pitch, yaw = b[4], b[5] + path[2]
    state.R_odom_body[:] = rotation(b[3], pitch, yaw)
    # Angular velocity of fixed-axes angles, and its derivative.
    r1, p1, y1 = bd[3], bd[4], bd[5] + w
    r2, p2, y2 = bdd[3], bdd[4], bdd[5] + wd
    cy, sy, cp, sp = math.cos(yaw), math.sin(yaw), math.cos(pitch), math.sin(pitch)
    w_body, dw_body = state.angular_velocity, state.angular_acceleration
    w_body[0] = cy * cp * r1 - sy * p1
    w_body[1] = sy * cp * r1 + cy * p1
    w_body[2] = y1 - sp * r1
    dw_body[0] = cy * cp * r2 - sy * p2 - (sy * cp * y1 + cy * sp * p1) * r1 - cy * y1 * p1
    dw_body[1] = sy * cp * r2 + cy * p2 + (cy * cp * y1 - sy * sp * p1) * r1 - sy * y1 * p1
    dw_body[2] = y2 - sp * r2 - cp * p1 * r1
