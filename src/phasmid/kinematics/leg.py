"""Closed-form kinematics of one leg: where the foot is, and which angles put it there."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.errors import Unreachable
from phasmid.kinematics.arguments import HasLengths, as_printed, check_leg, threes
from phasmid.kinematics.matrices import Samples, matrix
from phasmid.kinematics.printed import printed_joint_angles

STRETCH_TOLERANCE = 1e-12
"""By this part of its length a leg may be over-stretched: the round-off of a target computed at
full stretch."""


def foot_position(
    leg: HasLengths, q: Float[np.ndarray, "*batch 3"]
) -> Float[np.ndarray, "*batch 3"]:
    """Foot of a leg for given joint angles.

    Args:
        leg: The leg, or a robot's ``arrays`` for all legs along the axis before the last.
        q: Coxa, femur and tibia angles [rad], shape (..., 3).

    Returns:
        Foot in the leg's hip frame [m], shape (..., 3).

    Raises:
        InvalidInput: It is no leg, or the angles do not fit it.

    Source: Table 1 and Eqs. 1-2, corrected (docs/errata.md).
    """
    check_leg(leg)
    (angles,) = threes(leg, q=q)
    return np.stack(foot_of(np.moveaxis(leg.lengths, -1, 0), angles), axis=-1)


def foot_of(lengths: np.ndarray, q: np.ndarray) -> tuple[Samples, Samples, Samples]:
    """The foot's x, y and z; lengths and angles have their three components in front."""
    coxa, femur, tibia = lengths
    q1, q2, q3 = q
    r = coxa + femur * np.cos(q2) + tibia * np.cos(q2 + q3)
    z = femur * np.sin(q2) + tibia * np.sin(q2 + q3)
    return r * np.cos(q1), r * np.sin(q1), z


def joint_angles(
    leg: HasLengths, p_hip_foot: Float[np.ndarray, "*batch 3"], *, form: str = "corrected"
) -> Float[np.ndarray, "*batch 3"]:
    """Joint angles that place the foot at a point, knee up and leg outwards.

    Args:
        leg: The leg, or a robot's ``arrays`` for all legs along the axis before the last.
        p_hip_foot: Foot in the leg's hip frame [m], shape (..., 3).
        form: ``corrected``, or ``as-printed``: Eqs. 3 to 9 with all their misprints, for study.

    Returns:
        Coxa, femur and tibia angles [rad], each in (-pi, pi], shape (..., 3); as printed, NaN
        where an equation gives no angle.

    Raises:
        Unreachable: A point is nearer or farther than the leg can go; carries the first such point.
        InvalidInput: It is no leg, the points do not fit it, or there is no such form.

    Source: Eqs. 3-9, corrected (docs/errata.md). The law of cosines of Eqs. 6 and 8 is taken by
    half angles, which keep full precision at full stretch.
    """
    if as_printed(form):
        return printed_joint_angles(leg, p_hip_foot)
    check_leg(leg)
    (p,) = threes(leg, p_hip_foot=p_hip_foot)
    q, margin = angles_of(np.moveaxis(leg.lengths, -1, 0), p)
    # Written so that NaN counts as unreachable.
    reachable = margin >= 0
    if not np.all(reachable):
        index = tuple(map(int, np.argwhere(~np.asarray(reachable))[0]))
        raise unreachable(leg, np.moveaxis(p, 0, -1), index)
    return np.stack(np.broadcast_arrays(*q), axis=-1)


def angles_of(
    lengths: np.ndarray, p: np.ndarray
) -> tuple[tuple[Samples, Samples, Samples], Samples]:
    """Joint angles, and a margin [m²] that is negative, or NaN, where the leg cannot reach.

    Lengths and points have their three components in front.
    """
    coxa, femur, tibia = lengths
    x, y, z = p
    out = np.sqrt(x**2 + y**2) - coxa
    square = out**2 + z**2
    longest, shortest = (femur + tibia) ** 2, (femur - tibia) ** 2
    slack = STRETCH_TOLERANCE * longest
    margin = np.minimum(longest + slack - square, square - (shortest - slack))
    # Half the knee's bend is the angle of (t2, t1), with t1² + t2² = 4 femur tibia. The femur
    # stands above the line to the foot by the angle of (square + femur² - tibia², t1 t2); the line
    # turned by it needs one arc tangent.
    t1 = np.sqrt(np.maximum(longest - square, 0.0))
    t2 = np.sqrt(np.maximum(square - shortest, 0.0))
    along, across = square + (femur + tibia) * (femur - tibia), t1 * t2
    q2 = np.arctan2(z * along + out * across, out * along - z * across)
    return (np.arctan2(y, x), q2, -2 * np.arctan2(t1, t2)), margin


