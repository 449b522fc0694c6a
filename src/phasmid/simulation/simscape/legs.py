"""Legs with prescribed joints as functions of time, for the motion of the trunk.

Seen from the trunk, the prescribed joints determine the mass distribution, the momentum of the legs
and the motion of the contact points. They are computed at the time steps, and interpolated by
cubics through values and rates, with an error of fourth order in the step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.dynamics import BodyMotion, inverse_dynamics
from phasmid.dynamics.matrices import moments_about_origin
from phasmid.kinematics import LinkFrames, link_frames
from phasmid.robot import Robot
from phasmid.simulation.contact import CONTACT_POINTS, foot_points

COM, INERTIA, MOMENTUM, COM_ACCELERATION = 0, 12, 36, 48
"""Columns of a row: the cubics of the centre of mass (3), of the inertia about it (xx, yy, zz, xy,
xz, yz) and of the legs' angular momentum about it (3), and the acceleration of that centre (3)."""

LEGS = 51
"""Column at which the legs begin."""

TURNING, TIP, AXIS, COXA_AXIS, LEG = 48, 54, 57, 60, 63
"""Columns of one leg, after the cubics of its points: angular velocity of the tibia at both ends of
the step, tip, axis of femur and tibia, axis of the coxa; and the number of its columns."""


class Legs(NamedTuple):
    """Motion of the joints at N samples.

    Attributes:
        q: Joint angles [rad], shape (N, L, 3).
        qd: Joint velocities [rad/s], shape (N, L, 3).
        qdd: Joint accelerations [rad/s²], shape (N, L, 3).
    """

    q: Float[np.ndarray, "samples legs 3"]
    qd: Float[np.ndarray, "samples legs 3"]
    qdd: Float[np.ndarray, "samples legs 3"]


def leg_rows(
    robot: Robot, joints: Legs, tip_width: float, dt: float
) -> Float[np.ndarray, "samples width"]:
    """Return one row per time step, all vectors in body axes, shape (N, 51 + 63 L + 9 L).

    The columns are those of the robot and of its legs, then angles, velocities and accelerations
    of the joints at the beginning of the step; `joints` are N + 1 samples, at its ends.
    """
    count, legs = len(joints.q) - 1, len(robot.legs)
    points = np.stack([foot_points(leg, tip_width) for leg in robot.legs])
    frames = link_frames(robot, joints.q)
    turning, origin_velocity = link_velocities(frames, joints.qd)
    body = mass_distribution(robot, frames, joints)
    rows = np.empty((count, LEGS + (LEG + 9) * legs))
    rows[:, COM:INERTIA] = _cubics(body.com, body.com_rate, dt)
    i, j = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]
    inertia, inertia_rate = body.inertia[:, i, j], body.inertia_rate[:, i, j]
    rows[:, INERTIA:MOMENTUM] = _cubics(inertia, inertia_rate, dt)
    rows[:, MOMENTUM:COM_ACCELERATION] = _cubics(body.momentum, body.momentum_rate, dt)
    rows[:, COM_ACCELERATION:LEGS] = body.com_acceleration[:-1]
    rows[:, LEGS + LEG * legs :] = np.hstack([each[:-1].reshape(count, -1) for each in joints])

    R, origin, turning = frames.rotation[:, :, 2], frames.position[:, :, 2], turning[:, :, 2]
    arm = np.einsum("tlij,lkj->tlki", R, points)
    position = origin[:, :, None] + arm
    velocity = origin_velocity[:, :, None, 2] + np.cross(turning[:, :, None], arm)
    part = rows[:, LEGS : LEGS + LEG * legs].reshape(count, legs, LEG)
    flat = (count + 1, legs, 3 * CONTACT_POINTS)
    part[..., :TURNING] = _cubics(position.reshape(flat), velocity.reshape(flat), dt)
    part[..., TURNING : TURNING + 3] = turning[:-1]
    part[..., TURNING + 3 : TIP] = turning[1:]
    ends = np.array([leg.tibia.end for leg in robot.legs])
    part[..., TIP:AXIS] = (origin + (R @ ends[..., None])[..., 0])[:-1]
    part[..., AXIS:COXA_AXIS] = R[:-1, ..., 2]
    part[..., COXA_AXIS:] = frames.rotation[:-1, :, 0, :, 2]
    return rows


