"""What legs with prescribed joints are to the trunk: known beforehand, as functions of time.

Seen from the trunk, prescribed joints leave nothing open: where the centre of mass lies and how
the mass is spread, what momentum the legs have of their own, and where the contact points are and
how fast. All of it is computed at the time steps, and between them by cubics through values and
rates: what they miss is of fourth order in the step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid import dynamics
from phasmid.dynamics import BodyMotion
from phasmid.dynamics.inertia import moments_about_origin
from phasmid.kinematics import link_frames
from phasmid.robot import Robot
from phasmid.simulation.contact import CONTACT_POINTS, foot_points

COM, INERTIA, MOMENTUM, COM_ACCELERATION = 0, 12, 36, 48
"""Where in a row begin the cubics of the centre of mass (3), of the inertia about it (xx, yy, zz,
xy, xz, yz) and of the legs' own angular momentum about it (3), and its acceleration (3)."""

LEGS = 51
"""Where in a row the legs begin."""

TURNING, TIP, AXIS, COXA_AXIS, LEG = 48, 54, 57, 60, 63
"""Of one leg, after the cubics of its points: angular velocity of the tibia at both ends of the
step, tip, axis of femur and tibia, axis of the coxa; and how many numbers it has in all."""


class Legs(NamedTuple):
    """Motion of the joints at some samples.

    Attributes:
        q: Joint angles [rad], shape (N, L, 3).
        qd: Joint speeds [rad/s], shape (N, L, 3).
        qdd: Joint accelerations [rad/s²], shape (N, L, 3).
    """

    q: Float[np.ndarray, "samples legs 3"]
    qd: Float[np.ndarray, "samples legs 3"]
    qdd: Float[np.ndarray, "samples legs 3"]


def leg_rows(
    robot: Robot, joints: Legs, tip_width: float, dt: float
) -> Float[np.ndarray, "samples width"]:
    """What the trunk feels of its legs in each of a series of steps, all vectors in body axes.

    Args:
        robot: The robot, L legs.
        joints: Their motion at the steps' ends, N + 1 samples.
        tip_width: Side of the square of a foot's contact points [m].
        dt: Time from one sample to the next [s].

    Returns:
        A row for each of the N steps: the cubics of the whole robot, those of the legs, and
        positions, speeds and accelerations of the joints where the step begins; shape
        (N, 51 + 63 L + 9 L).
    """
    count, legs = len(joints.q) - 1, len(robot.legs)
    points = np.stack([foot_points(leg, tip_width) for leg in robot.legs])
    frames = link_frames(robot, joints.q)
    motion = _links(frames.rotation, frames.position, joints.qd)
    whole = _whole(robot, motion, joints)
    rows = np.empty((count, LEGS + (LEG + 9) * legs))
    rows[:, COM:INERTIA] = _cubics(whole.com, whole.com_rate, dt)
    rows[:, INERTIA:MOMENTUM] = _cubics(_six(whole.inertia), _six(whole.inertia_rate), dt)
    rows[:, MOMENTUM:COM_ACCELERATION] = _cubics(whole.momentum, whole.momentum_rate, dt)
    rows[:, COM_ACCELERATION:LEGS] = whole.com_acceleration[:-1]

    tibia = frames.rotation[:, :, 2]
    arm = np.einsum("tlij,lkj->tlki", tibia, points)
    turning = motion.turning[:, :, 2]
    place = frames.position[:, :, None, 2] + arm
    speed = motion.origin_velocity[:, :, None, 2] + np.cross(turning[:, :, None], arm)
    rows[:, LEGS + LEG * legs :] = np.hstack([each[:-1].reshape(count, -1) for each in joints])
    part = rows[:, LEGS : LEGS + LEG * legs].reshape(count, legs, LEG)
    flat = (count + 1, legs, 3 * CONTACT_POINTS)
    part[..., :TURNING] = _cubics(place.reshape(flat), speed.reshape(flat), dt)
    part[..., TURNING : TURNING + 3] = turning[:-1]
    part[..., TURNING + 3 : TIP] = turning[1:]
    part[..., TIP:AXIS] = (frames.position[:, :, 2] + _feet(robot, tibia))[:-1]
    part[..., AXIS:COXA_AXIS] = tibia[:-1, ..., 2]
    part[..., COXA_AXIS:] = frames.rotation[:-1, :, 0, :, 2]
    return rows


def joints_of(rows: Float[np.ndarray, "samples width"], legs: int) -> Legs:
    """The joints' motion where the steps begin.

    Args:
        rows: From `leg_rows`.
        legs: Number of legs.
    """
    parts = rows[:, LEGS + LEG * legs :].reshape(len(rows), 3, legs, 3)
    return Legs(parts[:, 0], parts[:, 1], parts[:, 2])


