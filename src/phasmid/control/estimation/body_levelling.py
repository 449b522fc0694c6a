"""Level the body, or keep it parallel to the ground, with its mass over the feet."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import internal
from phasmid.control.estimation.state import (
    AttitudeSource,
    EstimatorParameters,
    EstimatorState,
)


@internal
def level_body(
    R_odom_body: Float[np.ndarray, "3 3"],
    heading: float,
    height: float,
    estimator: EstimatorState,
    parameters: EstimatorParameters,
) -> None:
    """Compute the lean that levels the body and the shift that puts its mass over the feet.

    The direction of up in odom is R u, with the commanded attitude R and the measured direction u
    in body axes. It holds the slope of the ground and all compliance of legs and servos. The body
    follows its mean over the levelling time, as an integral controller would. Where u is not
    trusted the corrections decay.
    """
    settings, dt, levelling = parameters.settings, parameters.dt, estimator.levelling
    plane, up_body = estimator.ground_plane, estimator.attitude.up
    trusted = estimator.attitude.source != AttitudeSource.NONE
    up, ease = levelling.up, -math.expm1(-dt / settings.ease_time)
    share = ease
    if trusted:
        share = -math.expm1(-dt / settings.level_time) if levelling.started != 0 else 1.0
    levelling.started = 1
    for i in range(3):
        seen = 1.0 if i == 2 else 0.0
        if trusted:
            seen = 0.0
            for k in range(3):
                seen += R_odom_body[i, k] * up_body[k]
        up[i] += share * (seen - up[i])
    size = math.sqrt(up[0] ** 2 + up[1] ** 2 + up[2] ** 2)
    # In the axes of the path.
    c, s = math.cos(heading), math.sin(heading)
    ux, uy, uz = up[0] / size, up[1] / size, up[2] / size
    ux, uy = c * ux + s * uy, -s * ux + c * uy
    slope_x = c * plane.slope_x + s * plane.slope_y
    slope_y = -s * plane.slope_x + c * plane.slope_y
    # The body's z lies between the ground's normal and up.
    nz = 1.0 / math.sqrt(1.0 + slope_x**2 + slope_y**2)
    nx, ny = -slope_x * nz, -slope_y * nz
    level = settings.level if trusted else 0.0
    zx, zy, zz = nx + level * (ux - nx), ny + level * (uy - ny), nz + level * (uz - nz)
    size = math.sqrt(zx * zx + zy * zy + zz * zz)
    roll, pitch = limit(-math.asin(zy / size), math.atan2(zx, zz), settings.level_limit)
    # The vertical through a point at the height meets the plane beside its foot.
    fall = settings.shift * height * nz / max(ux * nx + uy * ny + uz * nz, 0.5)
    forward, lateral = limit(fall * ux, fall * uy, settings.shift_limit)
    decay = 1.0 if trusted else ease
    droll, dpitch = step(
        roll - levelling.roll, pitch - levelling.pitch, settings.level_rate * dt, decay
    )
    levelling.roll += droll
    levelling.pitch += dpitch
    dx, dy = step(
        forward - levelling.forward, lateral - levelling.lateral, settings.shift_rate * dt, decay
    )
    levelling.forward += dx
    levelling.lateral += dy
    # Along the ground.
    levelling.rise = slope_x * levelling.forward + slope_y * levelling.lateral


@internal
def limit(x: float, y: float, most: float) -> tuple[float, float]:
    """Shorten a vector to a length."""
    size = math.hypot(x, y)
    return (x * most / size, y * most / size) if size > most else (x, y)


@internal
def step(x: float, y: float, most: float, decay: float) -> tuple[float, float]:
    """Shorten a step to a length, and to a share of itself where that is less."""
    return limit(x, y, min(most, math.hypot(x, y) * decay))
