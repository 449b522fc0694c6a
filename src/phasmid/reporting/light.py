"""The light of a picture, and what lies in shadow."""

from __future__ import annotations

import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from phasmid.reporting.camera import along, rasterise
from phasmid.reporting.shapes import Mesh

LIGHT = np.array([-0.42, -0.38, 0.82]) / np.linalg.norm([-0.42, -0.38, 0.82])
"""Direction to the light."""

TILE = 10
"""Pixels of the map, a divisor of their number, that are looked at as one before each is."""


class ShadowMap:
    """What the light sees, so that the rest can lie in shadow."""

    RESOLUTION = 1000

    def __init__(self, mesh: Mesh) -> None:
        mesh = mesh.front(LIGHT)
        side = np.cross([0.0, 0.0, 1.0], LIGHT)
        side /= np.linalg.norm(side)
        self._axes = np.stack([side, np.cross(LIGHT, side), LIGHT])
        seen = along(mesh.corners, self._axes)
        self._low = seen[..., :2].min(axis=(0, 1)) - 0.02
        span = float((seen[..., :2].max(axis=(0, 1)) + 0.02 - self._low).max())
        self._scale = self.RESOLUTION / span
        seen[..., :2] = (seen[..., :2] - self._low) * self._scale
        near = rasterise(seen, self.RESOLUTION, self.RESOLUTION)[1]
        self._near = near.astype(np.float32)
        count = self.RESOLUTION // TILE
        rows = self._near.reshape(count, TILE, self.RESOLUTION)
        self._tiles = (
            rows.min(axis=1).reshape(count, count, TILE).min(axis=2),
            rows.max(axis=1).reshape(count, count, TILE).max(axis=2),
        )
        self._around: dict[int, tuple[np.ndarray, np.ndarray]] = {}

    def light(self, points: np.ndarray, blur: float, bias: float, taps: int) -> np.ndarray:
        """Part of the light that reaches points, shape (...).

        Args:
            points: In the world [m], shape (..., 3).
            blur: Radius over which shadows are softened [m].
            bias: Depth by which a point must be covered to lie in shadow [m].
            taps: Number of samples.
        """
        seen = along(points.reshape(-1, 3), self._axes)
        across, down = (seen[:, k] * self._scale - self._low[k] * self._scale for k in range(2))
        last, rim = self.RESOLUTION - 1, blur * self._scale
        lit = np.ones(len(seen), dtype=np.float32)
        # What lies beyond the map is lit, and is most of the ground.
        inside = (across > -rim) & (across < last + rim) & (down > -rim) & (down < last + rim)
        within = np.flatnonzero(inside)
        # Thousandths of a pixel do not matter here, and single precision is twice as fast.
        across, down, depth = (
            values[within].astype(np.float32) for values in (across, down, seen[:, 2] + bias)
        )
        # Where all that is about a point covers it, or nothing does, there is nothing to soften.
        lowest, highest = self._about(across, down, rim)
        lit[within] = highest <= depth
        edge = np.flatnonzero((lowest <= depth) & (highest > depth))
        across_0, down_0, depth = across[edge], down[edge], depth[edge]
        reached = np.zeros(len(edge), dtype=np.float32)
        for k in range(taps):
            radius, turn = rim * np.sqrt((k + 0.5) / taps), 2.399963 * k
            # The map's rim is empty, so that what lies beyond it is lit.
            across = np.clip(across_0 + np.float32(radius * np.cos(turn)), 0, last)
            down = np.clip(down_0 + np.float32(radius * np.sin(turn)), 0, last)
            place = down.astype(np.int32) * self.RESOLUTION + across.astype(np.int32)
            reached += self._near.ravel()[place] <= depth
        lit[within[edge]] = reached / taps
        return lit.reshape(points.shape[:-1])

    def _about(
        self, across: np.ndarray, down: np.ndarray, rim: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Bounds of what the map holds within a radius about places, both in its pixels."""
        reach = math.ceil(rim / TILE)
        if reach not in self._around:
            lowest, highest = (np.pad(tiles, reach, "edge") for tiles in self._tiles)
            for axis in (0, 1):
                lowest = sliding_window_view(lowest, 2 * reach + 1, axis=axis).min(axis=-1)
                highest = sliding_window_view(highest, 2 * reach + 1, axis=axis).max(axis=-1)
            self._around[reach] = lowest, highest
        row, column = (
            np.clip(place / TILE, 0, self.RESOLUTION // TILE - 1).astype(np.int32)
            for place in (down, across)
        )
        lowest, highest = (tiles[row, column] for tiles in self._around[reach])
        return lowest, highest
