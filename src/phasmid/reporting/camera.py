"""A camera, and which triangle it sees at each pixel; no graphics card is asked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True, eq=False)
class View:
    """A pinhole camera.

    Attributes:
        eye: Where it stands [m], shape (3,).
        axes: Its right, up and backward directions as rows, shape (3, 3).
        focal: Distance of the picture from the eye, in pixels.
        size: Width and height of the picture, in pixels.
        shift: Place of the optical axis in the picture, in pixels from the upper left.
    """

    eye: Float[np.ndarray, "3"]
    axes: Float[np.ndarray, "3 3"]
    focal: float
    size: tuple[int, int]
    shift: tuple[float, float]

    def project(self, points: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3"]:
        """Pixel across, pixel down and nearness [1/m] of points; all three are linear on planes."""
        p = (points - self.eye) @ self.axes.T
        near = 1.0 / np.maximum(-p[..., 2], 1e-3)
        across = self.shift[0] + self.focal * p[..., 0] * near
        down = self.shift[1] - self.focal * p[..., 1] * near
        return np.stack([across, down, near], axis=-1)

    def rays(self, across: np.ndarray, down: np.ndarray) -> np.ndarray:
        """Directions through pixels, 1 m deep, shape (..., 3)."""
        x = (across - self.shift[0]) / self.focal
        y = (self.shift[1] - down) / self.focal
        return np.stack([x, y, -np.ones_like(x)], axis=-1) @ self.axes


def rasterise(
    corners: Float[np.ndarray, "triangles 3 3"], width: int, height: int
) -> tuple[Int[np.ndarray, "height width"], Float[np.ndarray, "height width"]]:
    """Which triangle is nearest at each pixel.

    Args:
        corners: Pixel across, pixel down and nearness of each corner.
        width: Of the picture, in pixels.
        height: Of the picture, in pixels.

    Returns:
        Index of the triangle, -1 where there is none, and its nearness there.
    """
    index = np.full((height, width), -1, dtype=np.int32)
    nearest = np.full((height, width), -np.inf)
    low = np.floor(corners[..., :2].min(axis=1)).astype(int)
    high = np.ceil(corners[..., :2].max(axis=1)).astype(int) + 1
    low, high = np.maximum(low, 0), np.minimum(high, [width, height])
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    seen = np.flatnonzero((low < high).all(axis=1) & (np.abs(area) > 1e-9))
    for i in seen:
        (x0, y0), (x1, y1) = low[i], high[i]
        x, y = np.arange(x0, x1) + 0.5, (np.arange(y0, y1) + 0.5)[:, None]
        (ax, ay, an), (bx, by, bn), (cx, cy, cn) = corners[i]
        to_b = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area[i]
        to_c = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area[i]
        near = an + to_b * (bn - an) + to_c * (cn - an)
        window = nearest[y0:y1, x0:x1]
        inside = (to_b >= 0) & (to_c >= 0) & (to_b + to_c <= 1) & (near > window)
        window[inside] = near[inside]
        index[y0:y1, x0:x1][inside] = i
    return index, nearest