def _feet(robot: Robot, tibia: np.ndarray) -> np.ndarray:
    """Feet from the tibia's origin, in the axes of its rotation."""
    return np.einsum("tlij,lj->tli", tibia, [leg.tibia.end for leg in robot.legs])


def _cubics(value: np.ndarray, rate: np.ndarray, dt: float) -> np.ndarray:
    """Coefficients of the cubics in the share of a step, lowest first, flat behind each other."""
    a, b, da, db = value[:-1], value[1:], dt * rate[:-1], dt * rate[1:]
    cubic = np.stack([a, da, 3 * (b - a) - 2 * da - db, 2 * (a - b) + da + db], axis=-1)
    return cubic.reshape(*cubic.shape[:-2], -1)


def _six(matrix: np.ndarray) -> np.ndarray:
    """The entries xx, yy, zz, xy, xz, yz of symmetric matrices."""
    i, j = np.array([0, 1, 2, 0, 0, 1]), np.array([0, 1, 2, 1, 2, 2])
    return np.asarray(matrix[..., i, j])


class _Links(NamedTuple):
    """All links in body axes, seen from the body: shapes (N, L, 3, 3), rotation with one more."""

    rotation: np.ndarray
    origin: np.ndarray
    origin_velocity: np.ndarray
    turning: np.ndarray


def _links(rotation: np.ndarray, origin: np.ndarray, qd: np.ndarray) -> _Links:
    turning = np.cumsum(rotation[..., :, 2] * qd[..., None], axis=-2)
    velocity = np.zeros_like(origin)
    for k in (1, 2):
        along = origin[..., k, :] - origin[..., k - 1, :]
        velocity[..., k, :] = velocity[..., k - 1, :] + np.cross(turning[..., k - 1, :], along)
    return _Links(rotation, origin, velocity, turning)


class _Whole(NamedTuple):
    """The whole robot about its centre of mass, in body axes."""

    com: np.ndarray
    com_rate: np.ndarray
    com_acceleration: np.ndarray
    inertia: np.ndarray
    inertia_rate: np.ndarray
    momentum: np.ndarray
    momentum_rate: np.ndarray


def _whole(robot: Robot, links: _Links, joints: Legs) -> _Whole:
    arrays, body, total = robot.arrays, robot.body, robot.mass
    mass = arrays.mass[..., None]
    arm = np.einsum("tlkij,lkj->tlki", links.rotation, arrays.com)
    at = links.origin + arm
    velocity = links.origin_velocity + np.cross(links.turning, arm)
    own = links.rotation @ arrays.inertia @ np.swapaxes(links.rotation, -1, -2)
    com = (body.mass * body.com + np.sum(mass * at, axis=(1, 2))) / total
    linear = np.sum(mass * velocity, axis=(1, 2))
    com_rate = linear / total

    _, trunk = moments_about_origin(np.array(body.mass), body.com, body.inertia)
    _, moments = moments_about_origin(np.broadcast_to(arrays.mass, at.shape[:-1]), at, own)
    inertia = trunk + moments.sum(axis=(1, 2)) - total * _spread(com, com) / 2
    turn = _cross_matrix(links.turning)
    rates = turn @ own - own @ turn + mass[..., None] * _spread(at, velocity)
    rate = rates.sum(axis=(1, 2)) - total * _spread(com, com_rate)

    spin = mass * np.cross(at, velocity) + (own @ links.turning[..., None])[..., 0]
    # Without gravity and on a trunk at rest, what the legs need is the rate of their momentum.
    _, needed = dynamics.inverse_dynamics(robot, BodyMotion.at_rest(), *joints, gravity=0.0)
    return _Whole(
        com,
        com_rate,
        needed[:, :3] / total,
        inertia,
        rate,
        spin.sum(axis=(1, 2)) - np.cross(com, linear),
        needed[:, 3:] - np.cross(com, needed[:, :3]),
    )


def _spread(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Twice a·b times the unit matrix, less both outer products: the rate of |r|² - r rᵀ."""
    outer = a[..., :, None] * b[..., None, :]
    square = 2 * np.sum(a * b, axis=-1)[..., None, None] * np.eye(3)
    return np.asarray(square - outer - np.swapaxes(outer, -1, -2))


def _cross_matrix(v: np.ndarray) -> np.ndarray:
    """The matrix of the vector product with v from the left, shape (..., 3, 3)."""
    return np.cross(v[..., None, :], np.eye(3)).swapaxes(-1, -2)
