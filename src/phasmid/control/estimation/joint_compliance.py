"""By how much the legs give way: under the body, and in the air under their own weight."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float, Shaped

from phasmid.compiled import internal

SPREAD = 0.03
"""Feet that spread less than this across a line tell nothing of the body's tilt across it [m]."""


@internal
def fit_joint_compliance(
    wanted: Float[np.ndarray, "legs 3"],
    measured: Float[np.ndarray, "legs 3"],
    lengths: Float[np.ndarray, "legs 3"],
    standing: Shaped[np.ndarray, " legs"],
    bearing: Shaped[np.ndarray, " legs"],
    feet: Float[np.ndarray, "legs 3"],
    sag: Float[np.ndarray, " legs"],
) -> float:
    """How much lower the body is than it shall be, and each foot in the air.

    The legs that bear the body tell by their joints how much it is lower over their feet; it is
    stiff, so that a plane through that holds at the other feet, too. These hang lower by that, and
    by what their own joints give way.

    Args:
        wanted: Joint angles [rad], shape (L, 3).
        measured: Joint angles [rad]; legs with others than numbers are left out, shape (L, 3).
        lengths: Of the links [m], shape (L, 3).
        standing: Which feet stand by the plan, shape (L,).
        bearing: Those of them that feel the ground, shape (L,).
        feet: Places of the feet, of which x and y are used [m], shape (L, 3).
        sag: Of feet that do not stand; is changed [m], shape (L,).

    Returns:
        Mean of the body over the feet that bear it [m]; 0 where none does.
    """
    legs = standing.shape[0]
    own = np.zeros(legs)
    count, cx, cy, mean = 0, 0.0, 0.0, 0.0
    for i in range(legs):
        is_at = lengths[i, 1] * math.sin(measured[i, 1])
        is_at += lengths[i, 2] * math.sin(measured[i, 1] + measured[i, 2])
        shall = lengths[i, 1] * math.sin(wanted[i, 1])
        shall += lengths[i, 2] * math.sin(wanted[i, 1] + wanted[i, 2])
        own[i] = is_at - shall
        if bearing[i] and math.isfinite(own[i]):
            count += 1
            cx += feet[i, 0]
            cy += feet[i, 1]
            mean += own[i]
    if count == 0:
        return 0.0
    cx, cy, mean = cx / count, cy / count, mean / count
    xx = yy = count * SPREAD * SPREAD
    xy = xz = yz = 0.0
    for i in range(legs):
        if bearing[i] and math.isfinite(own[i]):
            x, y = feet[i, 0] - cx, feet[i, 1] - cy
            xx += x * x
            xy += x * y
            yy += y * y
            xz += x * (own[i] - mean)
            yz += y * (own[i] - mean)
    det = xx * yy - xy * xy
    a, b = (yy * xz - xy * yz) / det, (xx * yz - xy * xz) / det
    for i in range(legs):
        if not standing[i]:
            told = mean + a * (feet[i, 0] - cx) + b * (feet[i, 1] - cy) - own[i]
            sag[i] = told if math.isfinite(told) else 0.0
    return mean
