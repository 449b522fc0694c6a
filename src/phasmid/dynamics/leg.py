"""Closed-form dynamics of one leg on a trunk that is fixed in space and level.

The equations are in `leg_kernels`, which is imported when first needed: numba takes 0.6 s.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.dynamics.matrices import LegMatrices, hip_gravity, link_moments
from phasmid.dynamics.printed import printed_leg_matrices, printed_leg_torque
from phasmid.kinematics.arguments import as_printed, number, threes
from phasmid.robot import Leg, LegArrays
from phasmid.units import STANDARD_GRAVITY


def leg_matrices(
    leg: Leg | LegArrays,
    q: Float[np.ndarray, "*#batch 3"],
    *,
    form: str = "corrected",
    gravity: float = STANDARD_GRAVITY,
) -> LegMatrices:
    """Matrices of the leg's equation of motion.

    Args:
        leg: The leg, or a robot's ``arrays`` for all legs along the axis before the last.
        q: Coxa, femur and tibia angles [rad], shape (..., 3).
        form: ``corrected``, or ``as-printed``: Eq. 10 with all its misprints, for study. The print
            knows masses at mid-length and principal inertias only, whatever the leg has: on a leg
            with others the two forms differ by more than the misprints, which
            ``phasmid.robot.with_mass_model(robot, "mid-length")`` shows alone.
        gravity: Acceleration of free fall, downwards along the body's z [m/s²]; the print
            knows upright hips only, and has it along the hip's.

    Returns:
        M, B, C and G, which depend on the angles alone.

    Raises:
        InvalidInput: It is no leg, the angles do not fit it, gravity is no finite number, or there
            is no such form.

    Source: Eq. 10, corrected (docs/errata.md) and derived anew by Lagrange's equations for links
    with any centre of mass and any inertia; with centres at mid-length and diagonal inertias it
    is the paper's own form.
    """
    if as_printed(form):
        return printed_leg_matrices(leg, q, gravity=gravity)
    from phasmid.dynamics.leg_kernels import each_leg_matrices

    links = link_moments(leg)
    (q,) = threes(leg, q=q)
    gravity_hip = hip_gravity(leg, number("gravity", gravity))
    return LegMatrices(*each_leg_matrices(*links, gravity_hip, q))


def leg_torque(
    leg: Leg | LegArrays,
    q: Float[np.ndarray, "*#batch 3"],
    qd: Float[np.ndarray, "*#batch 3"],
    qdd: Float[np.ndarray, "*#batch 3"],
    *,
    foot_force: Float[np.ndarray, "*#batch 3"] | None = None,
    form: str = "corrected",
    gravity: float = STANDARD_GRAVITY,
) -> Float[np.ndarray, "*batch 3"]:
    """Joint torques that move a leg as given while the ground pushes its foot.

    Args:
        leg: The leg, or a robot's ``arrays`` for all legs along the axis before the last.
        q: Coxa, femur and tibia angles [rad], shape (..., 3).
        qd: Their speeds [rad/s], shape (..., 3).
        qdd: Their accelerations [rad/s²], shape (..., 3).
        foot_force: Force of the ground on the foot in hip axes [N], shape (..., 3);
            none by default.
        form: ``corrected``, or ``as-printed``: Eqs. 10 and 11 with all their misprints, for study.
            The print knows masses at mid-length and principal inertias only, whatever the leg has:
            on a leg with others the two forms differ by more than the misprints, which
            ``phasmid.robot.with_mass_model(robot, "mid-length")`` shows alone.
        gravity: Acceleration of free fall, downwards along the body's z [m/s²]; the print
            knows upright hips only, and has it along the hip's.

    Returns:
        Torques of coxa, femur and tibia [N·m], shape (..., 3).

    Raises:
        InvalidInput: It is no leg, an array does not fit it or the others, gravity is no finite
            number, or there is no such form.

    Source: Eq. 11, corrected: the ground's reaction enters with a minus sign.
    """
    if as_printed(form):
        return printed_leg_torque(leg, q, qd, qdd, foot_force=foot_force, gravity=gravity)
    from phasmid.dynamics.leg_kernels import each_leg_torque

    lengths, *links = link_moments(leg)
    left = np.asarray(leg.lateral_offsets.sum(axis=-1))
    loads = {} if foot_force is None else {"foot_force": foot_force}
    arrays = threes(leg, q=q, qd=qd, qdd=qdd, **loads)
    arrays += [] if loads else [np.zeros(3)]
    gravity_hip = hip_gravity(leg, number("gravity", gravity))
    return np.asarray(each_leg_torque(lengths, left, *links, gravity_hip, *arrays))
