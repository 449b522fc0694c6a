"""Frames: Denavit-Hartenberg chains of the legs, body poses and quaternions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.arguments import explained
from phasmid.kinematics.shared_kernels import quaternion_rows, rpy_rows
from phasmid.robot import Leg, LegArrays, Robot

Samples = np.ndarray | np.float64
"""One number per sample; NumPy makes a scalar of a single one."""


def matrix(*rows: Sequence[Samples | float]) -> np.ndarray:
    """Return one matrix per sample from rows of entries that broadcast, shape (..., R, C)."""
    entries = np.broadcast_arrays(*[entry for row in rows for entry in row])
    return np.stack(entries, axis=-1).reshape(*entries[0].shape, len(rows), len(rows[0]))


def dh_transform(
    alpha: Samples, a: Samples, d: Samples, theta: Samples
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
    ca, sa, ct, st = np.cos(alpha), np.sin(alpha), np.cos(theta), np.sin(theta)
    return matrix(
        [ct, -st, 0.0, a],
        [st * ca, ct * ca, -sa, -sa * d],
        [st * sa, ct * sa, ca, ca * d],
        [0.0, 0.0, 0.0, 1.0],
    )


@explained
def leg_frames(
    leg: Leg | LegArrays, q: Float[np.ndarray, "*batch 3"]
) -> Float[np.ndarray, "*batch 4 4 4"]:
    """Poses of the frames 1 to 4 of a leg in its hip frame: coxa, femur, tibia, foot.

    Args:
        leg: The leg, or a robot's ``arrays`` for all legs along the axis before the last.
        q: Joint angles [rad], shape (..., 3).

    Returns:
        ``X_hip_coxa``, ``X_hip_femur``, ``X_hip_tibia`` and ``X_hip_foot``,
        shape (..., 4, 4, 4), the frames along the third axis from the end.

    Source: Table 1, Eq. 2 with its row 3 corrected.
    """
    q1, q2, q3 = np.moveaxis(q, -1, 0)
    zero, right = np.float64(0.0), np.float64(np.pi / 2)
    coxa, femur, tibia = np.moveaxis(leg.lengths, -1, 0)
    # Offsets count along the joints' axes, which are to the leg's right.
    to_femur, to_tibia, to_foot = -np.moveaxis(leg.lateral_offsets, -1, 0)
    X_hip_coxa = dh_transform(zero, zero, zero, q1)
    X_hip_femur = X_hip_coxa @ dh_transform(right, coxa, to_femur, q2)
    X_hip_tibia = X_hip_femur @ dh_transform(zero, femur, to_tibia, q3)
    X_hip_foot = X_hip_tibia @ dh_transform(zero, tibia, to_foot, zero)
    return np.stack([X_hip_coxa, X_hip_femur, X_hip_tibia, X_hip_foot], axis=-3)


class LinkFrames(NamedTuple):
    """Poses of the links' frames in the body frame: coxa, femur and tibia of each leg.

    Attributes:
        rotation: ``R_body_link``, shape (..., L, 3, 3, 3).
        position: Origins, on the joints' axes [m], shape (..., L, 3, 3).
    """

    rotation: Float[np.ndarray, "*batch legs 3 3 3"]
    position: Float[np.ndarray, "*batch legs 3 3"]


@explained
def link_frames(robot: Robot, q: Float[np.ndarray, "*batch legs 3"]) -> LinkFrames:
    """Frames of all links in the body frame, axes as in Table 1.

    Args:
        robot: The robot, L legs.
        q: Joint angles [rad], shape (..., L, 3).
    """
    X, R = leg_frames(robot.arrays, q)[..., :3, :, :], robot.arrays.R_body_hip[:, None]
    p_body_link = (R @ X[..., :3, 3:])[..., 0] + robot.arrays.p_body_hip[:, None]
    return LinkFrames(R @ X[..., :3, :3], p_body_link)


def rotated(
    R: Float[np.ndarray, "*#batch 3 3"], v: Float[np.ndarray, "*#batch 3"]
) -> Float[np.ndarray, "*batch 3"]:
    """Return R v, summed in one order for all shapes: single samples give the same bits."""
    rows = [R[..., i, 0] * v[..., 0] + R[..., i, 1] * v[..., 1] for i in range(3)]
    return np.stack([row + R[..., i, 2] * v[..., 2] for i, row in enumerate(rows)], axis=-1)


@explained
def rotation_rpy(
    roll: Float[np.ndarray, "*batch"],
    pitch: Float[np.ndarray, "*batch"],
    yaw: Float[np.ndarray, "*batch"],
) -> Float[np.ndarray, "*batch 3 3"]:
    """Rotation of the body: roll about x, then pitch about y, then yaw about z, fixed axes.

    Args:
        roll: Angle about the forward axis x [rad].
        pitch: Angle about the axis y, to the left [rad].
        yaw: Angle about the vertical [rad].

    Returns:
        ``R_world_body``, shape (..., 3, 3).

    Source: T_B^G, corrected, with x forward (the paper's forward axis is y).
    """
    return matrix(*rpy_rows(roll, pitch, yaw))


@explained
def quaternion_rotation(
    quaternion: Float[np.ndarray, "*batch 4"],
) -> Float[np.ndarray, "*batch 3 3"]:
    """Rotation matrix of a unit quaternion (w, x, y, z)."""
    return matrix(*quaternion_rows(*np.moveaxis(quaternion, -1, 0)))


@explained
def rpy_quaternion(
    roll: Float[np.ndarray, "*batch"],
    pitch: Float[np.ndarray, "*batch"],
    yaw: Float[np.ndarray, "*batch"],
) -> Float[np.ndarray, "*batch 4"]:
    """Quaternion (w, x, y, z) of the rotation that `rotation_rpy` makes of these angles [rad]."""
    halves = np.divide(np.broadcast_arrays(roll, pitch, yaw), 2)
    (cr, cp, cy), (sr, sp, sy) = (tuple(f(half) for half in halves) for f in (np.cos, np.sin))
    return np.stack(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ],
        axis=-1,
    )


@explained
def yaw_quaternion(yaw: Float[np.ndarray, "*batch"]) -> Float[np.ndarray, "*batch 4"]:
    """Quaternion (w, x, y, z) of a rotation about the vertical [rad]."""
    return rpy_quaternion(np.zeros_like(yaw), np.zeros_like(yaw), yaw)


def angular_motion(
    attitude: Float[np.ndarray, "*batch 3"],
    rate: Float[np.ndarray, "*batch 3"],
    acceleration: Float[np.ndarray, "*batch 3"],
) -> tuple[Float[np.ndarray, "*batch 3"], Float[np.ndarray, "*batch 3"]]:
    """Angular velocity and acceleration of a body whose roll, pitch and yaw change.

    Args:
        attitude: Roll, pitch and yaw as in `rotation_rpy` [rad], shape (..., 3).
        rate: Their first derivatives by time [rad/s], shape (..., 3).
        acceleration: Their second derivatives [rad/s²], shape (..., 3).

    Returns:
        Angular velocity [rad/s] and acceleration [rad/s²] in world axes, each of shape (..., 3).
    """
    _, p, y = np.moveaxis(attitude, -1, 0)
    (dr, dp, dy), (ddr, ddp, ddy) = (np.moveaxis(v, -1, 0) for v in (rate, acceleration))
    cp, sp, cy, sy = np.cos(p), np.sin(p), np.cos(y), np.sin(y)
    # Roll turns about the body's own x, pitch about the heading's left, yaw about the vertical.
    w = [cy * cp * dr - sy * dp, sy * cp * dr + cy * dp, dy - sp * dr]
    dw = [
        cy * cp * ddr - sy * ddp - (sy * cp * dy + cy * sp * dp) * dr - cy * dy * dp,
        sy * cp * ddr + cy * ddp + (cy * cp * dy - sy * sp * dp) * dr - sy * dy * dp,
        ddy - sp * ddr - cp * dp * dr,
    ]
    return np.stack(w, axis=-1), np.stack(dw, axis=-1)


@explained
def quaternion_yaw(quaternion: Float[np.ndarray, "*batch 4"]) -> Float[np.ndarray, "*batch"]:
    """Heading of a body pose: the angle of its x axis about the vertical [rad]."""
    w, x, y, z = np.moveaxis(quaternion, -1, 0)
    return np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


@explained
def body_from_hip(
    robot: Robot, p_hip: Float[np.ndarray, "*batch legs 3"]
) -> Float[np.ndarray, "*batch legs 3"]:
    """Transform one point per leg from hip frames to the body frame [m], shape (..., L, 3)."""
    arrays = robot.arrays
    return np.einsum("lij,...lj->...li", arrays.R_body_hip, p_hip) + arrays.p_body_hip


@explained
def hip_from_body(
    robot: Robot, p_body: Float[np.ndarray, "*batch legs 3"]
) -> Float[np.ndarray, "*batch legs 3"]:
    """Transform one point per leg from the body frame to hip frames [m], shape (..., L, 3)."""
    arrays = robot.arrays
    return np.einsum("lji,...lj->...li", arrays.R_body_hip, p_body - arrays.p_body_hip)


@explained
def neutral_feet(robot: Robot) -> Float[np.ndarray, "legs 3"]:
    """Neutral feet in the body frame [m], shape (L, 3)."""
    return body_from_hip(robot, robot.arrays.neutral_foot)


@explained
def posture_feet(robot: Robot, pose: Float[np.ndarray, "6"]) -> Float[np.ndarray, "legs 3"]:
    """Neutral feet, which stay in place, in the hip frames of a displaced body [m], shape (L, 3).

    Args:
        robot: The robot, L legs.
        pose: Displacement of the body from its neutral pose: forward, left, up [m], roll, pitch,
            yaw [rad], shape (6,).
    """
    return hip_from_body(robot, (neutral_feet(robot) - pose[:3]) @ rotation_rpy(*pose[3:, None])[0])


@explained
def body_height(robot: Robot) -> float:
    """Return the height of the body's origin over level ground at the neutral stance [m].

    It is that over the mean foot, and the radius of the feet.
    """
    return robot.foot_radius - float(neutral_feet(robot)[:, 2].mean())


@explained
def trunk_clearance(robot: Robot, height: float, pose: Float[np.ndarray, "6"]) -> float:
    """Return the height of the trunk's lowest corner over the ground [m].

    Args:
        robot: Its trunk is a box.
        height: Height of the body's origin over the ground in its neutral pose [m].
        pose: Pose relative to the path and the neutral height [m, rad], shape (6,).
    """
    roll, pitch = pose[3], pose[4]
    up = np.array((-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)))
    centre = height + pose[2] + up @ robot.body.box_centre
    # Extents of the box along the vertical.
    return float(centre - abs(up) @ robot.body.size / 2)


@explained
def centre_of_mass(
    robot: Robot, q: Float[np.ndarray, "*batch legs 3"]
) -> Float[np.ndarray, "*batch 3"]:
    """Centre of mass of the whole robot in the body frame [m], shape (..., 3).

    Args:
        robot: The robot, L legs.
        q: Joint angles [rad], shape (..., L, 3).
    """
    frames = link_frames(robot, q)
    arrays = robot.arrays
    links = frames.position + (frames.rotation @ arrays.com[..., None])[..., 0]
    moment = robot.body.mass * robot.body.com + np.einsum("lk,...lki->...i", arrays.mass, links)
    return np.asarray(moment / robot.mass)


def step_pose(
    step: Float[np.ndarray, "3"], steps: Float[np.ndarray, "*batch"]
) -> Float[np.ndarray, "*batch 3"]:
    """Pose on the plane after a number of equal steps along one arc.

    Args:
        step: Displacement of one step in the frame before it: forward [m], left [m], yaw [rad].
        steps: Number of steps, whole or not, shape (...).

    Returns:
        x [m], y [m] and heading [rad] in the frame of the start, shape (..., 3).
    """
    counts, twist = np.asarray(steps), step_twist(step)
    heading = twist[2] * counts
    # sin(h)/w and (1 - cos h)/w, which tend to the number of steps and to zero.
    along = counts * np.sinc(heading / np.pi)
    across = counts * np.sinc(heading / (2 * np.pi)) * np.sin(heading / 2)
    x = along * twist[0] - across * twist[1]
    y = across * twist[0] + along * twist[1]
    return np.stack([x, y, heading], axis=-1)


def step_twist(step: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    """Constant velocity in body axes that makes one step in unit time.

    Args:
        step: Displacement of one step in the frame before it: forward [m], left [m], yaw [rad].

    Returns:
        Forward [m], left [m] and yaw [rad] per step, shape (3,).
    """
    x, y, yaw = step
    along = np.sinc(yaw / np.pi)
    across = np.sinc(yaw / (2 * np.pi)) * np.sin(yaw / 2)
    forward, left = np.linalg.solve([[along, -across], [across, along]], [x, y])
    return np.array([forward, left, yaw])
