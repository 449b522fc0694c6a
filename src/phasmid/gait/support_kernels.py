"""Compiled support polygons: their edges, and the distance of a point from them."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled

SAME_PLACE, ROUND_OFF = 1e-9, 1e-12
"""Distance below which feet stand in one place, and round-off of feet on a line [m]."""


@compiled
def support_edges(feet: np.ndarray, standing: np.ndarray, edges: np.ndarray) -> int:
    """Write the edges of the support polygon, counter-clockwise from above; return how many.

    Args:
        feet: Feet, x and y first [m], shape (L, 2 or 3).
        standing: Nonzero for feet that stand, shape (L,).
        edges: Written: start, direction, and length [m], shape (L * L, 5).

    Returns:
        Fewer than three where fewer than three feet stand, or they stand in a line.
    """
    count, edge = len(standing), 0
    for i in range(count):
        for j in range(count):
            x, y = feet[i, 0], feet[i, 1]
            dx, dy = feet[j, 0] - x, feet[j, 1] - y
            length = math.sqrt(dx * dx + dy * dy)
            if not standing[i] or not standing[j] or length < SAME_PLACE:
                continue
            dx, dy, deepest, outside = dx / length, dy / length, 0.0, False
            for k in range(count):
                if standing[k]:
                    depth = dx * (feet[k, 1] - y) - dy * (feet[k, 0] - x)
                    # Written so that NaN counts as a foot outside.
                    outside = outside or not depth > -ROUND_OFF
                    deepest = max(deepest, depth)
            if deepest > SAME_PLACE and not outside:
                edges[edge, 0], edges[edge, 1], edges[edge, 2] = x, y, dx
                edges[edge, 3], edges[edge, 4] = dy, length
                edge += 1
    return edge


@compiled
def edge_margin(edges: np.ndarray, count: int, x: float, y: float) -> float:
    """Return the least distance of a point from the lines of the edges, positive inside [m].

    It is minus infinity for fewer than three edges.
    """
    least = math.inf
    for k in range(count):
        rx, ry, dx, dy = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3]
        least = min(least, dx * (y - ry) - dy * (x - rx))
    return least if count >= 3 else -math.inf


@compiled
def line_margin(feet: np.ndarray, standing: np.ndarray, x: float, y: float) -> float:
    """Return `edge_margin` of a point and the support polygon of standing feet."""
    edges = np.empty((len(standing) * len(standing), 5))
    return edge_margin(edges, support_edges(feet, standing, edges), x, y)


@compiled
def polygon_margin(edges: np.ndarray, count: int, x: float, y: float) -> float:
    """Return as `edge_margin`; outside, the distance from the polygon, negative [m]."""
    margin = edge_margin(edges, count, x, y)
    if margin >= 0.0 or count < 3:
        return margin
    distance = math.inf
    for k in range(count):
        rx, ry, dx, dy = x - edges[k, 0], y - edges[k, 1], edges[k, 2], edges[k, 3]
        along = min(max(dx * rx + dy * ry, 0.0), edges[k, 4])
        distance = min(distance, math.hypot(rx - along * dx, ry - along * dy))
    return -distance


@compiled
def sample_edges(
    feet: np.ndarray, standing: np.ndarray, edges: np.ndarray, counts: np.ndarray
) -> None:
    """Write `support_edges` and their number for each sample.

    Args:
        feet: Feet [m], shape (N, L, 2).
        standing: Which of them stand, shape (N, L).
        edges: Written, shape (N, L * L, 5).
        counts: Written, shape (N,).
    """
    for n in range(len(feet)):
        counts[n] = support_edges(feet[n], standing[n], edges[n])


@compiled
def support_margins(
    feet: np.ndarray, standing: np.ndarray, points: np.ndarray, margins: np.ndarray
) -> None:
    """Write `polygon_margin` of each sample.

    Args:
        feet: Feet [m], shape (N, L, 2).
        standing: Which of them stand, shape (N, L).
        points: Points [m], shape (N, 2).
        margins: Written [m], shape (N,).
    """
    edges = np.empty((feet.shape[1] * feet.shape[1], 5))
    for n in range(len(feet)):
        count = support_edges(feet[n], standing[n], edges)
        margins[n] = polygon_margin(edges, count, points[n, 0], points[n, 1])
