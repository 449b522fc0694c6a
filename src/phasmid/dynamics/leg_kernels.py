"""Compiled dynamics of one leg on a fixed trunk: ufuncs that `dynamics.leg` calls, and one instant.

``lengths``, ``mass``, ``first`` and
``second`` are the links' lengths [m], masses [kg], first moments [kg·m] and inertias [kg·m²] about
the origins of their frames, these moved along the femur's axis into the leg's plane; ``left`` is
the foot's offset from that plane, positive to the left [m]; ``gravity`` is the acceleration that
holds a body at rest, in hip axes [m/s²].
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from phasmid.compiled import compiled, gufunc, inlined
from phasmid.kinematics.leg_kernels import Triple, sincos


class Elevated(NamedTuple):
    """The leg's dynamics in coxa angle and absolute elevations (q1, q2, q2 + q3).

    In these coordinates the kinetic energy is half the form h over their speeds, h11 depends on
    both elevations, h12 on the femur's, h13 on the tibia's and h23 on their difference alone.
    """

    h11: float
    h12: float
    h13: float
    h22: float
    h23: float
    h33: float
    h11_by_2: float
    h11_by_3: float
    h12_by_2: float
    h13_by_3: float
    h23_by_3: float
    g1: float
    g2: float
    g3: float


@inlined
def vertical_inertia(xx: float, yy: float, xy: float, c: float, s: float) -> tuple[float, float]:
    """Return a link's inertia about the coxa's direction, and its slope over the elevation.

    That direction is (sin e, cos e, 0) in the axes of a link of elevation e.
    """
    value = xx * s * s + yy * c * c + 2 * xy * s * c
    return value, 2 * ((xx - yy) * s * c + xy * (c * c - s * s))


@inlined
def into_coxa(x: float, y: float, z: float, s: float, c: float) -> Triple:
    """Return a vector in the coxa's axes, which sine and cosine of its angle turn about z."""
    return c * x + s * y, c * y - s * x, z


@inlined
def elevated(
    lengths: np.ndarray,
    mass: np.ndarray,
    first: np.ndarray,
    second: np.ndarray,
    gravity: Triple,
    elevation_2: tuple[float, float],
    elevation_3: tuple[float, float],
) -> Elevated:
    """Return the leg's dynamics from gravity in the coxa's axes and (sine, cosine) of elevations.

    Source: Lagrange's equations for links with any centre of mass and any inertia.
    """
    (s2, c2), (s3, c3) = elevation_2, elevation_3
    cos_bend, sin_bend = c3 * c2 + s3 * s2, s3 * c2 - c3 * s2
    coxa, femur = lengths[0], lengths[1]
    x3, y3, z3 = first[2, 0], first[2, 1], first[2, 2]

    # As seen by the femur's axis the tibia's mass is at the knee, with its own offset in z.
    x2, y2 = first[1, 0] + mass[2] * femur, first[1, 1]
    yy2, zz2 = second[1, 1, 1] + mass[2] * femur**2, second[1, 2, 2] + mass[2] * femur**2
    xz2 = second[1, 0, 2] - femur * z3

    out2, up2 = x2 * c2 - y2 * s2, x2 * s2 + y2 * c2
    out3, up3 = x3 * c3 - y3 * s3, x3 * s3 + y3 * c3
    knee = coxa + femur * c2
    spin2, spin2_by_2 = vertical_inertia(second[1, 0, 0], yy2, second[1, 0, 1], c2, s2)
    spin3, spin3_by_3 = vertical_inertia(second[2, 0, 0], second[2, 1, 1], second[2, 0, 1], c3, s3)
    outer = mass[1] + mass[2]

    out = first[0, 0] + outer * coxa + out2 + out3
    # The coxa's y is the other two links' -z.
    left = first[0, 1] - first[1, 2] - z3
    along, across, upwards = gravity
    return Elevated(
        second[0, 2, 2] + outer * coxa**2 + 2 * (coxa * out2 + knee * out3) + spin2 + spin3,
        xz2 * s2 + second[1, 1, 2] * c2,
        second[2, 0, 2] * s3 + second[2, 1, 2] * c3,
        zz2,
        femur * (x3 * cos_bend - y3 * sin_bend),
        second[2, 2, 2],
        spin2_by_2 - 2 * (coxa * up2 + femur * s2 * out3),
        spin3_by_3 - 2 * knee * up3,
        xz2 * c2 - second[1, 1, 2] * s2,
        second[2, 0, 2] * c3 - second[2, 1, 2] * s3,
        -femur * (x3 * sin_bend + y3 * cos_bend),
        across * out - along * left,
        upwards * out2 - along * up2,
        upwards * out3 - along * up3,
    )


@inlined
def elevation_forces(
    e: Elevated, w1: float, w2: float, w3: float, a1: float, a2: float, a3: float
) -> Triple:
    """Return the generalised forces of coxa angle and elevations for their speeds w and motion a.

    Source: Lagrange's equations in the coordinates of `Elevated`.
    """
    tau1 = e.h11 * a1 + e.h12 * a2 + e.h13 * a3 + e.g1
    tau1 += w1 * (e.h11_by_2 * w2 + e.h11_by_3 * w3) + e.h12_by_2 * w2**2 + e.h13_by_3 * w3**2
    tau2 = e.h12 * a1 + e.h22 * a2 + e.h23 * a3 + e.g2
    tau2 += e.h23_by_3 * w3**2 - e.h11_by_2 * w1**2 / 2
    tau3 = e.h13 * a1 + e.h23 * a2 + e.h33 * a3 + e.g3
    tau3 -= e.h23_by_3 * w2**2 + e.h11_by_3 * w1**2 / 2
    return tau1, tau2, tau3


