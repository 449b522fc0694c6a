"""Deflection of the legs: of the body over its feet, and of feet in the air."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import internal
from phasmid.control.estimation.ground_plane import fit_plane
from phasmid.control.estimation.state import EstimatorParameters, EstimatorState

SPREAD = 0.03
"""Spread of the feet across a line below which they do not determine the body's tilt [m]."""


@internal
def estimate_compliance(
    target: Float[np.ndarray, "legs 3"],
    measured: Float[np.ndarray, "legs 3"],
    p_odom_foot: Float[np.ndarray, "legs 3"],
    estimator: EstimatorState,
    parameters: EstimatorParameters,
) -> float:
    """Estimate the height that each foot in the air lacks; return the mean that the body lacks [m].

    The joints of the bearing legs show how much lower the body is over their feet. The body is
    rigid, so that a plane through these heights holds at the other feet. Those hang lower by it and
    by the deflection of their own joints.
    """
    legs = parameters.leg_count
    points, weights = np.empty((legs, 3)), np.zeros(legs)
    for leg in range(legs):
        foot, lengths = estimator.feet[leg], parameters.lengths[leg]
        foot.deflection = foot_height(lengths, measured[leg]) - foot_height(lengths, target[leg])
        points[leg] = p_odom_foot[leg]
        points[leg, 2] = 0.0
        if foot.bearing != 0 and math.isfinite(foot.deflection):
            points[leg, 2] = foot.deflection
            weights[leg] = 1.0
    if weights.sum() == 0.0:
        return 0.0
    centre, a, b = fit_plane(points, weights, SPREAD, 0.0, 0.0)
    for leg in range(legs):
        foot = estimator.feet[leg]
        if foot.standing == 0:
            x, y = points[leg, 0] - centre[0], points[leg, 1] - centre[1]
            sag = centre[2] + a * x + b * y - foot.deflection
            foot.sag = sag if math.isfinite(sag) else 0.0
    return centre[2]


@internal
def foot_height(lengths: Float[np.ndarray, "3"], q: Float[np.ndarray, "3"]) -> float:
    """Return the height of a foot over its femur joint [m]."""
    return lengths[1] * math.sin(q[1]) + lengths[2] * math.sin(q[1] + q[2])
