"""How far a walking robot is from toppling."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float


def support_margin(
    feet: Float[np.ndarray, "*batch legs 2"],
    stance: Bool[np.ndarray, "*batch legs"],
    centre_of_mass: Float[np.ndarray, "*batch 2"],
) -> Float[np.ndarray, "*batch"]:
    """Distance of the projected centre of mass from the edge of the support polygon.

    Args:
        feet: Horizontal positions of the feet [m], shape (..., L, 2).
        stance: Which feet stand, shape (..., L).
        centre_of_mass: Its horizontal position, in the same axes [m], shape (..., 2).

    Returns:
        Margin [m], positive inside the polygon, negative outside; minus infinity where fewer
        than three feet stand or they lie on a line, shape (...).
    """
    feet = np.asarray(feet, dtype=float)
    legs = feet.shape[-2]
    margin = np.full(feet.shape[:-2], np.inf)
    edges = np.zeros(feet.shape[:-2], dtype=int)
    for i in range(legs):
        for j in range(legs):
            if i == j:
                continue
            along = feet[..., j, :] - feet[..., i, :]
            length = np.hypot(along[..., 0], along[..., 1])
            ok = stance[..., i] & stance[..., j] & (length > 1e-9)
            inward = np.stack([-along[..., 1], along[..., 0]], axis=-1)
            inward /= np.where(length > 1e-9, length, 1.0)[..., None]
            depth = np.sum((feet - feet[..., i, None, :]) * inward[..., None, :], axis=-1)
            # An edge of the polygon, counter-clockwise, has every standing foot on its left.
            hull = ok & np.all(~stance | (depth > -1e-12), axis=-1)
            hull &= np.any(stance & (depth > 1e-9), axis=-1)
            inside = np.sum((centre_of_mass - feet[..., i, :]) * inward, axis=-1)
            margin = np.where(hull, np.minimum(margin, inside), margin)
            edges += hull
    return np.where(edges >= 3, margin, -np.inf)
