"""Level the body, or keep it parallel to the ground, with its mass over the feet."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.control.estimation.state import (
    AttitudeSource,
    EstimatorParameters,
    EstimatorState,
)

LEVEL_TIME = 0.4
"""Time constant of levelling [s]."""

LEVEL_RATE, LEVEL_LIMIT = math.radians(20), math.radians(20)
"""Largest angular velocity [rad/s] and angle of levelling [rad]."""

SHIFT_RATE, SHIFT_LIMIT = 0.05, 0.02
"""Largest velocity [m/s] and length of the shift [m]."""

EASE_TIME = 2.0
"""Time constant with which corrections decay without inertial sensors [s]."""

Vector = Float[np.ndarray, " components"]


@compiled
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
    trusted the corrections decay. The tilt is what the alignment of odom with gravity has not taken
    away yet: that of the last half second.
    """
    dt, levelling, plane = parameters.dt, estimator.levelling, estimator.ground_plane
    trusted = estimator.attitude.source != AttitudeSource.NONE
    ease = -math.expm1(-dt / EASE_TIME)
    share, measured = ease, np.array([0.0, 0.0, 1.0])
    if trusted:
        share = -math.expm1(-dt / LEVEL_TIME) if levelling.started != 0 else 1.0
        measured = R_odom_body @ estimator.attitude.up
    levelling.started = 1
    levelling.tilt = math.hypot(measured[0], measured[1])
    levelling.up += share * (measured - levelling.up)
    # Up, and the normal of the ground, in the axes of the path.
    c, s = math.cos(heading), math.sin(heading)
    R_path_odom = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    up = R_path_odom @ levelling.up
    up /= math.sqrt(up @ up)
    normal = R_path_odom @ np.array([-plane.slope_x, -plane.slope_y, 1.0])
    normal /= math.sqrt(normal @ normal)
    # The body's z lies between the ground's normal and up.
    z = normal + (parameters.level if trusted else 0.0) * (up - normal)
    z /= math.sqrt(z @ z)
    lean = limited(np.array([-math.asin(z[1]), math.atan2(z[0], z[2])]), LEVEL_LIMIT)
    # The vertical through a point at the height meets the plane beside its foot.
    fall = height * normal[2] / max(up @ normal, 0.5)
    shift = limited(fall * up[:2], SHIFT_LIMIT)
    decay = 1.0 if trusted else ease
    levelling.lean += limited(decay * (lean - levelling.lean), LEVEL_RATE * dt)
    levelling.shift += limited(decay * (shift - levelling.shift), SHIFT_RATE * dt)
    # Along the ground.
    levelling.rise = -(normal[0] * levelling.shift[0] + normal[1] * levelling.shift[1]) / normal[2]


@compiled
def limited(vector: Vector, most: float) -> Vector:
    """Shorten a vector to a length."""
    return vector * min(1.0, most / max(math.sqrt(vector @ vector), 1e-300))
