"""The plane of the ground through the standing feet."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float, Shaped

from phasmid.compiled import internal

# What is told of a plane: its height and slopes at a place, and that place.
HEIGHT, SLOPE_X, SLOPE_Y, AT_X, AT_Y = range(5)


@internal
def fit_plane(
    dt: float,
    feet: Float[np.ndarray, "legs 3"],
    standing: Shaped[np.ndarray, " legs"],
    at: Float[np.ndarray, " place"],
    forgetting_time: float,
    spread: float,
    rate: float,
    smoothing_time: float,
    stood: Float[np.ndarray, "legs 4"],
    planes: Float[np.ndarray, "3 5"],
) -> None:
    """Least squares through the feet, drawn to the last plane where they tell nothing.

    Minimises the sum of w (z - h - a x - b y)² + W s² (a - a')² + W s² (b - b')² with the sum W of
    the weights and the last slopes a', b'. Where the feet spread the last plane is forgotten within
    few updates, so that a plane through all feet is met exactly; on a line of feet the slope across
    it stays. Two lags take the corners out of its motion.

    Args:
        dt: Since the last update [s].
        feet: Where they are [m], shape (L, 3).
        standing: Which stand, shape (L,).
        at: Place at which the height is told [m]; its x and y are used.
        forgetting_time: Within it the weight of a lifted foot fades [s].
        spread: s [m].
        rate: Largest change of the slopes [1/s].
        smoothing_time: Of each of the two lags that smooth the plane [s].
        stood: Where each foot stands or stood last [m], and its weight, is changed, shape (L, 4).
        planes: The plane, after one lag and after both: height at a place [m], both slopes and the
            place [m], is changed; NaN height: none yet, shape (3, 5).
    """
    fade = math.exp(-dt / forgetting_time)
    total = cx = cy = cz = 0.0
    for i in range(stood.shape[0]):
        stood[i, 3] *= fade
        if standing[i]:
            stood[i, 0], stood[i, 1], stood[i, 2] = feet[i, 0], feet[i, 1], feet[i, 2]
            stood[i, 3] = 1.0
        w = stood[i, 3]
        total += w
        cx += w * stood[i, 0]
        cy += w * stood[i, 1]
        cz += w * stood[i, 2]
    begun = math.isfinite(planes[0, HEIGHT])
    for k in range(3):
        planes[k, HEIGHT] += planes[k, SLOPE_X] * (at[0] - planes[k, AT_X])
        planes[k, HEIGHT] += planes[k, SLOPE_Y] * (at[1] - planes[k, AT_Y])
        planes[k, AT_X], planes[k, AT_Y] = at[0], at[1]
    plane = planes[0]
    if total < 1e-3:
        return
    cx, cy, cz = cx / total, cy / total, cz / total
    xx = xy = yy = xz = yz = 0.0
    for i in range(stood.shape[0]):
        x, y, z, w = stood[i, 0] - cx, stood[i, 1] - cy, stood[i, 2] - cz, stood[i, 3]
        xx += w * x * x
        xy += w * x * y
        yy += w * y * y
        xz += w * x * z
        yz += w * y * z
    own = total * spread * spread
    a0, b0 = plane[SLOPE_X], plane[SLOPE_Y]
    det = (xx + own) * (yy + own) - xy * xy
    rx, ry = xz + own * a0, yz + own * b0
    a = ((yy + own) * rx - xy * ry) / det
    b = ((xx + own) * ry - xy * rx) / det
    if begun:
        size = math.hypot(a - a0, b - b0)
        if size > rate * dt:
            a, b = a0 + (a - a0) * rate * dt / size, b0 + (b - b0) * rate * dt / size
    plane[SLOPE_X], plane[SLOPE_Y] = a, b
    plane[HEIGHT] = cz + a * (at[0] - cx) + b * (at[1] - cy)
    part = -math.expm1(-dt / smoothing_time)
    for k in range(3):
        if begun:
            planes[1, k] += part * (planes[0, k] - planes[1, k])
            planes[2, k] += part * (planes[1, k] - planes[2, k])
        else:
            planes[1, k] = planes[2, k] = planes[0, k]
