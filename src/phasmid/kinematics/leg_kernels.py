"""Compiled kinematics of one leg at one instant, and ufuncs that apply it to arrays of samples.

`kinematics.leg` calls the ufuncs, the controller the functions of one instant.
Lengths are those of coxa, femur and tibia [m]; ``left`` is the foot's offset from the leg's plane,
positive to the left [m]; angles are in rad; points are in the hip frame [m].
"""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled, gufunc, inlined

Triple = tuple[float, float, float]


@inlined
def sincos(angle: float) -> tuple[float, float]:
    """Return sine and cosine of an angle [rad]."""
    return math.sin(angle), math.cos(angle)


@compiled
def forward_kinematics(lengths: np.ndarray, left: float, q1: float, q2: float, q3: float) -> Triple:
    """Return the foot for joint angles.

    Source: Table 1 and Eqs. 1-2, corrected.
    """
    (s1, c1), (s2, c2), (s3, c3) = sincos(q1), sincos(q2), sincos(q2 + q3)
    r = lengths[0] + lengths[1] * c2 + lengths[2] * c3
    return c1 * r - s1 * left, s1 * r + c1 * left, lengths[1] * s2 + lengths[2] * s3


@compiled
def inverse_kinematics(
    lengths: np.ndarray, left: float, x: float, y: float, z: float, stretch: float
) -> tuple[float, float, float, float]:
    """Return the joint angles that place the foot, knee up and leg outwards, and a margin [m²].

    The margin is negative, or NaN, where the leg cannot reach, and zero where it is stretched to
    the share ``stretch`` of its full length.

    Source: Eqs. 3-9, corrected. The law of cosines of Eqs. 6 and 8 is taken by half angles, which
    keep full precision at full stretch.
    """
    femur, tibia = lengths[1], lengths[2]
    beside = x * x + y * y - left * left
    r = math.sqrt(max(beside, 0.0))
    out = r - lengths[0]
    square = out * out + z * z
    longest, shortest = (femur + tibia) ** 2, (femur - tibia) ** 2
    margin = min(stretch * stretch * longest - square, square - shortest)
    if beside < 0.0:
        # The foot is nearer to the coxa axis than its offset.
        margin = min(margin, beside)
    # Half the knee's bend is the angle of (t2, t1), with t1² + t2² = 4 femur tibia. The femur
    # stands above the line to the foot by the angle of (square + femur² - tibia², t1 t2); the line
    # turned by it needs one arc tangent.
    t1 = math.sqrt(max(longest - square, 0.0))
    t2 = math.sqrt(max(square - shortest, 0.0))
    along, across = square + (femur + tibia) * (femur - tibia), t1 * t2
    q2 = math.atan2(z * along + out * across, out * along - z * across)
    q1 = math.atan2(y * r - x * left, x * r + y * left) if left else math.atan2(y, x)
    return q1, q2, -2 * math.atan2(t1, t2), margin


@compiled
def foot_jacobian(
    lengths: np.ndarray, left: float, q1: float, q2: float, q3: float, J: np.ndarray
) -> None:
    """Write d foot / d q [m/rad], shape (3, 3).

    Source: the derivative of Table 1; J of Eq. 11.
    """
    (s1, c1), (s2, c2), (s3, c3) = sincos(q1), sincos(q2), sincos(q2 + q3)
    out3, up3 = lengths[2] * c3, lengths[2] * s3
    out, up = lengths[1] * c2 + out3, lengths[1] * s2 + up3
    r = lengths[0] + out
    J[0, 0], J[0, 1], J[0, 2] = -s1 * r - c1 * left, -up * c1, -up3 * c1
    J[1, 0], J[1, 1], J[1, 2] = c1 * r - s1 * left, -up * s1, -up3 * s1
    J[2, 0], J[2, 1], J[2, 2] = 0.0, out, out3


