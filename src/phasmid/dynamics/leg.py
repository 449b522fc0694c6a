"""Closed-form dynamics of one leg on a trunk that is fixed in space and level."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.dynamics.inertia import moments_about_origin
from phasmid.dynamics.matrices import LegMatrices, hip_gravity, link_arrays
from phasmid.dynamics.printed import printed_leg_matrices, printed_leg_torque
from phasmid.kinematics.arguments import as_printed, number, threes
from phasmid.kinematics.leg import jacobian_of
from phasmid.kinematics.matrices import Samples, matrix
from phasmid.robot import Leg, LegArrays
from phasmid.units import STANDARD_GRAVITY


class _Elevated(NamedTuple):
    """The leg's dynamics in coxa angle and absolute elevations (q1, q2, q2 + q3).

    In these coordinates the kinetic energy is half the form h over their speeds, h11 depends on
    both elevations, h12 on the femur's, h13 on the tibia's and h23 on their difference alone.
    """

    h11: Samples
    h12: Samples
    h13: Samples
    h22: Samples
    h23: Samples
    h33: Samples
    h11_by_2: Samples
    h11_by_3: Samples
    h12_by_2: Samples
    h13_by_3: Samples
    h23_by_3: Samples
    g1: Samples
    g2: Samples
    g3: Samples


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
    links = link_arrays(leg)
    (angles,) = threes(leg, q=q)
    e = _elevated(*links, angles, *hip_gravity(leg, number("gravity", gravity)))
    zero = np.zeros(e.h11.shape)
    m12, m23 = e.h12 + e.h13, e.h23 + e.h33
    bend = e.h23_by_3
    rise = e.h11_by_2 + e.h11_by_3
    return LegMatrices(
        M=matrix(
            [e.h11, m12, e.h13],
            [m12, e.h22 + e.h23 + m23, m23],
            [e.h13, m23, e.h33],
        ),
        B=matrix(
            [rise, e.h11_by_3, 2 * e.h13_by_3],
            [zero, zero, 2 * bend],
            [zero, zero, zero],
        ),
        C=matrix(
            [zero, e.h12_by_2 + e.h13_by_3, e.h13_by_3],
            [-rise / 2, zero, bend],
            [-e.h11_by_3 / 2, -bend, zero],
        ),
        G=_vector(zero + e.g1, e.g2 + e.g3, e.g3),
    )


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
    links, loads = link_arrays(leg), {} if foot_force is None else {"foot_force": foot_force}
    angles, speeds, accelerations, *force = threes(leg, q=q, qd=qd, qdd=qdd, **loads)
    motion = angles, speeds, accelerations, force[0] if force else None
    return _vector(*torque_of(*links, *motion, *hip_gravity(leg, number("gravity", gravity))))


def torque_of(
    lengths: np.ndarray,
    mass: np.ndarray,
    com: np.ndarray,
    inertia: np.ndarray,
    q: np.ndarray,
    qd: np.ndarray,
    qdd: np.ndarray,
    foot_force: np.ndarray | None,
    gravity: Samples | float,
    aside: tuple[Samples, Samples] | None = None,
) -> tuple[Samples, Samples, Samples]:
    """Torques of coxa, femur and tibia.

    Args:
        lengths: Link lengths, shape (..., 3), as in ``LegArrays``; so mass, com and inertia.
        mass: Link masses.
        com: Centres of mass.
        inertia: About the centres of mass.
        q: Joint angles with the joints in front, shape (3, ...); so qd, qdd and foot_force.
        qd: Joint speeds.
        qdd: Joint accelerations.
        foot_force: Force of the ground on the foot in hip axes, or none.
        gravity: Acceleration of free fall, downwards along the hip's z.
        aside: The same along its x and y, where it is tilted.
    """
    e = _elevated(lengths, mass, com, inertia, q, gravity, aside)
    w1, w2, w3 = _elevation_rates(qd)
    a1, a2, a3 = _elevation_rates(qdd)
    along_1 = (e.h11 * a1 + e.h12 * a2 + e.h13 * a3 + w1 * (e.h11_by_2 * w2 + e.h11_by_3 * w3)) + (
        e.h12_by_2 * w2**2 + e.h13_by_3 * w3**2 + e.g1
    )
    along_2 = (e.h12 * a1 + e.h22 * a2 + e.h23 * a3 + e.g2) + (
        e.h23_by_3 * w3**2 - e.h11_by_2 * w1**2 / 2
    )
    along_3 = (e.h13 * a1 + e.h23 * a2 + e.h33 * a3 + e.g3) - (
        e.h23_by_3 * w2**2 + e.h11_by_3 * w1**2 / 2
    )
    torque = along_1, along_2 + along_3, along_3
    if foot_force is None:
        return torque
    columns = zip(*jacobian_of(np.moveaxis(lengths, -1, 0), q), strict=True)
    x, y, z = foot_force
    t1, t2, t3 = (
        t - (jx * x + jy * y + jz * z) for t, (jx, jy, jz) in zip(torque, columns, strict=True)
    )
    return t1, t2, t3


def _elevated(
    lengths: np.ndarray,
    mass: np.ndarray,
    com: np.ndarray,
    inertia: np.ndarray,
    q: np.ndarray,
    gravity: Samples | float,
    aside: tuple[Samples, Samples] | None,
) -> _Elevated:
    q1, q2, q3 = q
    c2, s2, c3, s3 = np.cos(q2), np.sin(q2), np.cos(q2 + q3), np.sin(q2 + q3)
    cos_bend, sin_bend = c3 * c2 + s3 * s2, s3 * c2 - c3 * s2

    coxa, femur = lengths[..., 0], lengths[..., 1]
    m2, m3 = mass[..., 1], mass[..., 2]
    first, second = moments_about_origin(mass, com, inertia)
    x3, y3, z3 = np.moveaxis(first[..., 2, :], -1, 0)
    i1, i2, i3 = np.moveaxis(second, -3, 0)

    # As seen by the femur's axis the tibia's mass sits at the knee, with its own offset in z.
    x2, y2 = first[..., 1, 0] + m3 * femur, first[..., 1, 1]
    yy2 = i2[..., 1, 1] + m3 * femur**2
    zz2 = i2[..., 2, 2] + m3 * femur**2
    xz2 = i2[..., 0, 2] - femur * z3

    out2, up2 = x2 * c2 - y2 * s2, x2 * s2 + y2 * c2
    out3, up3 = x3 * c3 - y3 * s3, x3 * s3 + y3 * c3
    knee = coxa + femur * c2
    spin2, spin2_by_2 = _vertical_inertia(i2[..., 0, 0], yy2, i2[..., 0, 1], c2, s2)
    weight1: Samples = np.float64(0.0)
    weight2, weight3 = gravity * out2, gravity * out3
    if aside is not None:
        c1, s1 = np.cos(q1), np.sin(q1)
        along, across = aside[0] * c1 + aside[1] * s1, aside[1] * c1 - aside[0] * s1
        out = first[..., 0, 0] + (m2 + m3) * coxa + out2 + out3
        # The coxa's y is the other two links' -z.
        left = first[..., 0, 1] - first[..., 1, 2] - z3
        weight1 = across * out - along * left
        weight2, weight3 = weight2 - along * up2, weight3 - along * up3
    spin3, spin3_by_3 = _vertical_inertia(i3[..., 0, 0], i3[..., 1, 1], i3[..., 0, 1], c3, s3)
    return _Elevated(
        h11=i1[..., 2, 2] + (m2 + m3) * coxa**2 + 2 * (coxa * out2 + knee * out3) + spin2 + spin3,
        h12=xz2 * s2 + i2[..., 1, 2] * c2,
        h13=i3[..., 0, 2] * s3 + i3[..., 1, 2] * c3,
        h22=zz2,
        h23=femur * (x3 * cos_bend - y3 * sin_bend),
        h33=i3[..., 2, 2],
        h11_by_2=spin2_by_2 - 2 * (coxa * up2 + femur * s2 * out3),
        h11_by_3=spin3_by_3 - 2 * knee * up3,
        h12_by_2=xz2 * c2 - i2[..., 1, 2] * s2,
        h13_by_3=i3[..., 0, 2] * c3 - i3[..., 1, 2] * s3,
        h23_by_3=-femur * (x3 * sin_bend + y3 * cos_bend),
        g1=weight1,
        g2=weight2,
        g3=weight3,
    )


def _vertical_inertia(
    xx: Samples, yy: Samples, xy: Samples, c: Samples, s: Samples
) -> tuple[Samples, Samples]:
    """Moment about the vertical through a link's axis, and its slope over the elevation.

    The vertical is (sin e, cos e, 0) in the axes of a link of elevation e.
    """
    value = xx * s**2 + yy * c**2 + 2 * xy * s * c
    return value, 2 * ((xx - yy) * s * c + xy * (c**2 - s**2))


def _elevation_rates(rate: np.ndarray) -> tuple[Samples, Samples, Samples]:
    r1, r2, r3 = rate
    return r1, r2, r2 + r3


def _vector(*entries: Samples) -> np.ndarray:
    return np.stack(np.broadcast_arrays(*entries), axis=-1)