@compiled
def leg_acceleration(
    lengths: np.ndarray,
    mass: np.ndarray,
    first: np.ndarray,
    second: np.ndarray,
    gravity: np.ndarray,
    q: np.ndarray,
    qd: np.ndarray,
    torque: np.ndarray,
    qdd: np.ndarray,
) -> None:
    """Write the joint accelerations [rad/s²] of a leg in the air under joint torques [N·m].

    Source: `leg_torque_ufunc`, solved for the accelerations.
    """
    (s1, c1), (s2, c2), (s3, c3) = sincos(q[0]), sincos(q[1]), sincos(q[1] + q[2])
    g = into_coxa(gravity[0], gravity[1], gravity[2], s1, c1)
    e = elevated(lengths, mass, first, second, g, (s2, c2), (s3, c3))
    f1, f2, f3 = elevation_forces(e, qd[0], qd[1], qd[1] + qd[2], 0.0, 0.0, 0.0)
    f1, f2, f3 = torque[0] - f1, torque[1] - torque[2] - f2, torque[2] - f3
    # The inverse of the symmetric matrix h by its cofactors.
    i11, i22, i33 = e.h22 * e.h33 - e.h23**2, e.h11 * e.h33 - e.h13**2, e.h11 * e.h22 - e.h12**2
    i12, i13 = e.h13 * e.h23 - e.h12 * e.h33, e.h12 * e.h23 - e.h13 * e.h22
    i23 = e.h12 * e.h13 - e.h11 * e.h23
    determinant = e.h11 * i11 + e.h12 * i12 + e.h13 * i13
    qdd[0] = (i11 * f1 + i12 * f2 + i13 * f3) / determinant
    qdd[1] = (i12 * f1 + i22 * f2 + i23 * f3) / determinant
    qdd[2] = (i13 * f1 + i23 * f2 + i33 * f3) / determinant - qdd[1]


@gufunc("(n),(),(n),(n,n),(n,n,n),(n),(n),(n),(n),(n)->(n)")
def leg_torque_ufunc(
    lengths: np.ndarray,
    left: float,
    mass: np.ndarray,
    first: np.ndarray,
    second: np.ndarray,
    gravity: np.ndarray,
    q: np.ndarray,
    qd: np.ndarray,
    qdd: np.ndarray,
    foot_force: np.ndarray,
    torque: np.ndarray,
) -> None:
    """Write the joint torques [N·m] of a motion and of the ground's force on the foot.

    Source: Eq. 11, corrected: the ground's reaction enters with a minus sign.
    """
    (s1, c1), (s2, c2), (s3, c3) = sincos(q[0]), sincos(q[1]), sincos(q[1] + q[2])
    g = into_coxa(gravity[0], gravity[1], gravity[2], s1, c1)
    e = elevated(lengths, mass, first, second, g, (s2, c2), (s3, c3))
    tau1, tau2, tau3 = elevation_forces(
        e, qd[0], qd[1], qd[1] + qd[2], qdd[0], qdd[1], qdd[1] + qdd[2]
    )
    # The columns of the foot's Jacobian, in the axes of the coxa.
    out3, up3 = lengths[2] * c3, lengths[2] * s3
    out, up = lengths[1] * c2 + out3, lengths[1] * s2 + up3
    fx, fy, fz = into_coxa(foot_force[0], foot_force[1], foot_force[2], s1, c1)
    torque[0] = tau1 - ((lengths[0] + out) * fy - left * fx)
    torque[1] = tau2 + tau3 - (out * fz - up * fx)
    torque[2] = tau3 - (out3 * fz - up3 * fx)


@gufunc("(n),(n),(n,n),(n,n,n),(n),(n)->(n,n),(n,n),(n,n),(n)")
def leg_matrices_ufunc(
    lengths: np.ndarray,
    mass: np.ndarray,
    first: np.ndarray,
    second: np.ndarray,
    gravity: np.ndarray,
    q: np.ndarray,
    M: np.ndarray,
    B: np.ndarray,
    C: np.ndarray,
    G: np.ndarray,
) -> None:
    """Write the matrices of Eq. 10, corrected, from `elevated`, for each sample."""
    s1, c1 = sincos(q[0])
    g = into_coxa(gravity[0], gravity[1], gravity[2], s1, c1)
    e = elevated(lengths, mass, first, second, g, sincos(q[1]), sincos(q[1] + q[2]))
    m12, m23, m33 = e.h12 + e.h13, e.h23 + e.h33, e.h33
    rise = e.h11_by_2 + e.h11_by_3
    M[0, 0], M[0, 1], M[0, 2] = e.h11, m12, e.h13
    M[1, 0], M[1, 1], M[1, 2] = m12, e.h22 + e.h23 + m23, m23
    M[2, 0], M[2, 1], M[2, 2] = e.h13, m23, m33
    B[:], C[:] = 0.0, 0.0
    B[0, 0], B[0, 1], B[0, 2] = rise, e.h11_by_3, 2 * e.h13_by_3
    B[1, 2] = 2 * e.h23_by_3
    C[0, 1], C[0, 2] = e.h12_by_2 + e.h13_by_3, e.h13_by_3
    C[1, 0], C[1, 2] = -rise / 2, e.h23_by_3
    C[2, 0], C[2, 1] = -e.h11_by_3 / 2, -e.h23_by_3
    G[0], G[1], G[2] = e.g1, e.g2 + e.g3, e.g3