@compiled
def add_offset(q1: float, x: float, y: float, z: float, J: np.ndarray) -> None:
    """Turn the Jacobian J of the foot into that of a point fixed to the tibia, changed in place.

    The point lies at (x, y, z) from the foot, in hip axes [m]; q1 is the coxa angle.
    """
    s1, c1 = sincos(q1)
    # The coxa turns about (0, 0, 1), femur and tibia about (s1, -c1, 0).
    J[0, 0], J[1, 0] = J[0, 0] - y, J[1, 0] + x
    for k in range(1, 3):
        J[0, k] -= c1 * z
        J[1, k] -= s1 * z
        J[2, k] += c1 * x + s1 * y


@compiled
def joint_motion(
    lengths: np.ndarray,
    left: float,
    q: np.ndarray,
    v: np.ndarray,
    a: np.ndarray,
    qd: np.ndarray,
    qdd: np.ndarray,
) -> None:
    """Write the joint speeds and accelerations for a foot's velocity v and acceleration a.

    Source: Table 1, differentiated twice in cylindrical coordinates about the coxa axis.
    """
    femur, tibia = lengths[1], lengths[2]
    (s1, c1), (s2, c2), (s23, c23) = sincos(q[0]), sincos(q[1]), sincos(q[1] + q[2])
    r = lengths[0] + femur * c2 + tibia * c23
    v_out, v_side = c1 * v[0] + s1 * v[1], c1 * v[1] - s1 * v[0]
    a_out, a_side = c1 * a[0] + s1 * a[1], c1 * a[1] - s1 * a[0]
    # With the elevations e2 = q2 and e3 = q2 + q3 the plane's equations are diagonal:
    # projecting on the tibia leaves e2 alone, projecting on the femur leaves e3 alone.
    spread = math.sin(q[2])
    w1 = v_side / r
    v_out += left * w1
    d1 = (a_side - 2 * v_out * w1 + left * w1**2) / r
    w2 = (v_out * c23 + v[2] * s23) / (femur * spread)
    w3 = -(v_out * c2 + v[2] * s2) / (tibia * spread)
    b_out = a_out + left * d1 + r * w1**2 + femur * c2 * w2**2 + tibia * c23 * w3**2
    b_up = a[2] + femur * s2 * w2**2 + tibia * s23 * w3**2
    d2 = (b_out * c23 + b_up * s23) / (femur * spread)
    d3 = -(b_out * c2 + b_up * s2) / (tibia * spread)
    qd[0], qd[1], qd[2] = w1, w2, w3 - w2
    qdd[0], qdd[1], qdd[2] = d1, d2, d3 - d2


@gufunc("(n),(),(n)->(n)")
def foot_position_ufunc(lengths: np.ndarray, left: float, q: np.ndarray, foot: np.ndarray) -> None:
    """Apply `forward_kinematics` to each sample."""
    foot[0], foot[1], foot[2] = forward_kinematics(lengths, left, q[0], q[1], q[2])


@gufunc("(n),(),(n)->(n),()")
def inverse_kinematics_ufunc(
    lengths: np.ndarray, left: float, p: np.ndarray, q: np.ndarray, margin: np.ndarray
) -> None:
    """Apply `inverse_kinematics` to each sample."""
    q[0], q[1], q[2], margin[0] = inverse_kinematics(lengths, left, p[0], p[1], p[2], 1.0)


@gufunc("(n),(),(n)->(n,n)")
def foot_jacobian_ufunc(lengths: np.ndarray, left: float, q: np.ndarray, J: np.ndarray) -> None:
    """Apply `foot_jacobian` to each sample."""
    foot_jacobian(lengths, left, q[0], q[1], q[2], J)


@gufunc("(n),(),(n),(n)->(n,n)")
def contact_jacobian_ufunc(
    lengths: np.ndarray, left: float, q: np.ndarray, offset: np.ndarray, J: np.ndarray
) -> None:
    """Apply `foot_jacobian` and `add_offset` to each sample."""
    foot_jacobian(lengths, left, q[0], q[1], q[2], J)
    add_offset(q[0], offset[0], offset[1], offset[2], J)


joint_motion_ufunc = gufunc("(n),(),(n),(n),(n)->(n),(n)")(joint_motion)
"""Apply `joint_motion` to each sample."""
