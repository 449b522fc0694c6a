"""Admittance of the feet: a virtual mass, spring and damper each."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from phasmid.compiled import internal

if TYPE_CHECKING:
    from phasmid.control.estimation.state import EstimatorParameters, EstimatorState


MASS = 1.0
"""Virtual mass of a foot [kg]."""

SWING_STIFFNESS, STANCE_STIFFNESS = 500.0, 2000.0
"""Virtual stiffness of a foot in the air, and of one that stands [N/m]."""

LARGEST_OFFSET = 0.01
"""Largest offset of a foot [m]."""


def transition(
    stiffness: float, dt: float
) -> tuple[Float[np.ndarray, "2 2"], Float[np.ndarray, "2"]]:
    """Return the exact step of the critically damped m x'' + 2 √(k m) x' + k x = f.

    Args:
        stiffness: k [N/m].
        dt: Time step [s].

    Returns:
        A and b with (x, x') after the step = A (x, x') + b f for constant f.
    """
    w = math.sqrt(stiffness / MASS)
    A = math.exp(-w * dt) * np.array([[1 + w * dt, dt], [-w * w * dt, 1 - w * dt]])
    return A, (np.array([1.0, 0.0]) - A[:, 0]) / stiffness


@internal
def apply_admittance(
    com: Float[np.ndarray, " xyz"],
    p_odom_foot: Float[np.ndarray, "legs 3"],
    kind: int,
    estimator: EstimatorState,
    parameters: EstimatorParameters,
) -> None:
    """Step the offsets of the feet: upwards where a foot bears more than its share.

    Where sensors of this `SensorKind` have no reading, a foot is taken to bear its share.
    """
    share_weight(com, p_odom_foot, estimator, parameters)
    for leg in range(parameters.leg_count):
        foot, law, force = estimator.feet[leg], parameters.swing_law, 0.0
        if foot.standing != 0:
            law = parameters.stance_law
            excess = foot.sensors[kind].reading - foot.desired_force
            force = excess if math.isfinite(excess) else 0.0
        x, v = foot.offset, foot.offset_velocity
        foot.offset = law.A[0, 0] * x + law.A[0, 1] * v + law.b[0] * force
        foot.offset_velocity = law.A[1, 0] * x + law.A[1, 1] * v + law.b[1] * force
        if abs(foot.offset) > LARGEST_OFFSET:
            foot.offset = math.copysign(LARGEST_OFFSET, foot.offset)
            foot.offset_velocity = 0.0


@internal
def share_weight(
    com: Float[np.ndarray, " xyz"],
    p_odom_foot: Float[np.ndarray, "legs 3"],
    estimator: EstimatorState,
    parameters: EstimatorParameters,
) -> None:
    """Share the weight over the standing feet by the forces of least sum of squares, 0 or more."""
    weight = parameters.weight
    n = xx = xy = yy = sx = sy = 0.0
    for leg in range(parameters.leg_count):
        estimator.feet[leg].desired_force = 0.0
        if estimator.feet[leg].standing != 0:
            x, y = p_odom_foot[leg, 0] - com[0], p_odom_foot[leg, 1] - com[1]
            n += 1.0
            sx += x
            sy += y
            xx += x * x
            xy += x * y
            yy += y * y
    if n < 1.0:
        return
    # f = p + q x + r y with (p, q, r) from the sums; those about the feet's own centre decouple.
    mx, my = sx / n, sy / n
    cxx, cxy, cyy = xx - n * mx * mx, xy - n * mx * my, yy - n * my * my
    det = cxx * cyy - cxy * cxy
    q = r = 0.0
    if det > 1e-9:
        q = weight * (-mx * cyy + my * cxy) / det
        r = weight * (-my * cxx + mx * cxy) / det
    for leg in range(parameters.leg_count):
        if estimator.feet[leg].standing != 0:
            x, y = p_odom_foot[leg, 0] - com[0] - mx, p_odom_foot[leg, 1] - com[1] - my
            estimator.feet[leg].desired_force = max(weight / n + q * x + r * y, 0.0)
