"""The light of a picture, and what lies in shadow."""

from __future__ import annotations

import numpy as np

from phasmid.reporting.camera import along, rasterise
from phasmid.reporting.shapes import Mesh

LIGHT = np.array([-0.42, -0.38, 0.82]) / np.linalg.norm([-0.42, -0.38, 0.82])
"""Direction to the light."""


class ShadowMap:
    """What the light sees, so that the rest can lie in shadow."""

    RESOLUTION = 1400

    def __init__(self, mesh: Mesh) -> None:
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

    def light(self, points: np.ndarray, blur: float, bias: float, taps: int) -> np.ndarray:
        """Part of the light that reaches points, shape (...).

        Args:
            points: In the world [m], shape (..., 3).
            blur: Radius over which shadows are softened [m].
            bias: Depth by which a point must be covered to lie in shadow [m].
            taps: Number of samples.
        """
        seen = along(points.reshape(-1, 3), self._axes)
        place = (seen[:, :2] - self._low) * self._scale
        last, rim = self.RESOLUTION - 1, blur * self._scale
        lit = np.ones(len(seen), dtype=np.float32)
        # What lies beyond the map is lit, and is most of the ground.
        within = np.flatnonzero(((place > -rim) & (place < last + rim)).all(axis=1))
        # Thousandths of a pixel do not matter here, and single precision is twice as fast.
        across_0, down_0 = place[within].astype(np.float32).T
        depth = (seen[within, 2] + bias).astype(np.float32)
        reached = np.zeros(len(within), dtype=np.float32)
        for k in range(taps):
            radius, turn = rim * np.sqrt((k + 0.5) / taps), 2.399963 * k
            # The map's rim is empty, so that what lies beyond it is lit.
            across = np.clip(across_0 + np.float32(radius * np.cos(turn)), 0, last)
            down = np.clip(down_0 + np.float32(radius * np.sin(turn)), 0, last)
            reached += self._near[down.astype(np.int32), across.astype(np.int32)] <= depth
        lit[within] = reached / taps
        return lit.reshape(points.shape[:-1])