def unreachable(
    leg: HasLengths, p: Float[np.ndarray, "*batch 3"], index: tuple[int, ...]
) -> Unreachable:
    """The error that tells of one point out of many."""
    point, lengths = (v[index] for v in np.broadcast_arrays(p, leg.lengths))
    (x, y, z), (coxa, femur, tibia) = map(float, point), map(float, lengths)
    return Unreachable(
        getattr(leg, "name", str(index[-1] + 1) if index else ""),
        (x, y, z),
        distance=math.hypot(math.hypot(x, y) - coxa, z),
        reach=(abs(femur - tibia), femur + tibia),
        index=index,
    )


def jacobian(leg: HasLengths, q: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3 3"]:
    """Jacobian of the foot: its velocity in hip axes for unit joint speeds.

    Args:
        leg: The leg, or a robot's ``arrays``.
        q: Joint angles [rad], shape (..., 3).

    Returns:
        d foot / d q [m/rad], shape (..., 3, 3): rows x, y, z; columns coxa, femur, tibia.

    Raises:
        InvalidInput: It is no leg, or the angles do not fit it.

    Source: the derivative of Table 1; J of Eq. 11.
    """
    check_leg(leg)
    (angles,) = threes(leg, q=q)
    return matrix(*jacobian_of(np.moveaxis(leg.lengths, -1, 0), angles))


def jacobian_of(lengths: np.ndarray, q: np.ndarray) -> list[list[Samples]]:
    """The Jacobian's rows; lengths and angles have their three components in front."""
    coxa, femur, tibia = lengths
    q1, q2, q3 = q
    c1, s1 = np.cos(q1), np.sin(q1)
    out3, up3 = tibia * np.cos(q2 + q3), tibia * np.sin(q2 + q3)
    out, up = femur * np.cos(q2) + out3, femur * np.sin(q2) + up3
    r = coxa + out
    return [
        [-r * s1, -up * c1, -up3 * c1],
        [r * c1, -up * s1, -up3 * s1],
        [np.zeros_like(r), out, out3],
    ]


def joint_motion(
    leg: HasLengths,
    q: Float[np.ndarray, "*batch 3"],
    v_hip_foot: Float[np.ndarray, "*batch 3"],
    a_hip_foot: Float[np.ndarray, "*batch 3"],
) -> tuple[Float[np.ndarray, "*batch 3"], Float[np.ndarray, "*batch 3"]]:
    """Joint speeds and accelerations that move the foot as given.

    Args:
        leg: The leg, or a robot's ``arrays``.
        q: Joint angles [rad], shape (..., 3); the leg neither stretched nor folded flat.
        v_hip_foot: Velocity of the foot in the hip frame [m/s], shape (..., 3).
        a_hip_foot: Acceleration of the foot in the hip frame [m/s²], shape (..., 3).

    Returns:
        Joint speeds [rad/s] and accelerations [rad/s²], each of shape (..., 3).

    Raises:
        InvalidInput: It is no leg, or an array does not fit it or the others.

    Source: Table 1, differentiated twice in cylindrical coordinates about the coxa axis.
    """
    check_leg(leg)
    coxa, femur, tibia = np.moveaxis(leg.lengths, -1, 0)
    (q1, q2, q3), (vx, vy, vz), (ax, ay, az) = threes(
        leg, q=q, v_hip_foot=v_hip_foot, a_hip_foot=a_hip_foot
    )
    c1, s1 = np.cos(q1), np.sin(q1)
    c2, s2, c23, s23 = np.cos(q2), np.sin(q2), np.cos(q2 + q3), np.sin(q2 + q3)
    r = coxa + femur * c2 + tibia * c23
    v_out, v_side = c1 * vx + s1 * vy, c1 * vy - s1 * vx
    a_out, a_side = c1 * ax + s1 * ay, c1 * ay - s1 * ax

    # With the elevations e2 = q2 and e3 = q2 + q3 the plane's equations are diagonal:
    # projecting on the tibia leaves e2 alone, projecting on the femur leaves e3 alone.
    spread = np.sin(q3)
    w1 = v_side / r
    w2 = (v_out * c23 + vz * s23) / (femur * spread)
    w3 = -(v_out * c2 + vz * s2) / (tibia * spread)
    b_out = a_out + r * w1**2 + femur * c2 * w2**2 + tibia * c23 * w3**2
    b_up = az + femur * s2 * w2**2 + tibia * s23 * w3**2
    d1 = (a_side - 2 * v_out * w1) / r
    d2 = (b_out * c23 + b_up * s23) / (femur * spread)
    d3 = -(b_out * c2 + b_up * s2) / (tibia * spread)
    return np.stack([w1, w2, w3 - w2], axis=-1), np.stack([d1, d2, d3 - d2], axis=-1)
