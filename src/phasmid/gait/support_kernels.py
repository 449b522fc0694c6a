"""Compiled support polygons: their edges, and how far inside a point is."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled, internal


@internal
def edge_depth(feet: np.ndarray, standing: np.ndarray, i: int, j: int) -> float:
    """Return the largest distance of standing feet to the left of the line from foot i to foot j.

    It is multiplied by the line's length [m²]; -1 where a foot stands to the right, or the two feet
    are in one place.
    """
    x, y = feet[i, 0], feet[i, 1]
    dx, dy, deepest = feet[j, 0] - x, feet[j, 1] - y, 0.0
    square = dx * dx + dy * dy
    if square < 1e-18:
        return -1.0
    for k in range(len(standing)):
        if standing[k]:
            side = dx * (feet[k, 1] - y) - dy * (feet[k, 0] - x)
            # Written so that NaN counts as a foot to the right.
            if not (side >= 0.0 or side * side < 1e-24 * square):
                return -1.0
            deepest = max(deepest, side)
    return deepest


@internal
def support_edges(feet: np.ndarray, standing: np.ndarray, edges: np.ndarray) -> int:
    """Write the edges of the support polygon, counter-clockwise from above; return how many.

    Args:
        feet: Feet, x and y first [m], shape (L, 2 or 3).
        standing: Nonzero for feet that stand, shape (L,).
        edges: Written: start, vector to the end, and length [m], shape (L * L, 5).

    Returns:
        Fewer than three where fewer than three feet stand, or they stand in a line.
    """
    count, edge = len(standing), 0
    for i in range(count):
        if not standing[i]:
            continue
        for j in range(count):
            if j == i or not standing[j]:
                continue
            depth = edge_depth(feet, standing, i, j)
            if depth <= 0.0:
                continue
            dx, dy = feet[j, 0] - feet[i, 0], feet[j, 1] - feet[i, 1]
            length = math.sqrt(dx * dx + dy * dy)
            if depth > 1e-9 * length:
                edges[edge, 0], edges[edge, 1] = feet[i, 0], feet[i, 1]
                edges[edge, 2], edges[edge, 3], edges[edge, 4] = dx, dy, length
                edge += 1
    return edge


@internal
def edge_margin(edges: np.ndarray, count: int, x: float, y: float) -> float:
    """Return the least distance of a point from the lines of the edges, positive inside [m].

    Args:
        edges: As `support_edges` writes them, shape (N, 5).
        count: Number of edges; minus infinity is returned for fewer than three.
        x: Point [m].
        y: The same.
    """
    least = math.inf
    for k in range(count):
        rx, ry, dx, dy = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3]
        least = min(least, (dx * (y - ry) - dy * (x - rx)) / edges[k, 4])
    return least if count >= 3 else -math.inf


@internal
def polygon_margin(edges: np.ndarray, count: int, x: float, y: float) -> float:
    """Return as `edge_margin`; outside, the distance from the polygon, negative [m]."""
    margin = edge_margin(edges, count, x, y)
    if margin >= 0.0 or count < 3:
        return margin
    distance = math.inf
    for k in range(count):
        rx, ry, length = x - edges[k, 0], y - edges[k, 1], edges[k, 4]
        dx, dy = edges[k, 2] / length, edges[k, 3] / length
        along = min(max(dx * rx + dy * ry, 0.0), length)
        distance = min(distance, math.hypot(rx - along * dx, ry - along * dy))
    return -distance


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
