"""Training grounds: tiles of rising difficulty around level platforms, as one height field."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from phasmid.compiled import compiled
from phasmid.learning.task import TerrainTable
from phasmid.terrain import Blocks, Flat, Slope, Steps, Waves
from phasmid.terrain.shapes import Shape

BLOCK_SIZE, STAIR_RUN, WAVE_LENGTH, GAP_SPACING, GAP_DEPTH = 0.1, 0.15, 0.5, 0.3, 0.1
"""Side of a block, depth of a stair, wave length, distance and depth of gaps [m]: those of the
comparison of controllers."""


class Terrain(NamedTuple):
    """Tiles on which episodes begin; rows by difficulty, columns by kind.

    Attributes:
        heights: Samples on a grid around the origin [m], first axis x, shape (X, Y).
        cell: Distance of samples [m].
        origins: Centres of the tiles [m], shape (levels, kinds, 2).
    """

    heights: np.ndarray
    cell: float
    origins: np.ndarray


def training_terrain(table: TerrainTable) -> Terrain:
    """Return the tiles of a task; level ground without tiles where the task names no kinds."""
    if not table.kinds:
        return Terrain(np.zeros((2, 2)), 1e3, np.zeros((1, 1, 2)))
    count = round(table.tile / table.cell)
    own = (np.arange(count) + 0.5 - count / 2) * table.cell
    x, y = np.meshgrid(own, own, indexing="ij")
    # A tile is the same to all four sides: stairs and slopes become pyramids, gaps become rings.
    away = np.maximum(np.abs(x), np.abs(y)).ravel()
    rows = []
    for level in range(table.levels):
        share = level / (table.levels - 1) if table.levels > 1 else 1.0
        row = []
        for kind in table.kinds:
            shape = _shape(table, kind, share, level)
            if kind == "blocks":
                # The field of blocks lies ahead of its start; the platform is cut out of it.
                height = shape.surface(x.ravel() + table.tile / 2, y.ravel())[0]
                height = np.where(away < table.platform, 0.0, height)
            else:
                height = shape.surface(away, np.zeros_like(away))[0]
            row.append(height.reshape(count, count))
        rows.append(np.concatenate(row, axis=1))
    heights = np.concatenate(rows, axis=0)
    middles = [
        (np.arange(n) + 0.5 - n / 2) * count * table.cell for n in (table.levels, len(table.kinds))
    ]
    origins = np.stack(np.meshgrid(*middles, indexing="ij"), axis=-1)
    return Terrain(heights, table.cell, origins)


def _shape(table: TerrainTable, kind: str, share: float, seed: int) -> Shape:
    """Return ground with a share of the largest size of its kind."""
    if share == 0:
        return Flat()
    start, end = table.platform, table.tile / 2
    if kind == "stairs":
        count = math.ceil((end - start) / STAIR_RUN)
        return Steps.stairs(start, rise=share * table.stairs, run=STAIR_RUN, count=count)
    if kind == "slope":
        return Slope(share * table.slope, start)
    if kind == "blocks":
        size = share * table.blocks
        return Blocks(BLOCK_SIZE, 0.0, size, GAP_DEPTH, 0.0, table.tile, table.tile, seed=seed + 1)
    if kind == "waves":
        return Waves(share * table.waves, WAVE_LENGTH, start)
    width = share * table.gaps
    begins = np.arange(start, end - width, GAP_SPACING + width)
    edges = np.stack([begins, begins + width], axis=1).ravel()
    return Steps(tuple(edges.tolist()), (-GAP_DEPTH, 0.0) * len(begins))


@compiled
def ground_height(terrain: Terrain, x: float, y: float) -> float:
    """Return the height of the ground [m], linear between the samples, level beyond the edges."""
    rows, columns = terrain.heights.shape
    u = min(max(x / terrain.cell + (rows - 1) / 2, 0.0), rows - 1.000001)
    v = min(max(y / terrain.cell + (columns - 1) / 2, 0.0), columns - 1.000001)
    i, j = int(u), int(v)
    a, b = u - i, v - j
    h = terrain.heights
    near = (1 - b) * h[i, j] + b * h[i, j + 1]
    far = (1 - b) * h[i + 1, j] + b * h[i + 1, j + 1]
    return (1 - a) * near + a * far
