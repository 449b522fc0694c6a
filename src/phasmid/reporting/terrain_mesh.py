"""Terrain around a place as triangles, and the colours of the ground."""

from __future__ import annotations

import math
from typing import Any

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


def landscape(
    ground: Ground, middle: Float[np.ndarray, "2"], reach: float, cell: float = CELL
) -> tuple[Float[np.ndarray, "vertices 3"], Int[np.ndarray, "triangles 3"]]:
    """Return vertices [m] and triangles of the terrain around a place, facing outwards.

    Args:
        ground: The terrain.
        middle: The place, in the world [m].
        reach: Half the side of the square around it [m].
        cell: Side of the triangles of curved ground [m].
    """
    if isinstance(ground.shape, Blocky):
        return _of_blocks(ground, ground.shape, middle, reach)
    count = math.ceil(reach / cell)
    side = np.arange(-count, count + 1) * cell
    # On a grid of the world, so that the picture does not shimmer as the robot moves on.
    x, y = np.meshgrid(*(cell * np.round(m / cell) + side for m in middle), indexing="ij")
    corner = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (
        k.ravel() for k in (corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:])
    )
    faces = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)])
    return np.stack([x, y, ground.height(x, y)], axis=-1).reshape(-1, 3), faces


def _of_blocks(
    ground: Ground, shape: Blocky, middle: Float[np.ndarray, "2"], reach: float
) -> tuple[Float[np.ndarray, "vertices 3"], Int[np.ndarray, "triangles 3"]]:
    """Return the blocks near a place."""
    import trimesh

    c, s = math.cos(ground.yaw), math.sin(ground.yaw)
    R_world_terrain = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    near = middle @ R_world_terrain[:2, :2]
    bottom = min(block.top for block in shape.blocks) - 0.01
    boxes = []
    for block in shape.blocks:
        low = np.maximum([block.u[0], block.v[0]], near - reach)
        high = np.minimum([block.u[1], block.v[1]], near + reach)
        if (low < high).all():
            boxes.append(trimesh.creation.box(bounds=[[*low, bottom], [*high, block.top]]))
    solid: Any = trimesh.util.concatenate(boxes)
    return solid.vertices @ R_world_terrain.T, solid.faces


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
    colour: np.ndarray = FLOOR
    if terrain.patches and terrain.coefficient > 0:
        ratio = terrain.friction(x, y)[..., None] / terrain.coefficient
        slippery, gripping = np.clip(1 - ratio, 0, 1), np.clip(ratio - 1, 0, 1)
        colour = FLOOR + slippery * (SLIPPERY - FLOOR) + gripping * (GRIPPING - FLOOR)
    return np.rint(255 * colour * np.where(odd, DARK_SQUARE, 1.0)[..., None]).astype(np.uint8)
