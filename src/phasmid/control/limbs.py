"""Centre of mass, rotations and support margin at one instant, for the engine's update."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled, internal
from phasmid.control.types import Model


@compiled
def moment_of(model: Model, leg: int, q: np.ndarray, moment: np.ndarray) -> None:
    """Add a leg's mass times the place of its centre in the body frame [kg·m].

    Args:
        model: The robot's numbers, a `Model`.
        leg: Its index.
        q: Its joint angles [rad], shape (3,).
        moment: Added to, shape (3,).
    """
    lengths, com, mass = model.lengths[leg], model.link_com[leg], model.link_mass[leg]
    c1, s1 = math.cos(q[0]), math.sin(q[0])
    out, side, up = 0.0, 0.0, 0.0
    for k in range(3):
        if k == 0:
            x, y, z = com[0, 0], com[0, 1], com[0, 2]
        else:
            e = q[1] if k == 1 else q[1] + q[2]
            c, s = math.cos(e), math.sin(e)
            x = lengths[0] + com[k, 0] * c - com[k, 1] * s
            z = com[k, 0] * s + com[k, 1] * c
            if k == 2:
                x += lengths[1] * math.cos(q[1])
                z += lengths[1] * math.sin(q[1])
            y = -com[k, 2]
        out += mass[k] * x
        side += mass[k] * y
        up += mass[k] * z
    x, y = c1 * out - s1 * side, s1 * out + c1 * side
    whole = mass[0] + mass[1] + mass[2]
    R, p = model.R_body_hip[leg], model.p_body_hip[leg]
    for i in range(3):
        moment[i] += whole * p[i] + R[i, 0] * x + R[i, 1] * y + R[i, 2] * up


@compiled
def to_hip(R: np.ndarray, v: np.ndarray, out: np.ndarray) -> None:
    """Write a vector in the axes of a frame whose rotation is R: the transpose of R times v."""
    for i in range(3):
        out[i] = R[0, i] * v[0] + R[1, i] * v[1] + R[2, i] * v[2]


@compiled
def rotation(roll: float, pitch: float, yaw: float, R: np.ndarray) -> None:
    """Write the rotation of roll about x, then pitch about y, then yaw about z, fixed axes."""
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    R[0, 0], R[0, 1], R[0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    R[1, 0], R[1, 1], R[1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    R[2, 0], R[2, 1], R[2, 2] = -sp, cp * sr, cp * cr


@compiled
def deepest_of(feet: np.ndarray, standing: np.ndarray, i: int, j: int) -> float:
    """How far the deepest foot is to the left of the line from one to another, from above.

    Args:
        feet: Feet, x and y first [m], shape (L, 2 or 3).
        standing: Which of them count, shape (L,).
        i: Where the line begins.
        j: Where it goes to.

    Returns:
        The distance times the line's length [m²]; -1 where the line is no edge of the feet that
        stand: one of them is to the right of it by more than round-off, or it has no length.
    """
    x, y = feet[i, 0], feet[i, 1]
    dx, dy, deepest = feet[j, 0] - x, feet[j, 1] - y, 0.0
    square = dx * dx + dy * dy
    if square < 1e-18:
        return -1.0
    for k in range(len(standing)):
        if standing[k]:
            side = dx * (feet[k, 1] - y) - dy * (feet[k, 0] - x)
            # Written so that a foot that is no number is to the right of it.
            if not (side >= 0.0 or side * side < 1e-24 * square):
                return -1.0
            deepest = max(deepest, side)
    return deepest


@internal
def edges_of(feet: np.ndarray, standing: np.ndarray, edges: np.ndarray) -> int:
    """Write the edges of the feet that stand, from above, the others to the left of each.

    Args:
        feet: Feet, x and y first [m], shape (L, 2 or 3).
        standing: Which of them count, shape (L,).
        edges: Written: where each begins, its way to its end, and its length [m], shape (L * L, 5).

    Returns:
        How many there are; fewer than three where the feet are so few or lie on a line.
    """
    count, edge = len(standing), 0
    for i in range(count):
        if not standing[i]:
            continue
        for j in range(count):
            if j == i or not standing[j]:
                continue
            deepest = deepest_of(feet, standing, i, j)
            if deepest <= 0.0:
                continue
            dx, dy = feet[j, 0] - feet[i, 0], feet[j, 1] - feet[i, 1]
            length = math.sqrt(dx * dx + dy * dy)
            if deepest > 1e-9 * length:
                edges[edge, 0], edges[edge, 1] = feet[i, 0], feet[i, 1]
                edges[edge, 2], edges[edge, 3], edges[edge, 4] = dx, dy, length
                edge += 1
    return edge


@internal
def margin_within(edges: np.ndarray, count: int, x: float, y: float) -> float:
    """Distance of a point from the nearest of the first edges that `edges_of` has written [m].

    Args:
        edges: The edges, shape (N, 5).
        count: How many of them count.
        x: The point [m].
        y: The same.

    Returns:
        As `margin_of`.
    """
    least = math.inf
    for k in range(count):
        rx, ry, dx, dy = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3]
        least = min(least, (dx * (y - ry) - dy * (x - rx)) / edges[k, 4])
    return least if count >= 3 else -math.inf


@compiled
def margin_of(feet: np.ndarray, standing: np.ndarray, x: float, y: float) -> float:
    """Distance of a point from the edge of the feet that stand, from above [m]; see `gait`.

    Args:
        feet: Feet, x and y first [m], shape (L, 2 or 3).
        standing: Which of them count, shape (L,).
        x: The point [m].
        y: The same.

    Returns:
        Positive inside, negative outside (to the nearest edge's line), minus infinity where they
        are fewer than three or lie on a line.
    """
    edges = np.empty((len(standing) * len(standing), 5))
    return margin_within(edges, edges_of(feet, standing, edges), x, y)
