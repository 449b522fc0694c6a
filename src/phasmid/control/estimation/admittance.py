"""Admittance of the feet: a virtual mass, spring and damper each."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from phasmid.compiled import internal

if TYPE_CHECKING:
    from phasmid.control.estimation.state import EstimatorParameters, EstimatorState


def transition(
    mass: float, stiffness: float, damping_ratio: float, dt: float
) -> tuple[Float[np.ndarray, "2 2"], Float[np.ndarray, "2"]]:
    """Return the exact step of m x'' + d x' + k x = f for constant f; stable for any step.

    Args:
        mass: m [kg].
        stiffness: k [N/m].
        damping_ratio: d over 2 √(k m).
        dt: Time step [s].

    Returns:
        A and b with (x, x') after the step = A (x, x') + b f.
    """
    w, zeta = math.sqrt(stiffness / mass), damping_ratio
    if abs(zeta - 1) < 1e-6:
        c, s = 1.0, dt
        decay = math.exp(-w * dt)
    elif zeta < 1:
        wd = w * math.sqrt(1 - zeta * zeta)
        c, s = math.cos(wd * dt), math.sin(wd * dt) / wd
        decay = math.exp(-zeta * w * dt)
    else:
        # By single exponentials, which do not overflow for long steps.
        wd = w * math.sqrt(zeta * zeta - 1)
        slow, fast = math.exp((wd - zeta * w) * dt), math.exp((-wd - zeta * w) * dt)
        c, s, decay = (slow + fast) / 2, (slow - fast) / (2 * wd), 1.0
    A = decay * np.array([[c + zeta * w * s, s], [-w * w * s, c - zeta * w * s]])
    b = (np.array([1.0, 0.0]) - A[:, 0]) / stiffness
    return A, b


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
    most = parameters.settings.admittance_limit
    for leg in range(parameters.leg_count):
        foot, law, force = estimator.feet[leg], parameters.swing_law, 0.0
        if foot.standing != 0:
            law = parameters.stance_law
            excess = foot.sensors[kind].reading - foot.desired_force
            force = excess if math.isfinite(excess) else 0.0
        x, v = foot.offset, foot.offset_velocity
        foot.offset = law.A[0, 0] * x + law.A[0, 1] * v + law.b[0] * force
        foot.offset_velocity = law.A[1, 0] * x + law.A[1, 1] * v + law.b[1] * force
        if abs(foot.offset) > most:
            foot.offset = math.copysign(most, foot.offset)
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
