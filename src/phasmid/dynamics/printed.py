"""The paper's dynamics of a leg as printed, for study only; each misprint can be corrected alone.

The paper has no lateral offsets: these functions ignore those of a leg.
"""

from __future__ import annotations

from collections.abc import Collection
from enum import StrEnum

import numpy as np
from jaxtyping import Float

from phasmid.dynamics.matrices import LegMatrices, link_arrays
from phasmid.kinematics import jacobian
from phasmid.kinematics.frames import Samples, matrix
from phasmid.robot import Leg, LegArrays


class LegMisprint(StrEnum):
    """Misprints of Table 2, Eqs. 10 and 11; docs/errata.md describes each.

    `THETA_3_AS_FED` is a sign convention: Eq. 9 gives a negative angle of the tibia, and Eq. 10
    needs it positive inside its sines and cosines. No other misprint has a larger effect.
    """

    TABLE_2_UNIT = "table-2-unit"
    M11_COXA_SIGN = "m11-coxa-sign"
    M11_HALF_TIBIA_BRACKET = "m11-half-tibia-bracket"
    M11_HALF_TIBIA_MASS = "m11-half-tibia-mass"
    M11_NO_FEMUR = "m11-no-femur"
    M11_NO_KNEE = "m11-no-knee"
    M22_NO_TIBIA = "m22-no-tibia"
    B11_HALF = "b11-half"
    B12_SAME_INERTIA = "b12-same-inertia"
    B12_SIGN = "b12-sign"
    C21_NO_PLUS = "c21-no-plus"
    C21_EXTRA_TERM = "c21-extra-term"
    C23_TWICE = "c23-twice"
    C31_NO_PLUS = "c31-no-plus"
    EQ_11_SIGN = "eq-11-sign"
    THETA_3_AS_FED = "theta-3-as-fed"


EQ_10 = frozenset(each for each in LegMisprint if each.name.startswith(("M11_", "M22_", "B", "C")))
"""Every misprint of Eq. 10."""

EQ_11 = EQ_10 | {LegMisprint.EQ_11_SIGN}
"""Every misprint of Eqs. 10 and 11."""

UNIT_AS_PRINTED = 1e-6
"""Table 2 gives inertias in 10⁻⁶ g·mm² where it means g·mm²."""


