"""Frames: Denavit-Hartenberg chains of the legs, body poses and quaternions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.robot import Leg, Robot


class LinkFrames(NamedTuple):
    """Poses of the links' frames in the body frame: coxa, femur and tibia of each leg.

    Attributes:
        rotation: ``R_body_link``, shape (..., L, 3, 3, 3).
        position: Origins, on the joints' axes [m], shape (..., L, 3, 3).
    """

    rotation: Float[np.ndarray, "*batch legs 3 3 3"]
    position: Float[np.ndarray, "*batch legs 3 3"]


def dh_transform(
    alpha: Float[np.ndarray, "*batch"],
    a: Float[np.ndarray, "*batch"],
    d: Float[np.ndarray, "*batch"],
    theta: Float[np.ndarray, "*batch"],
) -> Float[np.ndarray, "*batch 4 4"]:
    """Transform between neighbouring frames in modified Denavit-Hartenberg form (Craig).

    Args:
        alpha: Angle between the joint axes, about the previous x [rad].
        a: Distance between the joint axes, along the previous x [m].
        d: Offset along the joint axis [m].
        theta: Joint angle [rad].

    Returns:
        ``X_previous_next``, shape (..., 4, 4).

    Source: Eq. 1 with its entry (1,4) corrected to a.
    """
    alpha, a, d, theta = np.broadcast_arrays(*map(np.asarray, (alpha, a, d, theta)))
    ca, sa, ct, st = np.cos(alpha), np.sin(alpha), np.cos(theta), np.sin(theta)
    zero, one = np.zeros(ct.shape), np.ones(ct.shape)
    rows = [
        [ct, -st, zero, a],
        [st * ca, ct * ca, -sa, -sa * d],
        [st * sa, ct * sa, ca, ca * d],
        [zero, zero, zero, one],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def leg_frames(leg: Leg, q: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 4 4 4"]:
    """Poses of the frames 1 to 4 of a leg in its hip frame: coxa, femur, tibia, foot.

    Args:
        leg: The leg.
        q: Joint angles [rad], shape (..., 3).

    Returns:
        ``X_hip_coxa``, ``X_hip_femur``, ``X_hip_tibia`` and ``X_hip_foot``,
        shape (..., 4, 4, 4), the frames along the third axis from the end.

    Source: Table 1, Eq. 2 with its row 3 corrected.
    """
    q = np.asarray(q, dtype=float)
    coxa, femur, tibia, right = (np.full(q.shape[:-1], v) for v in (*leg.lengths, np.pi / 2))
    zero = np.zeros(q.shape[:-1])
    q1, q2, q3 = (np.asarray(q[..., k]) for k in range(3))
    X_hip_coxa = dh_transform(zero, zero, zero, q1)
    X_coxa_femur = dh_transform(right, coxa, zero, q2)
    X_femur_tibia = dh_transform(zero, femur, zero, q3)
    X_tibia_foot = dh_transform(zero, tibia, zero, zero)
    X_hip_femur = X_hip_coxa @ X_coxa_femur
    X_hip_tibia = X_hip_femur @ X_femur_tibia
    return np.stack([X_hip_coxa, X_hip_femur, X_hip_tibia, X_hip_tibia @ X_tibia_foot], axis=-3)


def rotation_rpy(
    roll: Float[np.ndarray, "*batch"],
    pitch: Float[np.ndarray, "*batch"],
    yaw: Float[np.ndarray, "*batch"],
) -> Float[np.ndarray, "*batch 3 3"]:
    """Rotation of the body: roll about x, then pitch about y, then yaw about z, fixed axes.

    Source: T_B^G, corrected, with x forward (the paper's forward axis is y).
    """
    roll, pitch, yaw = np.broadcast_arrays(*map(np.asarray, (roll, pitch, yaw)))
    cr, sr, cp, sp = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
    cy, sy = np.cos(yaw), np.sin(yaw)
    rows = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_rotation(
    quaternion: Float[np.ndarray, "*batch 4"],
) -> Float[np.ndarray, "*batch 3 3"]:
    """Rotation matrix of a unit quaternion (w, x, y, z)."""
    w, x, y, z = np.moveaxis(np.asarray(quaternion, dtype=float), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def yaw_quaternion(yaw: Float[np.ndarray, "*batch"]) -> Float[np.ndarray, "*batch 4"]:
    """Quaternion (w, x, y, z) of a turn about the vertical [rad]."""
    half = np.asarray(yaw, dtype=float) / 2
    zero = np.zeros(half.shape)
    return np.stack([np.cos(half), zero, zero, np.sin(half)], axis=-1)


def quaternion_yaw(quaternion: Float[np.ndarray, "*batch 4"]) -> Float[np.ndarray, "*batch"]:
    """Heading of a body pose: the angle of its x axis about the vertical [rad]."""
    w, x, y, z = np.moveaxis(np.asarray(quaternion, dtype=float), -1, 0)
    return np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def body_from_hip(
    robot: Robot, p_hip: Float[np.ndarray, "*batch legs 3"]
) -> Float[np.ndarray, "*batch legs 3"]:
    """One point per leg from the hip frames to the body frame [m], shape (..., L, 3)."""
    arrays = robot.arrays
    return np.einsum("lij,...lj->...li", arrays.R_body_hip, p_hip) + arrays.p_body_hip


def hip_from_body(
    robot: Robot, p_body: Float[np.ndarray, "*batch legs 3"]
) -> Float[np.ndarray, "*batch legs 3"]:
    """One point per leg from the body frame to the hip frames [m], shape (..., L, 3)."""
    arrays = robot.arrays
    return np.einsum("lji,...lj->...li", arrays.R_body_hip, p_body - arrays.p_body_hip)


def neutral_feet(robot: Robot) -> Float[np.ndarray, "legs 3"]:
    """Where the feet stand at rest, in the body frame [m], shape (L, 3)."""
    return body_from_hip(robot, robot.arrays.neutral_foot)


def link_frames(robot: Robot, q: Float[np.ndarray, "*batch legs 3"]) -> LinkFrames:
    """Frames of all links of all legs, those of Table 1, seen from the body.

    Args:
        robot: The robot, L legs.
        q: Joint angles [rad], shape (..., L, 3).
    """
    arrays, q = robot.arrays, np.asarray(q, dtype=float)
    q1, q2, q3 = np.moveaxis(q, -1, 0)
    coxa, femur, _ = arrays.lengths.T
    zero, one = np.zeros(q1.shape), np.ones(q1.shape)
    c1, s1 = np.cos(q1), np.sin(q1)
    axes = [[[c1, -s1, zero], [s1, c1, zero], [zero, zero, one]]]
    for elevation in (q2, q2 + q3):
        c, s = np.cos(elevation), np.sin(elevation)
        # The frames 2 and 3 have their z to the leg's right.
        axes.append([[c1 * c, -c1 * s, s1], [s1 * c, -s1 * s, -c1], [s, c, zero]])
    rotation = np.moveaxis(np.array(axes), (0, 1, 2), (-3, -2, -1))
    out = coxa + femur * np.cos(q2)
    starts = [[zero, zero, zero], [coxa * c1, coxa * s1, zero]]
    starts.append([out * c1, out * s1, femur * np.sin(q2)])
    position = np.moveaxis(np.array(starts), (0, 1), (-2, -1))
    R = arrays.R_body_hip[:, None]
    p = (R @ position[..., None])[..., 0] + arrays.p_body_hip[:, None]
    return LinkFrames(R @ rotation, p)


def centre_of_mass(
    robot: Robot, q: Float[np.ndarray, "*batch legs 3"]
) -> Float[np.ndarray, "*batch 3"]:
    """Centre of mass of the whole robot in the body frame [m], shape (..., 3).

    Args:
        robot: The robot, L legs.
        q: Joint angles [rad], shape (..., L, 3).
    """
    arrays, frames = robot.arrays, link_frames(robot, q)
    links = frames.position + (frames.rotation @ arrays.com[..., None])[..., 0]
    moment = robot.body.mass * robot.body.com + np.einsum("lk,...lki->...i", arrays.mass, links)
    return np.asarray(moment / robot.mass)


def step_pose(
    step: Float[np.ndarray, "3"], steps: Float[np.ndarray, "*batch"]
) -> Float[np.ndarray, "*batch 3"]:
    """Pose on the plane after a number of equal steps, whole or not, along one arc.

    Args:
        step: Displacement of one step in the frame before it: forward [m], left [m], turn [rad].
        steps: How many steps, shape (...).

    Returns:
        x [m], y [m] and heading [rad] in the frame of the start, shape (..., 3).
    """
    heading = step[2] * np.asarray(steps, dtype=float)
    twist = step_twist(step)
    # sin(h)/w and (1 - cos h)/w, which tend to the number of steps and to zero.
    along = np.asarray(steps) * np.sinc(heading / np.pi)
    across = np.asarray(steps) * np.sinc(heading / (2 * np.pi)) * np.sin(heading / 2)
    x = along * twist[0] - across * twist[1]
    y = across * twist[0] + along * twist[1]
    return np.stack([x, y, heading], axis=-1)


def step_twist(step: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    """Constant velocity in body axes that makes one step in unit time.

    Args:
        step: Displacement of one step in the frame before it: forward [m], left [m], turn [rad].

    Returns:
        Forward [m], left [m] and turn [rad] per step, shape (3,).
    """
    along = np.sinc(step[2] / np.pi)
    across = np.sinc(step[2] / (2 * np.pi)) * np.sin(step[2] / 2)
    forward, left = np.linalg.solve([[along, -across], [across, along]], step[:2])
    return np.array([forward, left, step[2]])
