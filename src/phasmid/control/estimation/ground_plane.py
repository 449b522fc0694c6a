"""Plane of the ground through the stance feet."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import internal
from phasmid.control.estimation.state import EstimatorParameters, EstimatorState, Plane

FORGETTING_TIME = 1.0
"""Time constant with which the plane forgets a lifted foot [s]."""

SPREAD = 0.03
"""Spread of the feet across a line below which they do not determine the slope across it [m]."""


@internal
def estimate_plane(
    p_odom_foot: Float[np.ndarray, "legs 3"],
    reference: Float[np.ndarray, " xy"],
    estimator: EstimatorState,
    parameters: EstimatorParameters,
) -> None:
    """Fit the ground plane to the footholds, and smooth it by two first-order lags.

    The last slopes are the prior. Where the feet spread it fades within few updates, so that a
    plane through all feet is met exactly. The planes' heights hold at the reference point.
    """
    settings, dt = parameters.settings, parameters.dt
    plane, legs = estimator.fitted_plane, parameters.leg_count
    for each in (plane, estimator.lagged_plane, estimator.ground_plane):
        move_reference(each, reference)
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
        change, most = math.hypot(a - a0, b - b0), settings.plane_rate
        if change > most * dt:
            a, b = a0 + (a - a0) * most * dt / change, b0 + (b - b0) * most * dt / change
    plane.slope_x, plane.slope_y = a, b
    plane.height = centre[2] + a * (reference[0] - centre[0]) + b * (reference[1] - centre[1])
    share = -math.expm1(-dt / settings.plane_time) if started else 1.0
    follow_plane(estimator.lagged_plane, plane, share)
    follow_plane(estimator.ground_plane, estimator.lagged_plane, share)


@internal
def fit_plane(
    points: Float[np.ndarray, "count 3"],
    weights: Float[np.ndarray, " count"],
    slope_x: float,
    slope_y: float,
) -> tuple[Float[np.ndarray, "3"], float, float]:
    """Fit a plane by least squares; return the weighted centre, and the slopes along x and y.

    Minimise the sum of w (z - h - a x - b y)² + W s² (a - a')² + W s² (b - b')², with the sum W of
    the weights, s the `SPREAD`, and prior slopes a', b'. Across a line of points the slope is the
    prior.
    """
    centre, total = np.zeros(3), 0.0
    for i in range(len(points)):
        total += weights[i]
        for k in range(3):
            centre[k] += weights[i] * points[i, k]
    for k in range(3):
        centre[k] /= total
    xx = xy = yy = xz = yz = 0.0
    for i in range(len(points)):
        w, x, y = weights[i], points[i, 0] - centre[0], points[i, 1] - centre[1]
        z = points[i, 2] - centre[2]
        xx += w * x * x
        xy += w * x * y
        yy += w * y * y
        xz += w * x * z
        yz += w * y * z
    prior = total * SPREAD * SPREAD
    xx, yy, xz, yz = xx + prior, yy + prior, xz + prior * slope_x, yz + prior * slope_y
    det = xx * yy - xy * xy
    return centre, (yy * xz - xy * yz) / det, (xx * yz - xy * xz) / det


@internal
def move_reference(plane: Plane, reference: Float[np.ndarray, " xy"]) -> None:
    """State the height of a plane at another reference point."""
    plane.height += plane.slope_x * (reference[0] - plane.x)
    plane.height += plane.slope_y * (reference[1] - plane.y)
    plane.x, plane.y = reference[0], reference[1]


@internal
def follow_plane(plane: Plane, target: Plane, share: float) -> None:
    """Move a plane towards a target by a share of the difference."""
    plane.height += share * (target.height - plane.height)
    plane.slope_x += share * (target.slope_x - plane.slope_x)
    plane.slope_y += share * (target.slope_y - plane.slope_y)
