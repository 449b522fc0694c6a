"""Closed-form dynamics of one leg on a trunk that is fixed in space and level.

The equations are in `leg_kernels`, which is imported when first needed: numba takes 0.6 s.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.arguments import explained
from phasmid.dynamics.matrices import LegMatrices, hip_gravity, link_moments
from phasmid.kinematics.leg import geometry
from phasmid.robot import Leg, LegArrays


@explained
def leg_matrices(
    leg: Leg | LegArrays, q: Float[np.ndarray, "*#batch 3"], *, gravity: float
) -> LegMatrices:
    """Matrices of the leg's equation of motion.

    Args:
        leg: The leg, or a robot's ``arrays`` for all legs along the axis before the last.
        q: Coxa, femur and tibia angles [rad], shape (..., 3).
        gravity: Acceleration of free fall, downwards along the body's z [m/s²].

    Returns:
        M, B, C and G, which depend on the angles alone.

    Source: Eq. 10, corrected (docs/errata.md) and derived anew by Lagrange's equations for links
    with any centre of mass and any inertia; with centres at mid-length and diagonal inertias it
    is the paper's own form.
    """
    from phasmid.dynamics.leg_kernels import leg_matrices_ufunc

    return LegMatrices(
        *leg_matrices_ufunc(leg.lengths, *link_moments(leg), hip_gravity(leg, gravity), q)
    )


@explained
def leg_torque(
    leg: Leg | LegArrays,
    q: Float[np.ndarray, "*#batch 3"],
    qd: Float[np.ndarray, "*#batch 3"],
    qdd: Float[np.ndarray, "*#batch 3"],
    *,
    foot_force: Float[np.ndarray, "*#batch 3"] | None = None,
    gravity: float,
) -> Float[np.ndarray, "*batch 3"]:
    """Joint torques of a leg for a motion and a force of the ground on its foot.

    Args:
        leg: The leg, or a robot's ``arrays`` for all legs along the axis before the last.
        q: Coxa, femur and tibia angles [rad], shape (..., 3).
        qd: Their speeds [rad/s], shape (..., 3).
        qdd: Their accelerations [rad/s²], shape (..., 3).
        foot_force: Force of the ground on the foot in hip axes [N], shape (..., 3);
            none by default.
        gravity: Acceleration of free fall, downwards along the body's z [m/s²].

    Returns:
        Torques of coxa, femur and tibia [N·m], shape (..., 3).

    Source: Eq. 11, corrected: the ground's reaction enters with a minus sign.
    """
    from phasmid.dynamics.leg_kernels import leg_torque_ufunc

    links = *geometry(leg), *link_moments(leg), hip_gravity(leg, gravity)
    force = np.zeros(3) if foot_force is None else foot_force
    return np.asarray(leg_torque_ufunc(*links, q, qd, qdd, force))
