"""Recursive Newton-Euler along the legs, all at once.

Vectors are (3, ..., L) and matrices (3, 3, L), as in ``components``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from phasmid.dynamics.components import apply, carried, components, cross, vector
from phasmid.dynamics.inertia import moments_about_origin
from phasmid.kinematics.matrices import Samples
from phasmid.robot import Robot


class Moments(NamedTuple):
    """Mass, first moment (3, L) and inertia (3, 3, L) about the origin of a body's frame."""

    mass: np.ndarray
    first: np.ndarray
    second: np.ndarray


def trunk_moments(robot: Robot) -> Moments:
    """Mass distribution of the trunk."""
    body = robot.body
    mass = np.array(body.mass)
    return Moments(mass, *moments_about_origin(mass, body.com, body.inertia))


def link_moments(robot: Robot) -> list[Moments]:
    """Mass distributions of all coxae, all femurs and all tibias."""
    mass = robot.arrays.mass
    first, second = moments_about_origin(mass, robot.arrays.com, robot.arrays.inertia)
    return [
        Moments(mass[:, k], components(first[:, k]), components(second[:, k], 2)) for k in range(3)
    ]


def joint_origins(lengths: np.ndarray) -> list[np.ndarray]:
    """Where each link's frame starts in the one before it, (3, L); lengths are (3, L)."""
    coxa, femur, _ = lengths
    return [along_x(length) for length in (np.zeros_like(coxa), coxa, femur)]


def along_x(length: Samples) -> np.ndarray:
    """A vector along a link."""
    return vector(length, np.zeros_like(length), np.zeros_like(length))


def leg_needs(
    lengths: np.ndarray,
    links: Sequence[Moments],
    w: np.ndarray,
    dw: np.ndarray,
    a: np.ndarray,
    foot_force: np.ndarray,
    q: np.ndarray,
    qd: np.ndarray,
    qdd: np.ndarray,
) -> tuple[list[np.ndarray], np.ndarray, np.ndarray]:
    """Joint torques, and what each hip must give, from the hips' motion, all in hip axes."""
    origins = joint_origins(lengths)
    turns, needs = [], []
    for k, (link, origin) in enumerate(zip(links, origins, strict=True)):
        c, s = np.cos(q[k]), np.sin(q[k])
        a = into_link(k, a + carried(origin, w, dw), c, s)
        x, y, z = into_link(k, w, c, s)
        dx, dy, dz = into_link(k, dw, c, s)
        w = vector(x, y, z + qd[k])
        dw = vector(dx + y * qd[k], dy - x * qd[k], dz + qdd[k])
        foot_force = into_link(k, foot_force, c, s)
        turns.append((c, s))
        needs.append(newton_euler(*link, w, dw, a))

    force = -foot_force
    moment = cross(along_x(lengths[2]), force)
    torque: list[np.ndarray] = []
    for k in (2, 1, 0):
        force, moment = force + needs[k][0], moment + needs[k][1]
        torque.insert(0, moment[2])
        force = out_of_link(k, force, *turns[k])
        moment = out_of_link(k, moment, *turns[k]) + cross(origins[k], force)
    return torque, force, moment


def leg_energies(
    robot: Robot, w: np.ndarray, v: np.ndarray, q: np.ndarray, qd: np.ndarray
) -> np.ndarray:
    """Kinetic energy of each leg (..., L) from its hip's motion in hip axes."""
    energy = np.zeros(q.shape[1:])
    origins = joint_origins(components(robot.arrays.lengths))
    for k, (link, origin) in enumerate(zip(link_moments(robot), origins, strict=True)):
        c, s = np.cos(q[k]), np.sin(q[k])
        v = into_link(k, v + cross(w, origin), c, s)
        x, y, z = into_link(k, w, c, s)
        w = vector(x, y, z + qd[k])
        energy = energy + energy_of(*link, w, v)
    return energy


def newton_euler(
    mass: np.ndarray,
    first: np.ndarray,
    second: np.ndarray,
    w: np.ndarray,
    dw: np.ndarray,
    a: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Force, and moment about the frame's origin, that give a rigid body its motion."""
    force = mass * a + carried(first, w, dw)
    moment = apply(second, dw) + cross(w, apply(second, w)) + cross(first, a)
    return force, moment


def energy_of(
    mass: np.ndarray, first: np.ndarray, second: np.ndarray, w: np.ndarray, v: np.ndarray
) -> np.ndarray:
    """Kinetic energy of a rigid body; v is the velocity of its frame's origin."""
    momentum = mass * v / 2 + cross(w, first)
    return np.asarray(np.sum(v * momentum + w * apply(second, w) / 2, axis=0))


def into_link(k: int, v: np.ndarray, c: np.ndarray, s: np.ndarray) -> np.ndarray:
    """A vector from the axes of the link before to those of link k, turned by its joint."""
    x, y, z = v
    if k == 1:
        # The femur's axis is the coxa's -y (Table 1's alpha of 90 degrees).
        y, z = z, -y
    return vector(c * x + s * y, c * y - s * x, z)


def out_of_link(k: int, v: np.ndarray, c: np.ndarray, s: np.ndarray) -> np.ndarray:
    """The inverse of ``into_link``."""
    x, y, z = v
    x, y = c * x - s * y, s * x + c * y
    return vector(x, -z, y) if k == 1 else vector(x, y, z)