def joints_of(rows: Float[np.ndarray, "samples width"], legs: int) -> Legs:
    """Return the joints' motion at the beginning of the steps of `leg_rows`."""
    parts = rows[:, LEGS + LEG * legs :].reshape(len(rows), 3, legs, 3)
    return Legs(parts[:, 0], parts[:, 1], parts[:, 2])


def _cubics(value: np.ndarray, rate: np.ndarray, dt: float) -> np.ndarray:
    """Return the coefficients of the cubics over each step, lowest first, flat in the last axis."""
    a, b, da, db = value[:-1], value[1:], dt * rate[:-1], dt * rate[1:]
    cubic = np.stack([a, da, 3 * (b - a) - 2 * da - db, 2 * (a - b) + da + db], axis=-1)
    return cubic.reshape(*cubic.shape[:-2], -1)


def link_velocities(frames: LinkFrames, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return angular velocities of the links and velocities of their origins, (N, L, 3, 3)."""
    turning = np.cumsum(frames.rotation[..., :, 2] * qd[..., None], axis=-2)
    velocity = np.zeros_like(frames.position)
    along = np.diff(frames.position, axis=-2)
    velocity[..., 1:, :] = np.cumsum(np.cross(turning[..., :-1, :], along), axis=-2)
    return turning, velocity


class MassDistribution(NamedTuple):
    """The robot about its centre of mass, in body axes, for a trunk at rest."""

    com: np.ndarray
    com_rate: np.ndarray
    com_acceleration: np.ndarray
    inertia: np.ndarray
    inertia_rate: np.ndarray
    momentum: np.ndarray
    momentum_rate: np.ndarray


def mass_distribution(robot: Robot, frames: LinkFrames, joints: Legs) -> MassDistribution:
    """Return centre of mass, inertia and angular momentum with their rates, N samples each."""
    arrays, body, total = robot.arrays, robot.body, robot.mass
    R, mass = frames.rotation, arrays.mass[..., None]
    turning, origin_velocity = link_velocities(frames, joints.qd)
    arm = np.einsum("tlkij,lkj->tlki", R, arrays.com)
    position, velocity = frames.position + arm, origin_velocity + np.cross(turning, arm)
    own = R @ arrays.inertia @ np.swapaxes(R, -1, -2)
    com = (body.mass * body.com + np.sum(mass * position, axis=(1, 2))) / total
    linear = np.sum(mass * velocity, axis=(1, 2))
    com_rate = linear / total

    _, trunk = moments_about_origin(np.array(body.mass), body.com, body.inertia)
    masses = np.broadcast_to(arrays.mass, position.shape[:-1])
    _, moments = moments_about_origin(masses, position, own)
    inertia = trunk + moments.sum(axis=(1, 2)) - total * spread(com, com) / 2
    turn = np.cross(turning[..., None, :], np.eye(3)).swapaxes(-1, -2)
    rates = turn @ own - own @ turn + mass[..., None] * spread(position, velocity)
    inertia_rate = rates.sum(axis=(1, 2)) - total * spread(com, com_rate)

    spin = mass * np.cross(position, velocity) + (own @ turning[..., None])[..., 0]
    # Without gravity and on a trunk at rest, the legs need the rate of their momentum.
    _, wrench = inverse_dynamics(robot, BodyMotion.at_rest(), *joints, gravity=0.0)
    return MassDistribution(
        com,
        com_rate,
        wrench[:, :3] / total,
        inertia,
        inertia_rate,
        spin.sum(axis=(1, 2)) - np.cross(com, linear),
        wrench[:, 3:] - np.cross(com, wrench[:, :3]),
    )


def spread(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return 2 a·b 1 - a bᵀ - b aᵀ, the rate of r·r 1 - r rᵀ, shape (..., 3, 3)."""
    outer = a[..., :, None] * b[..., None, :]
    square = 2 * np.sum(a * b, axis=-1)[..., None, None] * np.eye(3)
    return np.asarray(square - outer - np.swapaxes(outer, -1, -2))
