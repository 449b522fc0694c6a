"""By how much the legs give way under the body."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Bool, Float

from phasmid.compiled import compiled


@compiled
def mean_sag(
    wanted: Float[np.ndarray, "legs 3"],
    measured: Float[np.ndarray, "legs 3"],
    lengths: Float[np.ndarray, "legs 3"],
    standing: Bool[np.ndarray, " legs"],
) -> float:
    """By how much the hips are lower over their standing feet than they shall be [m].

    Args:
        wanted: Joint angles [rad], shape (L, 3).
        measured: Joint angles [rad]; legs with others than numbers are left out, shape (L, 3).
        lengths: Of the links [m], shape (L, 3).
        standing: Which feet stand, shape (L,).

    Returns:
        Mean over the standing feet; 0 where none stands.
    """
    total, count = 0.0, 0
    for i in range(standing.shape[0]):
        if not standing[i]:
            continue
        low = lengths[i, 1] * math.sin(measured[i, 1])
        low += lengths[i, 2] * math.sin(measured[i, 1] + measured[i, 2])
        high = lengths[i, 1] * math.sin(wanted[i, 1])
        high += lengths[i, 2] * math.sin(wanted[i, 1] + wanted[i, 2])
        if math.isfinite(low):
            total += low - high
            count += 1
    return total / count if count else 0.0
