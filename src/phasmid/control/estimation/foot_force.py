"""What a foot carries, by the torques of its leg's joints."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import internal

LEAST_BEND = 0.2
"""Sine of the angle between the lines from femur and tibia joints to the foot below which torques
tell no force: the leg is stretched."""


@internal
def foot_forces(
    q: Float[np.ndarray, "legs 3"],
    torque: Float[np.ndarray, "legs 3"],
    lengths: Float[np.ndarray, "legs 3"],
    mass: Float[np.ndarray, "legs 3"],
    com: Float[np.ndarray, "legs 3 3"],
    gravity: float,
    force: Float[np.ndarray, " legs"],
) -> None:
    """Force of the ground on each foot along its hip's z axis, at rest, with the legs' weight.

    The power of the foot's force on a virtual motion of femur and tibia joint is what their torques
    do, less what the links' weight does: two equations for the forces outwards and upwards.

    Args:
        q: Joint angles [rad], shape (L, 3).
        torque: Of the joints on their outer links [N·m], shape (L, 3).
        lengths: Of the links [m], shape (L, 3).
        mass: Of the links [kg], shape (L, 3).
        com: Centres of mass in the links' frames [m], shape (L, 3, 3).
        gravity: Acceleration of free fall along the hip's -z [m/s²].
        force: Is written: upward force [N], NaN where the leg is stretched, shape (L,).
    """
    for i in range(q.shape[0]):
        s2, c2 = math.sin(q[i, 1]), math.cos(q[i, 1])
        s3, c3 = math.sin(q[i, 1] + q[i, 2]), math.cos(q[i, 1] + q[i, 2])
        femur, tibia = lengths[i, 1], lengths[i, 2]
        # The links' weights turn the joints by m g times the lever outwards.
        lever_femur = com[i, 1, 0] * c2 - com[i, 1, 1] * s2
        lever_tibia = com[i, 2, 0] * c3 - com[i, 2, 1] * s3
        own3 = gravity * mass[i, 2] * lever_tibia
        own2 = gravity * (mass[i, 1] * lever_femur + mass[i, 2] * femur * c2) + own3
        # torque = own - J^T F, J the derivatives of the foot's place outwards and upwards.
        along3, up3 = -tibia * s3, tibia * c3
        along2, up2 = -femur * s2 + along3, femur * c2 + up3
        rest2, rest3 = own2 - torque[i, 1], own3 - torque[i, 2]
        det = along2 * up3 - along3 * up2
        if abs(det) < LEAST_BEND * femur * tibia:
            force[i] = math.nan
        else:
            force[i] = (along2 * rest3 - along3 * rest2) / det
