"""Shift of the body with the largest support margin."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float

CLOSE = 1e-9
"""Tolerance of the best margin [m]."""

SAME_PLACE = 1e-9
"""Feet closer than this stand in one place [m]."""

MOST_CUTS = 60
"""Most iterations; later ones are at round-off."""


def best_place(
    feet: Float[np.ndarray, "samples legs 2"],
    stance: Bool[np.ndarray, "samples legs"],
    centre_of_mass: Float[np.ndarray, "samples 2"],
    farthest: float,
) -> Float[np.ndarray, "2"]:
    """Return the shift of the centre of mass that maximises its least support margin.

    Inside a polygon the margin is the least distance from the lines of its edges. The best shift is
    the solution of a linear programme, to which violated edges are added one by one. Where no shift
    is inside all polygons, it minimises the largest distance outside.

    Args:
        feet: Horizontal positions of the feet [m], shape (N, L, 2).
        stance: Feet that stand, shape (N, L).
        centre_of_mass: Horizontal position, in the same axes [m], shape (N, 2).
        farthest: Largest shift in either axis [m].

    Returns:
        The smallest of the best shifts [m], shape (2,); zero where no sample has a polygon.
    """
    normals, heights = _edges(feet, stance, centre_of_mass)
    chosen = np.empty(0, dtype=int)
    shift = np.zeros(2)
    if not len(heights):
        return shift
    for _ in range(MOST_CUTS):
        margin = normals @ shift + heights
        lowest = int(np.argmin(margin))
        if len(chosen) and margin[lowest] > margin[chosen].min() - CLOSE:
            break
        chosen = np.append(chosen, lowest)
        shift = _top(normals[chosen], heights[chosen], farthest)
    return shift


def _edges(
    feet: Float[np.ndarray, "samples legs 2"],
    stance: Bool[np.ndarray, "samples legs"],
    com: Float[np.ndarray, "samples 2"],
) -> tuple[Float[np.ndarray, "edges 2"], Float[np.ndarray, " edges"]]:
    """Return each edge's inward normal and the distance of the mass inside it [m]."""
    along = feet[:, None, :, :] - feet[:, :, None, :]
    length = np.hypot(along[..., 0], along[..., 1])
    along = along / np.where(length > SAME_PLACE, length, 1.0)[..., None]
    inward = np.stack([-along[..., 1], along[..., 0]], axis=-1)
    # Depth of foot k inside the line from foot i to foot j.
    depth = np.einsum("nikc,nijc->nijk", feet[:, None, :, :] - feet[:, :, None, :], inward)
    edge = stance[:, :, None] & stance[:, None, :] & (length > SAME_PLACE)
    edge &= np.all(~stance[:, None, None, :] | (depth > -1e-3 * SAME_PLACE), axis=-1)
    edge &= np.any(stance[:, None, None, :] & (depth > SAME_PLACE), axis=-1)
    sample, i, _ = np.nonzero(edge)
    normals = inward[edge]
    return normals, np.einsum("ec,ec->e", com[sample] - feet[sample, i], normals)


def _top(
    normals: Float[np.ndarray, "planes 2"], heights: Float[np.ndarray, " planes"], farthest: float
) -> Float[np.ndarray, "2"]:
    """Return the shift with the largest least margin; of equal ones the smallest."""
    count = len(heights)
    sides = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
    # Of shift s and margin r: n · s - r + h >= 0 under each plane, and the box's sides.
    rows = np.vstack([np.column_stack([normals, -np.ones(count)]), sides])
    free = np.concatenate([heights, np.full(4, farthest)])
    chosen = np.array(list(combinations(range(count + 4), 3)))
    matrices = rows[chosen]
    met = np.abs(np.linalg.det(matrices)) > CLOSE
    corners = np.linalg.solve(matrices[met], -free[chosen[met]][..., None])[..., 0]
    corners = corners[np.all(corners @ rows.T + free > -1e-3 * CLOSE, axis=1)]
    level = corners[corners[:, 2] > corners[:, 2].max() - CLOSE]
    return level[np.argmin(np.hypot(level[:, 0], level[:, 1]))][:2]
