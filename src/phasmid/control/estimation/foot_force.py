"""Ground force on a foot from the torques of its leg's joints."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import internal
from phasmid.control.estimation.state import EstimatorParameters
from phasmid.units import STANDARD_GRAVITY

LEAST_BEND = 0.2
"""Sine of the angle between the lines from femur and tibia joint to the foot, below which the leg
is stretched and torques do not determine the force."""


@internal
def normal_force(
    parameters: EstimatorParameters,
    leg: int,
    q: Float[np.ndarray, "3"],
    torque: Float[np.ndarray, "3"],
) -> float:
    """Return the ground force on a foot at rest along its hip's z axis, with the links' weight.

    The virtual power of the foot's force at femur and tibia joint equals that of the torques less
    that of the links' weight: two equations for the outward and the upward force. It is NaN where
    the leg is stretched.
    """
    lengths, mass, com = parameters.lengths[leg], parameters.mass[leg], parameters.com[leg]
    s2, c2 = math.sin(q[1]), math.cos(q[1])
    s3, c3 = math.sin(q[1] + q[2]), math.cos(q[1] + q[2])
    femur, tibia = lengths[1], lengths[2]
    # The links' weights act on the joints by m g times the horizontal lever.
    lever_femur = com[1, 0] * c2 - com[1, 1] * s2
    lever_tibia = com[2, 0] * c3 - com[2, 1] * s3
    weight3 = STANDARD_GRAVITY * mass[2] * lever_tibia
    weight2 = STANDARD_GRAVITY * (mass[1] * lever_femur + mass[2] * femur * c2) + weight3
    # torque = weight - J^T F, J the derivatives of the foot's outward and upward position.
    out3, up3 = -tibia * s3, tibia * c3
    out2, up2 = -femur * s2 + out3, femur * c2 + up3
    rest2, rest3 = weight2 - torque[1], weight3 - torque[2]
    det = out2 * up3 - out3 * up2
    if abs(det) < LEAST_BEND * femur * tibia:
        return math.nan
    return (out2 * rest3 - out3 * rest2) / det
