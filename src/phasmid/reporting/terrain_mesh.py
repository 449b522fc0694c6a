"""Terrain around a place as triangles, and the colours of the ground."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float, Int, UInt8

from phasmid.reporting.style import rgb
from phasmid.terrain import Blocky, Ground

CELL = 0.015
"""Default side of the triangles of curved ground [m]."""

FLOOR, SLIPPERY, GRIPPING = rgb("#f3f5f8"), rgb("#8fc7ee"), rgb("#dcb98f")
"""Colours of the ground, of ground without friction, and of ground with twice the friction."""

DARK_SQUARE = 0.9
"""Brightness of every other square."""

COARSE = 512
"""Pixels along the side of the ground at which its friction is sampled."""


def landscape(
    ground: Ground, middle: Float[np.ndarray, "2"], reach: float, cell: float = CELL
) -> Float[np.ndarray, "triangles 3 3"]:
    """Return the terrain around a place; its triangles face up, or out of the sides of steps.

    Args:
        ground: The terrain.
        middle: The place, in the world [m].
        reach: Half the side of the square around it [m].
        cell: Side of the triangles of curved ground [m].
    """
    if isinstance(ground.shape, Blocky):
        return _of_blocks(ground, middle, reach)
    count = math.ceil(reach / cell)
    side = np.arange(-count, count + 1) * cell
    # On a grid of the world, so that the picture does not shimmer as the robot moves on.
    x, y = np.meshgrid(*(cell * np.round(m / cell) + side for m in middle), indexing="ij")
    return _quads(np.stack([x, y, ground.height(x, y)], axis=-1))


def _quads(grid: Float[np.ndarray, "rows columns 3"]) -> Float[np.ndarray, "triangles 3 3"]:
    """Return two triangles for each cell of a grid of points, counter-clockwise from above."""
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    halves = [np.stack([a, b, c], axis=-2), np.stack([a, c, d], axis=-2)]
    return np.concatenate([half.reshape(-1, 3, 3) for half in halves])


def _of_blocks(
    ground: Ground, middle: Float[np.ndarray, "2"], reach: float
) -> Float[np.ndarray, "triangles 3 3"]:
    """Return tops and sides of the blocks near a place."""
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


def indexed(
    corners: Float[np.ndarray, "triangles 3 3"],
) -> tuple[Float[np.ndarray, "vertices 3"], Int[np.ndarray, "triangles 3"]]:
    """Return triangles as distinct vertices [m], rounded to 16 bits, and their indices."""
    step = max(float(np.abs(corners).max()), 1e-9) / 32767
    steps = np.rint(corners.reshape(-1, 3) / step).astype(np.int64)
    keys = (steps + 32768) @ np.array([1 << 34, 1 << 17, 1])
    _, first, faces = np.unique(keys, return_index=True, return_inverse=True)
    faces = faces.reshape(-1, 3)
    a, b, c = faces.T
    return steps[first] * step, faces[(a != b) & (b != c) & (c != a)]


def floor_image(
    corner: Float[np.ndarray, "2"], size: float, pixels: int, square: float, terrain: Ground
) -> UInt8[np.ndarray, "rows columns 3"]:
    """Return the colours of the ground, in squares, over a square part of the world.

    Args:
        corner: Its corner of least x and y [m].
        size: Its side [m].
        pixels: Pixels along its side.
        square: Side of the squares [m].
        terrain: The terrain; its friction sets the colour.
    """
    along = (np.arange(pixels) + 0.5) / pixels * size
    x, y = np.meshgrid(corner[0] + along, corner[1] + along[::-1])
    odd = (np.floor(x / square) + np.floor(y / square)) % 2 == 1
    every = math.ceil(pixels / COARSE)
    colour = floor_colour(x[::every, ::every], y[::every, ::every], terrain)
    colour = colour.repeat(every, axis=0).repeat(every, axis=1)[:pixels, :pixels]
    shade = colour * np.where(odd, DARK_SQUARE, 1.0)[..., None]
    return np.rint(255 * shade).astype(np.uint8)


def floor_colour(
    x: Float[np.ndarray, "rows columns"], y: Float[np.ndarray, "rows columns"], terrain: Ground
) -> Float[np.ndarray, "rows columns 3"]:
    """Return the colour of the ground at places [m] by its friction, 0 to 1."""
    if not terrain.patches or terrain.coefficient == 0:
        return np.broadcast_to(FLOOR, (*x.shape, 3))
    ratio = terrain.friction(x, y)[..., None] / terrain.coefficient
    slippery, gripping = np.clip(1 - ratio, 0, 1), np.clip(ratio - 1, 0, 1)
    return FLOOR + slippery * (SLIPPERY - FLOOR) + gripping * (GRIPPING - FLOOR)
