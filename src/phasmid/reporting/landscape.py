"""The shape of a terrain about a place, as triangles."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.reporting.shapes import Mesh
from phasmid.terrain import Blocky, Ground

CELL = 0.015
"""Side of the triangles of which curved ground is drawn [m]."""


def landscape(
    ground: Ground, middle: Float[np.ndarray, "2"], reach: float, cell: float = CELL
) -> Mesh:
    """The ground about a place; its triangles look up, or out of the sides of steps.

    Args:
        ground: The terrain.
        middle: Of what is drawn, in the world [m].
        reach: How far about it [m].
        cell: Side of the triangles of which curved ground is drawn [m].
    """
    if isinstance(ground.shape, Blocky):
        corners = _of_blocks(ground, middle, reach)
    else:
        side = np.arange(-math.ceil(reach / cell), math.ceil(reach / cell) + 1) * cell
        # On a grid of the world, so that the picture does not shimmer as the robot moves on.
        x, y = np.meshgrid(*(cell * np.round(m / cell) + side for m in middle), indexing="ij")
        corners = _quads(np.stack([x, y, ground.height(x, y)], axis=-1))
    return Mesh(corners, np.zeros((len(corners), 3)))


def _quads(grid: Float[np.ndarray, "rows columns 3"]) -> Float[np.ndarray, "triangles 3 3"]:
    """Two triangles for each cell of a grid of points, counter-clockwise from above."""
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    halves = [np.stack([a, b, c], axis=-2), np.stack([a, c, d], axis=-2)]
    return np.concatenate([half.reshape(-1, 3, 3) for half in halves])


def _of_blocks(
    ground: Ground, middle: Float[np.ndarray, "2"], reach: float
) -> Float[np.ndarray, "triangles 3 3"]:
    """Tops and sides of the blocks near a place."""
    assert isinstance(ground.shape, Blocky)
    c, s = math.cos(ground.yaw), math.sin(ground.yaw)
    own = np.array([c * middle[0] + s * middle[1], c * middle[1] - s * middle[0]])
    blocks = ground.shape.blocks
    bottom = min(block.top for block in blocks) - 0.01
    triangles = []
    for block in blocks:
        low = np.maximum([block.u[0], block.v[0]], own - reach)
        high = np.minimum([block.u[1], block.v[1]], own + reach)
        if (low >= high).any():
            continue
        outline = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
        rings = [np.c_[outline, np.full(4, z)] for z in (bottom, block.top)]
        top = rings[1]
        triangles += [top[[0, 1, 2]], top[[0, 2, 3]]]
        below, above = (np.concatenate([ring, ring[:1]]) for ring in rings)
        for k in range(4):
            triangles.append(np.stack([below[k], below[k + 1], above[k + 1]]))
            triangles.append(np.stack([below[k], above[k + 1], above[k]]))
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    return np.array(triangles).reshape(-1, 3, 3) @ turn