def printed_leg_matrices(
    leg: Leg | LegArrays,
    q: Float[np.ndarray, "*#batch 3"],
    *,
    gravity: float,
    misprints: Collection[str] = EQ_10,
) -> LegMatrices:
    """Matrices of Eq. 10 as printed, or with some of their misprints corrected.

    The paper's form assumes centres of mass at mid-length and principal inertias; other offsets
    and products of inertia are ignored; ``phasmid.robot.with_mass_model(robot, "mid-length")``
    makes legs of that kind. Its θ3 is minus Table 1's inside sines and cosines only:
    then, and only then, do the printed m23, m33, b23, c32 and G hold. Speeds and accelerations
    keep Table 1's sign, since with a mirrored θ3' the coupling m23 would be negative.

    Args:
        leg: The leg, or a robot's ``arrays``; masses, lengths and principal inertias are used.
        q: Coxa, femur and tibia angles in Table 1's signs [rad], shape (..., 3).
        gravity: Acceleration of free fall, downwards along the hip's z [m/s²].
        misprints: Those kept (`LegMisprint`). With none it is the correct equation in the
            paper's form.

    Returns:
        M, B, C and G.

    Source: Eq. 10 as printed. A lower-case l is a length, I_{xx3-Iyy3} a difference; where a plus
    is missing, the factors that then stand side by side are multiplied, in SI.
    """
    kept = frozenset(map(LegMisprint, misprints))
    lengths, mass, _, inertia = link_arrays(leg)
    _, t2, theta3 = np.moveaxis(q, -1, 0)
    g = gravity
    L1, L2, L3 = np.moveaxis(lengths, -1, 0)
    m1, m2, m3 = np.moveaxis(mass, -1, 0)
    inertia = np.moveaxis(np.diagonal(inertia, axis1=-2, axis2=-1), (-2, -1), (0, 1))
    if LegMisprint.TABLE_2_UNIT in kept:
        inertia = UNIT_AS_PRINTED * inertia
    (_, _, Izz1), (Ixx2, Iyy2, Izz2), (Ixx3, Iyy3, Izz3) = inertia
    t3 = theta3 if LegMisprint.THETA_3_AS_FED in kept else -theta3
    cos, sin = np.cos, np.sin

    def pick(misprint: LegMisprint, *, printed: Samples, right: Samples) -> Samples:
        return printed if misprint in kept else right

    one = np.ones(np.broadcast(t2, L1).shape)
    zero = 0 * one
    m11 = (
        Ixx2 + Ixx3 / 2 + Iyy3 / 2
        + pick(LegMisprint.M11_COXA_SIGN, printed=-Izz1, right=Izz1)
        + (Iyy2 - Ixx2) * cos(t2)**2
        + cos(2 * t2 - 2 * t3) / 2 * (
            Iyy3 - Ixx3
            + pick(LegMisprint.M11_HALF_TIBIA_BRACKET, printed=L3**2 * m3 / 8, right=L3**2 * m3 / 4)
        )
        + L3**2 * m3 / 8 + L1**2 * (m1 / 4 + m2 + m3)
        + L1 * L2 * cos(t2) * pick(
            LegMisprint.M11_HALF_TIBIA_MASS, printed=m2 + m3, right=m2 + 2 * m3
        )
        + pick(LegMisprint.M11_NO_FEMUR, printed=zero, right=L2**2 * (m2 / 4 + m3) * cos(t2)**2)
        + L3 * m3 * (
            L2 * cos(t3) / 2 + L1 * cos(t2 - t3)
            + pick(LegMisprint.M11_NO_KNEE, printed=zero, right=L2 * cos(2 * t2 - t3) / 2)
        )
    )  # fmt: skip
    m22 = (
        Izz2 + pick(LegMisprint.M22_NO_TIBIA, printed=zero, right=Izz3 * one)
        + L2**2 * (m2 / 4 + m3) + L3 * m3 * (L3 / 4 + L2 * cos(t3))
    )  # fmt: skip
    m23 = Izz3 + L3 * m3 * (L3 / 4 + L2 * cos(t3) / 2)
    m33 = (Izz3 + L3**2 * m3 / 4) * one

    b11 = pick(LegMisprint.B11_HALF, printed=one, right=2 * one) * (
        sin(2 * t2) / 2 * (Ixx2 - Iyy2 - L2**2 * m2 / 4 - L2**2 * m3)
        + sin(2 * t2 - 2 * t3) / 2 * (Ixx3 - Iyy3 - L3**2 * m3 / 4)
        - L1 * L2 * sin(t2) * (m2 / 2 + m3)
        - L3 * m3 / 2 * (L1 * sin(t2 - t3) + L2 * sin(2 * t2 - t3))
    )
    b12 = (
        sin(2 * t2 - 2 * t3) * (
            Ixx3 - pick(LegMisprint.B12_SAME_INERTIA, printed=Ixx3, right=Iyy3) - L3**2 * m3 / 4
        )
        - L3 * m3 * (
            pick(LegMisprint.B12_SIGN, printed=L2 * sin(t3) / 2, right=-L2 * sin(t3) / 2)
            + L1 * sin(t2 - t3) + L2 * sin(2 * t2 - t3) / 2
        )
    )  # fmt: skip
    b23 = L2 * L3 * m3 * sin(t3)

    femur = L2**2 * m2 / 4
    c21 = (
        sin(2 * t2) / 2 * (
            Iyy2 - pick(LegMisprint.C21_NO_PLUS, printed=Ixx2 * femur, right=Ixx2 - femur)
            + L2**2 * m3
        )
        + sin(2 * t2 - 2 * t3) / 2 * (Iyy3 - Ixx3 + L3**2 * m3 / 4)
        + pick(LegMisprint.C21_EXTRA_TERM, printed=L2 * L3 * m3 * sin(t3) / 2, right=zero)
        + L3 * m3 / 2 * (L1 * sin(t2 - t3) + L2 * sin(2 * t2 - t3))
        + L1 * L2 * sin(t2) * (m3 + m2 / 2)
    )  # fmt: skip
    c23 = pick(
        LegMisprint.C23_TWICE, printed=L2 * L3 * m3 * sin(t3), right=L2 * L3 * m3 * sin(t3) / 2
    )
    coxa, knee = L1 * sin(t2 - t3), L2 * sin(2 * t2 - t3) / 2
    c31 = (
        sin(2 * t2 - 2 * t3) / 2 * (Iyy3 - Ixx3 + L3**2 * m3 / 4)
        + L3 * m3 / 2 * (
            pick(LegMisprint.C31_NO_PLUS, printed=coxa * knee, right=coxa + knee)
            - L2 * sin(t3) / 2
        )
    )  # fmt: skip
    c32 = -L2 * L3 * m3 * sin(t3) / 2

    tibia = g * L3 * m3 * cos(t2 - t3) / 2
    return LegMatrices(
        M=matrix([m11, zero, zero], [zero, m22, m23], [zero, m23, m33]),
        B=matrix([b11, b12, zero], [zero, zero, b23], [zero, zero, zero]),
        C=matrix([zero, zero, zero], [c21, zero, c23], [c31, c32, zero]),
        G=np.stack(
            [zero, g * L2 * m2 * cos(t2) / 2 + g * L2 * m3 * cos(t2) + tibia, tibia], axis=-1
        ),
    )


def printed_leg_torque(
    leg: Leg | LegArrays,
    q: Float[np.ndarray, "*#batch 3"],
    qd: Float[np.ndarray, "*#batch 3"],
    qdd: Float[np.ndarray, "*#batch 3"],
    *,
    foot_force: Float[np.ndarray, "*#batch 3"] | None = None,
    gravity: float,
    misprints: Collection[str] = EQ_11,
) -> Float[np.ndarray, "*batch 3"]:
    """Joint torques of Eq. 11 as printed, or with some of its misprints corrected.

    Arguments and result are those of `leg_torque`, with gravity along the hip's z, and
    ``misprints`` those kept, by name (`LegMisprint`).

    Source: Eqs. 10 and 11 as printed.
    """
    kept = frozenset(map(LegMisprint, misprints))
    w1, w2, w3 = np.moveaxis(qd, -1, 0)
    M, B, C, torque = printed_leg_matrices(leg, q, gravity=gravity, misprints=kept)
    products = np.stack([w1 * w2, w1 * w3, w2 * w3], axis=-1)
    for each, by in ((M, qdd), (B, products), (C, np.square(qd))):
        torque = torque + np.einsum("...ij,...j->...i", each, by)
    if foot_force is None:
        return np.asarray(torque)
    sign = 1 if LegMisprint.EQ_11_SIGN in kept else -1
    return np.asarray(torque + sign * np.einsum("...ij,...i->...j", jacobian(leg, q), foot_force))
