"""Plane of the ground through the stance feet."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.control.estimation.state import EstimatorParameters, EstimatorState, Plane

FORGETTING_TIME = 1.0
"""Time constant with which the plane forgets a lifted foot [s]."""

SPREAD = 0.03
"""Spread of the feet across a line below which they do not determine the slope across it [m]."""

PLANE_RATE = 1.0
"""Largest rate of the plane's slope [1/s]."""

PLANE_TIME = 0.05
"""Time constant of each of the plane's two lags [s]."""


@compiled
def estimate_plane(
    p_odom_foot: Float[np.ndarray, "legs 3"],
    point: Float[np.ndarray, "3"],
    estimator: EstimatorState,
    parameters: EstimatorParameters,
) -> None:
    """Fit the ground plane to the footholds, and smooth it by two first-order lags.

    The last slopes are the prior. Where the feet spread it fades within few updates, so that a
    plane through all feet is met exactly. The planes' heights hold at a point: x and y [m]; the
    third number, a heading, is not used.
    """
    dt, plane, legs = parameters.dt, estimator.fitted_plane, parameters.leg_count
    for each in (plane, estimator.lagged_plane, estimator.ground_plane):
        each.height += each.slope_x * (point[0] - each.x) + each.slope_y * (point[1] - each.y)
        each.x, each.y = point[0], point[1]
    started = estimator.plane_started != 0
    estimator.plane_started = 1
    points, weights = np.empty((legs, 3)), np.empty(legs)
    fade = math.exp(-dt / FORGETTING_TIME)
    for leg in range(legs):
        foot = estimator.feet[leg]
        foot.foothold_weight *= fade
        if foot.bearing != 0:
            foot.foothold[:] = p_odom_foot[leg]
            foot.foothold_weight = 1.0
        points[leg], weights[leg] = foot.foothold, foot.foothold_weight
    if weights.sum() < 1e-3:
        return
    a0, b0 = plane.slope_x, plane.slope_y
    centre, a, b = fit_plane(points, weights, a0, b0)
    if started:
        share = min(1.0, PLANE_RATE * dt / max(math.hypot(a - a0, b - b0), 1e-300))
        a, b = a0 + share * (a - a0), b0 + share * (b - b0)
    plane.slope_x, plane.slope_y = a, b
    plane.height = centre[2] + a * (point[0] - centre[0]) + b * (point[1] - centre[1])
    share = -math.expm1(-dt / PLANE_TIME) if started else 1.0
    follow_plane(estimator.lagged_plane, plane, share)
    follow_plane(estimator.ground_plane, estimator.lagged_plane, share)


@compiled
def fit_plane(
    points: Float[np.ndarray, "count 3"],
    weights: Float[np.ndarray, " count"],
    slope_x: float,
    slope_y: float,
) -> tuple[Float[np.ndarray, "3"], float, float]:
    """Fit a plane by least squares; return the weighted centre [m], and the slopes along x
    and y.

    Minimise the sum of w (z - h - a x - b y)² + W s² (a - a')² + W s² (b - b')², with the sum W of
    the weights, s the `SPREAD`, and prior slopes a', b'. Across a line of points the slope is the
    prior.
    """
    total = weights.sum()
    centre = weights @ points / total
    p = points - centre
    moments = (p.T * weights) @ p
    prior = total * SPREAD * SPREAD
    xx, xy, yy = moments[0, 0] + prior, moments[0, 1], moments[1, 1] + prior
    xz, yz = moments[0, 2] + prior * slope_x, moments[1, 2] + prior * slope_y
    det = xx * yy - xy * xy
    return centre, (yy * xz - xy * yz) / det, (xx * yz - xy * xz) / det


@compiled
def follow_plane(plane: Plane, target: Plane, share: float) -> None:
    """Move a plane towards a target by a share of the difference."""
    plane.height += share * (target.height - plane.height)
    plane.slope_x += share * (target.slope_x - plane.slope_x)
    plane.slope_y += share * (target.slope_y - plane.slope_y)
