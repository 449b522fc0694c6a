"""The paper's kinematics as printed, for study only; each misprint can be corrected alone.

The prints mix lengths with angles and with squares of lengths, so that their results depend on
the unit; they are computed in the units of Table 1, millimetres and degrees. The paper has no
lateral offsets: these functions ignore those of a leg.
"""

from __future__ import annotations

from collections.abc import Collection
from enum import StrEnum

import numpy as np
from jaxtyping import Float

from phasmid.kinematics.frames import Samples, dh_transform, matrix
from phasmid.robot import Leg, LegArrays
from phasmid.units import UNITS

MM, DEG = UNITS["mm"], UNITS["deg"]


class KinematicMisprint(StrEnum):
    """Misprints of Eqs. 1 to 9 and of T_B^G; docs/errata.md describes each."""

    EQ_1_OFFSET = "eq-1-offset"
    EQ_2_HEIGHT = "eq-2-height"
    BODY_ROTATION = "body-rotation"
    EQ_3_QUADRANT = "eq-3-quadrant"
    EQ_4_DISTANCE = "eq-4-distance"
    EQ_5_QUADRANT = "eq-5-quadrant"
    EQ_6_ROOT = "eq-6-root"
    EQ_7_HEIGHT = "eq-7-height"
    EQ_8_ROOT = "eq-8-root"


AS_PRINTED = frozenset(KinematicMisprint)
"""Every misprint of the paper's kinematics."""


def printed_joint_angles(
    leg: Leg | LegArrays,
    p_hip_foot: Float[np.ndarray, "*batch 3"],
    *,
    misprints: Collection[str] = AS_PRINTED,
) -> Float[np.ndarray, "*batch 3"]:
    """Joint angles of Eqs. 3 to 9 as printed, or with some of their misprints corrected.

    Args:
        leg: The leg, or a robot's ``arrays`` for all legs along the axis before the last.
        p_hip_foot: Foot in the leg's hip frame [m], shape (..., 3).
        misprints: Those kept; with none it is the knee-up solution.

    Returns:
        Coxa, femur and tibia angles in Table 1's signs [rad], shape (..., 3); NaN where an equation
        gives no angle.

    Source: Eqs. 3-9 as printed. Z_offset is the body height, positive over a foot below the hip,
    where Eq. 7 needs the height of the foot; L1 is read as Eq. 10 and Table 2 (L_i) read it,
    as the coxa's length, where Fig. 5 needs the distance of the foot from the coxa axis.
    """
    kept = frozenset(map(KinematicMisprint, misprints))
    x4, y4, z4 = MM.per_si * np.moveaxis(p_hip_foot, -1, 0)
    Lc, LF, LT = MM.per_si * np.moveaxis(leg.lengths, -1, 0)

    def arctan(y: Samples, x: Samples, misprint: KinematicMisprint) -> Samples:
        if misprint not in kept:
            return np.arctan2(y, x)
        return np.arctan(y / x)

    def root(square: Samples, misprint: KinematicMisprint) -> Samples:
        return np.sqrt(square) if misprint in kept else square

    height = np.abs(z4) if KinematicMisprint.EQ_7_HEIGHT in kept else z4
    L1 = Lc + 0 * x4 if KinematicMisprint.EQ_4_DISTANCE in kept else np.hypot(x4, y4)
    # A print without an angle shows as a division by zero or a cosine beyond one.
    with np.errstate(divide="ignore", invalid="ignore"):
        theta1 = arctan(y4, x4, KinematicMisprint.EQ_3_QUADRANT)
        L = np.sqrt(height**2 + (L1 - Lc) ** 2)
        q1 = arctan(height, L1 - Lc, KinematicMisprint.EQ_5_QUADRANT)
        q2 = np.arccos(root(LF**2 + L**2 - LT**2, KinematicMisprint.EQ_6_ROOT) / (2 * LF * L))
        phi = np.arccos(root(LF**2 + LT**2 - L**2, KinematicMisprint.EQ_8_ROOT) / (2 * LF * LT))
    return np.stack([theta1, q1 + q2, phi - np.pi], axis=-1)


def printed_dh_transform(
    alpha: Float[np.ndarray, "*batch"],
    a: Float[np.ndarray, "*batch"],
    d: Float[np.ndarray, "*batch"],
    theta: Float[np.ndarray, "*batch"],
    *,
    misprints: Collection[str] = AS_PRINTED,
) -> Float[np.ndarray, "*batch 4 4"]:
    """Transform between neighbouring frames as printed: the angle alpha stands for the length a.

    Arguments and result are those of `dh_transform`, ``misprints`` those kept. A degree of alpha
    counts as a millimetre.

    Source: Eq. 1 as printed.
    """
    wrong = KinematicMisprint.EQ_1_OFFSET in map(KinematicMisprint, misprints)
    return dh_transform(alpha, alpha * (DEG.per_si / MM.per_si) if wrong else a, d, theta)


def printed_leg_pose(
    p_body_hip: Float[np.ndarray, "*batch 3"],
    yaw: Float[np.ndarray, "*batch"],
    *,
    misprints: Collection[str] = AS_PRINTED,
) -> Float[np.ndarray, "*batch 4 4"]:
    """Pose of a leg in the body as printed: heights are lost.

    Args:
        p_body_hip: Hip in the body frame [m], shape (..., 3).
        yaw: Direction of the leg in the body frame [rad], shape (...).
        misprints: Those kept.

    Returns:
        ``X_body_hip``, shape (..., 4, 4); as printed it is no rigid motion.

    Source: Eq. 2 as printed.
    """
    wrong = KinematicMisprint.EQ_2_HEIGHT in map(KinematicMisprint, misprints)
    x, y, z = np.moveaxis(p_body_hip, -1, 0)
    c, s = np.cos(yaw), np.sin(yaw)
    third = [0.0, 0.0, 0.0, 0.0] if wrong else [0.0, 0.0, 1.0, z]
    return matrix([c, -s, 0.0, x], [s, c, 0.0, y], third, [0.0, 0.0, 0.0, 1.0])


def printed_body_rotation(
    roll: Float[np.ndarray, "*batch"],
    pitch: Float[np.ndarray, "*batch"],
    yaw: Float[np.ndarray, "*batch"],
    *,
    misprints: Collection[str] = AS_PRINTED,
) -> Float[np.ndarray, "*batch 3 3"]:
    """Rotation of the body in the world as printed, the paper's forward axis being y.

    Args:
        roll: Angle about the forward axis y [rad].
        pitch: Angle about the axis x, to the right [rad].
        yaw: Angle about the vertical [rad].
        misprints: Those kept; with none it is Rz(yaw) Rx(pitch) Ry(roll).

    Returns:
        ``R_world_body``, shape (..., 3, 3); as printed it is no rotation.

    Source: T_B^G as printed.
    """
    wrong = KinematicMisprint.BODY_ROTATION in map(KinematicMisprint, misprints)
    ca, sa, cb, sb = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
    cg, sg = np.cos(yaw), np.sin(yaw)
    return matrix(
        [ca * cg - sa * sb * sg, -cb * sg, cg * sa + ca * sb * sg],
        [ca * (cg if wrong else sg) + cg * sa * sb, cb * cg, sa * sg - ca * cg * sb],
        [-cb * sa, sb, ca * cb],
    )
