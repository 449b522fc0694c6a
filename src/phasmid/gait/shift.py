"""Shift of the body with the largest support margin."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float

CLOSE = 1e-9
"""Tolerance of the best margin [m]."""

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
    # Lazy import: numba takes 0.6 s.
    from phasmid.gait.support_kernels import sample_edges

    samples, legs = stance.shape
    edges, counts = np.empty((samples, legs * legs, 5)), np.empty(samples, dtype=int)
    feet = np.ascontiguousarray(feet, dtype=float)
    sample_edges(feet, np.ascontiguousarray(stance), edges, counts)
    is_edge = np.arange(legs * legs) < counts[:, None]
    start, (dx, dy) = edges[is_edge, :2], edges[is_edge, 2:4].T
    # Inward normals, and distances of the mass inside the edges.
    normals = np.stack([-dy, dx], axis=-1)
    heights = np.sum((centre_of_mass[np.nonzero(is_edge)[0]] - start) * normals, axis=-1)
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
