"""Legs with prescribed joints as functions of time, for the motion of the trunk.

Seen from the trunk, the prescribed joints determine the mass distribution, the momentum of the legs
and the motion of the contact points. They are computed at the time steps, and interpolated by
cubics through values and rates, with an error of fourth order in the step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Shaped

from phasmid.dynamics import BodyMotion, inverse_dynamics
from phasmid.dynamics.matrices import moments_about_origin
from phasmid.experiment import ContactLaw
from phasmid.kinematics import LinkFrames, link_frames
from phasmid.robot import Robot
from phasmid.simulation.contact import CONTACT_POINTS, foot_points
from phasmid.simulation.drives import Setpoints

TRUNK = np.dtype(
    [
        ("com", np.float64, (3, 4)),
        ("inertia", np.float64, (6, 4)),
        ("momentum", np.float64, (3, 4)),
        ("com_acceleration", np.float64, 3),
    ]
)
"""The robot in one step, body axes: cubics of the centre of mass, of the inertia about it (xx, yy,
zz, xy, xz, yz) and of the legs' angular momentum about it, and the acceleration of that centre."""

LEG = np.dtype(
    [
        ("points", np.float64, (CONTACT_POINTS, 3, 4)),
        ("turning", np.float64, (2, 3)),
        ("tip", np.float64, 3),
        ("axis", np.float64, 3),
        ("coxa_axis", np.float64, 3),
    ]
)
"""One leg in one step, body axes: cubics of its contact points, angular velocity of the tibia at
both ends of the step, tip, axis of femur and tibia, axis of the coxa."""


def leg_rows(
    robot: Robot, joints: Setpoints, law: ContactLaw, dt: float
) -> Shaped[np.ndarray, " samples"]:
    """Return one record per time step.

    Args:
        robot: The robot, L legs.
        joints: Motion of the joints at the ends of N steps, N + 1 samples.
        law: Its tip width and point radius are used.
        dt: Time step [s].

    Returns:
        Records with the fields ``trunk`` (`TRUNK`), ``legs`` (`LEG`, shape (L,)), and angles ``q``,
        velocities ``qd`` and accelerations ``qdd`` of the joints at the beginning of the step,
        shapes (L, 3); shape (N,).
    """
    count, legs = len(joints.q) - 1, len(robot.legs)
    angles = [(name, np.float64, (legs, 3)) for name in ("q", "qd", "qdd")]
    rows = np.empty(count, [("trunk", TRUNK), ("legs", LEG, legs), *angles])
    rows["q"], rows["qd"], rows["qdd"] = joints.q[:-1], joints.qd[:-1], joints.qdd[:-1]

    frames = link_frames(robot, joints.q)
    body, trunk = mass_distribution(robot, frames, joints), rows["trunk"]
    i, j = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]
    trunk["com"] = _cubics(body.com, body.com_rate, dt)
    trunk["inertia"] = _cubics(body.inertia[:, i, j], body.inertia_rate[:, i, j], dt)
    trunk["momentum"] = _cubics(body.momentum, body.momentum_rate, dt)
    trunk["com_acceleration"] = body.com_acceleration[:-1]

    turning, origin_velocity = (each[:, :, 2] for each in link_velocities(frames, joints.qd))
    R, origin = frames.rotation[:, :, 2], frames.position[:, :, 2]
    points = np.stack([foot_points(robot, leg, law) for leg in robot.legs])
    arm = np.einsum("tlij,lkj->tlki", R, points)
    velocity = origin_velocity[:, :, None] + np.cross(turning[:, :, None], arm)
    ends = np.array([leg.tibia.end for leg in robot.legs])
    leg = rows["legs"]
    leg["points"] = _cubics(origin[:, :, None] + arm, velocity, dt)
    leg["turning"] = np.stack([turning[:-1], turning[1:]], axis=2)
    leg["tip"] = (origin + (R @ ends[..., None])[..., 0])[:-1]
    leg["axis"] = R[:-1, ..., 2]
    leg["coxa_axis"] = frames.rotation[:-1, :, 0, :, 2]
    return rows


def _cubics(value: np.ndarray, rate: np.ndarray, dt: float) -> np.ndarray:
    """Return the coefficients of the cubics over each step, lowest first, in a last axis."""
    a, b, da, db = value[:-1], value[1:], dt * rate[:-1], dt * rate[1:]
    return np.stack([a, da, 3 * (b - a) - 2 * da - db, 2 * (a - b) + da + db], axis=-1)


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


def mass_distribution(robot: Robot, frames: LinkFrames, joints: Setpoints) -> MassDistribution:
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
    _, wrench = inverse_dynamics(robot, BodyMotion.at_rest(), *joints[:3], gravity=0.0)
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
