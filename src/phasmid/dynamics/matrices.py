"""The form of a leg's equation of motion, and the numbers of the leg that go into it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.robot import Leg, LegArrays


class LegMatrices(NamedTuple):
    """The matrices of Eq. 10: torque = M q" + B [q' q'] + C [q'²] + G.

    Attributes:
        M: Mass matrix [kg·m²], shape (..., 3, 3).
        B: Coriolis coefficients [kg·m²], shape (..., 3, 3); its columns multiply
            q1' q2', q1' q3' and q2' q3'.
        C: Centrifugal coefficients [kg·m²], shape (..., 3, 3); its columns multiply
            q1'², q2'² and q3'².
        G: Torques that hold the leg against gravity [N·m], shape (..., 3).
    """

    M: Float[np.ndarray, "*batch 3 3"]
    B: Float[np.ndarray, "*batch 3 3"]
    C: Float[np.ndarray, "*batch 3 3"]
    G: Float[np.ndarray, "*batch 3"]


def moments_about_origin(
    mass: Float[np.ndarray, "*batch"],
    com: Float[np.ndarray, "*batch 3"],
    inertia: Float[np.ndarray, "*batch 3 3"],
) -> tuple[Float[np.ndarray, "*batch 3"], Float[np.ndarray, "*batch 3 3"]]:
    """First and second moments of rigid bodies about the origins of their frames.

    Args:
        mass: Masses [kg], shape (...).
        com: Centres of mass in the bodies' frames [m], shape (..., 3).
        inertia: About the centres of mass [kg·m²], shape (..., 3, 3).

    Returns:
        Mass times centre of mass [kg·m], shape (..., 3), and the inertia about the origin
        [kg·m²], shape (..., 3, 3).

    Source: the parallel axis theorem.
    """
    first = mass[..., None] * com
    square = np.sum(first * com, axis=-1)[..., None, None] * np.eye(3)
    return first, inertia + square - first[..., :, None] * com[..., None, :]


def hip_gravity(leg: Leg | LegArrays, gravity: float) -> Float[np.ndarray, "*legs 3"]:
    """Return the acceleration that holds a body against gravity on a level trunk, in hip axes.

    Args:
        leg: The leg, or a robot's ``arrays``.
        gravity: Acceleration of free fall, downwards along the body's z [m/s²].
    """
    up = leg.R_body_hip[..., 2, :] if isinstance(leg, LegArrays) else leg.X_body_hip[2, :3]
    return np.asarray(gravity * up)


def link_moments(leg: Leg | LegArrays) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return masses, and first and second moments about the origins of the links' frames.

    These are moved along the femur's axis into the leg's plane, which makes lateral offsets a part
    of the centres of mass.
    """
    _, mass, com, inertia = link_arrays(leg)
    return mass, *moments_about_origin(mass, com - in_plane(leg), inertia)


def in_plane(leg: Leg | LegArrays) -> Float[np.ndarray, "*legs 3 3"]:
    """Return the point of the leg's plane on each link's joint axis, in the link's frame [m]."""
    left = np.zeros((*leg.lateral_offsets.shape, 3))
    # The joints' axes are to the leg's right.
    left[..., 1:, 2] = np.cumsum(leg.lateral_offsets, axis=-1)[..., :2]
    return left


def link_arrays(leg: Leg | LegArrays) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return lengths, masses, centres of mass and inertias of the links, as in ``LegArrays``."""
    if isinstance(leg, LegArrays):
        return leg.lengths, leg.mass, leg.com, leg.inertia
    mass = np.array([link.mass for link in leg.links])
    com = np.array([link.com for link in leg.links])
    return leg.lengths, mass, com, np.array([link.inertia for link in leg.links])
