"""Closed-form kinematics of one leg, for one sample or millions.

The equations are in `leg_kernels`, which is imported when first needed: numba takes 0.6 s.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.arguments import explained
from phasmid.errors import Unreachable
from phasmid.robot import Leg, LegArrays

STRETCH_TOLERANCE = 1e-12
"""By this part of its length a leg may be over-stretched: the round-off of a target computed at
full stretch."""


def geometry(leg: Leg | LegArrays) -> tuple[np.ndarray, np.ndarray]:
    """Return a leg's lengths, shape (..., 3), and its foot's offset from its plane, shape (...)."""
    return leg.lengths, np.asarray(leg.lateral_offsets.sum(axis=-1))


@explained
def foot_position(
    leg: Leg | LegArrays, q: Float[np.ndarray, "*batch 3"]
) -> Float[np.ndarray, "*batch 3"]:
    """Foot of a leg for given joint angles.

    Args:
        leg: The leg, or a robot's ``arrays`` for all legs along the axis before the last.
        q: Coxa, femur and tibia angles [rad], shape (..., 3).

    Returns:
        Foot in the leg's hip frame [m], shape (..., 3).

    Source: Table 1 and Eqs. 1-2, corrected (docs/errata.md).
    """
    from phasmid.kinematics.leg_kernels import foot_position_ufunc

    return np.asarray(foot_position_ufunc(*geometry(leg), q))


@explained
def joint_angles(
    leg: Leg | LegArrays, p_hip_foot: Float[np.ndarray, "*batch 3"]
) -> Float[np.ndarray, "*batch 3"]:
    """Joint angles that place the foot at a point, knee up and leg outwards.

    Args:
        leg: The leg, or a robot's ``arrays`` for all legs along the axis before the last.
        p_hip_foot: Foot in the leg's hip frame [m], shape (..., 3).

    Returns:
        Coxa, femur and tibia angles [rad], each in (-pi, pi], shape (..., 3).

    Raises:
        Unreachable: A point is nearer or farther than the leg can go; carries the first such point.

    Source: Eqs. 3-9, corrected (docs/errata.md).
    """
    q, margin = angles_and_margin(leg, p_hip_foot)
    # Written so that NaN counts as unreachable.
    reachable = margin >= -STRETCH_TOLERANCE * (leg.lengths[..., 1] + leg.lengths[..., 2]) ** 2
    if not np.all(reachable):
        raise _unreachable(leg, p_hip_foot, tuple(map(int, np.argwhere(~reachable)[0])))
    return q


def angles_and_margin(
    leg: Leg | LegArrays, p_hip_foot: Float[np.ndarray, "*batch 3"]
) -> tuple[Float[np.ndarray, "*batch 3"], Float[np.ndarray, "*batch"]]:
    """Joint angles [rad] as `joint_angles`, and a margin [m²].

    The margin is negative, or NaN, where the leg cannot reach.

    Args:
        leg: The leg, or a robot's ``arrays``.
        p_hip_foot: Foot in the hip frame [m], shape (..., 3).
    """
    from phasmid.kinematics.leg_kernels import inverse_kinematics_ufunc

    q, margin = inverse_kinematics_ufunc(*geometry(leg), p_hip_foot)
    return q, np.asarray(margin)


def _unreachable(
    leg: Leg | LegArrays, p_hip_foot: Float[np.ndarray, "*batch 3"], index: tuple[int, ...]
) -> Unreachable:
    """Return the error of one point out of many; its distance is along the leg's plane."""
    lengths, left = geometry(leg)
    point, lengths, side = np.broadcast_arrays(p_hip_foot, lengths, left[..., None])
    (x, y, z), (coxa, femur, tibia) = point[index].tolist(), lengths[index].tolist()
    outward = math.sqrt(max(x * x + y * y - float(side[index][0]) ** 2, 0.0))
    name = leg.name if isinstance(leg, Leg) else str(index[-1] + 1)
    which = f", point {', '.join(map(str, index))}" if index else ""
    target = ", ".join(f"{1000 * c:.1f}" for c in (x, y, z))
    return Unreachable(
        f"leg {name}{which}: foot target ({target}) mm is "
        f"{1000 * math.hypot(outward - coxa, z):.1f} mm from the femur axis; the leg reaches "
        f"{1000 * abs(femur - tibia):.1f} to {1000 * (femur + tibia):.1f} mm."
    )


@explained
def jacobian(
    leg: Leg | LegArrays,
    q: Float[np.ndarray, "*batch 3"],
    offset: Float[np.ndarray, "*#batch 3"] | None = None,
) -> Float[np.ndarray, "*batch 3 3"]:
    """Jacobian of the foot: its velocity in hip axes for unit joint speeds.

    Args:
        leg: The leg, or a robot's ``arrays``.
        q: Joint angles [rad], shape (..., 3).
        offset: Point fixed to the tibia that takes the foot's place, from the foot in hip axes
            [m], shape (..., 3); the foot itself by default.

    Returns:
        d foot / d q [m/rad], shape (..., 3, 3): rows x, y, z; columns coxa, femur, tibia.

    Source: the derivative of Table 1; J of Eq. 11.
    """
    from phasmid.kinematics.leg_kernels import contact_jacobian_ufunc, foot_jacobian_ufunc

    if offset is None:
        return np.asarray(foot_jacobian_ufunc(*geometry(leg), q))
    return np.asarray(contact_jacobian_ufunc(*geometry(leg), q, offset))


@explained
def joint_motion(
    leg: Leg | LegArrays,
    q: Float[np.ndarray, "*batch 3"],
    v_hip_foot: Float[np.ndarray, "*batch 3"],
    a_hip_foot: Float[np.ndarray, "*batch 3"],
) -> tuple[Float[np.ndarray, "*batch 3"], Float[np.ndarray, "*batch 3"]]:
    """Joint speeds and accelerations that give the foot a velocity and an acceleration.

    Args:
        leg: The leg, or a robot's ``arrays``.
        q: Joint angles [rad], shape (..., 3); the leg neither stretched nor folded flat.
        v_hip_foot: Velocity of the foot in the hip frame [m/s], shape (..., 3).
        a_hip_foot: Acceleration of the foot in the hip frame [m/s²], shape (..., 3).

    Returns:
        Joint speeds [rad/s] and accelerations [rad/s²], each of shape (..., 3).

    Source: Table 1, differentiated twice in cylindrical coordinates about the coxa axis.
    """
    from phasmid.kinematics.leg_kernels import joint_motion_ufunc

    qd, qdd = joint_motion_ufunc(*geometry(leg), q, v_hip_foot, a_hip_foot)
    return qd, qdd
