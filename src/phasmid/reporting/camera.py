"""A camera, and which triangle it sees at each pixel; no graphics card is asked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

PIXELS = 1 << 17
"""Pixels of rectangles about triangles that are looked at together, about."""


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
        p = along(points - self.eye, self.axes)
        near = 1.0 / np.maximum(-p[..., 2], 1e-3)
        across = self.shift[0] + self.focal * p[..., 0] * near
        down = self.shift[1] - self.focal * p[..., 1] * near
        return np.stack([across, down, near], axis=-1)

    def rays(self, across: np.ndarray, down: np.ndarray) -> np.ndarray:
        """Directions through pixels, 1 m deep, shape (..., 3)."""
        x = (across - self.shift[0]) / self.focal
        y = (self.shift[1] - down) / self.focal
        return along(np.stack([x, y, -np.ones_like(x)], axis=-1), self.axes.T)


def along(
    vectors: Float[np.ndarray, "*batch 3"], axes: Float[np.ndarray, "3 3"]
) -> Float[np.ndarray, "*batch 3"]:
    """``vectors @ axes.T`` for a million vectors, for which a library's threads are too much.

    Args:
        vectors: Their parts along the old axes.
        axes: The new axes as rows.
    """
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return np.stack([x * a + y * b + z * c for a, b, c in axes], axis=-1)


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
    index = np.full(height * width, -1, dtype=np.int32)
    nearest = np.full(height * width, -np.inf)
    # Pixels whose middles lie between the corners.
    low = np.ceil(corners[..., :2].min(axis=1) - 0.5).astype(int)
    high = np.floor(corners[..., :2].max(axis=1) + 0.5).astype(int)
    low, high = np.maximum(low, 0), np.minimum(high, [width, height])
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    seen = np.flatnonzero((low < high).all(axis=1) & (np.abs(area) > 1e-9))
    counts = (high - low)[seen].prod(axis=1)
    # Many triangles are small: the pixels of as many as fit a processor's cache are looked at once.
    parts = np.searchsorted(np.cumsum(counts), np.arange(PIXELS, counts.sum(), PIXELS))
    for part in np.split(seen, np.unique(parts)):
        if len(part):
            which, pixel, near = _covered(corners[part], area[part], low[part], high[part], width)
            better = near > nearest[pixel]
            which, pixel, near = which[better], pixel[better], near[better]
            np.maximum.at(nearest, pixel, near)
            # Of several that are equally near the first is seen, which is written last.
            front = np.flatnonzero(near == nearest[pixel])[::-1]
            index[pixel[front]] = part[which[front]]
    return index.reshape(height, width), nearest.reshape(height, width)


def _covered(
    corners: Float[np.ndarray, "triangles 3 3"],
    area: Float[np.ndarray, " triangles"],
    low: Int[np.ndarray, "triangles 2"],
    high: Int[np.ndarray, "triangles 2"],
    width: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pixels that triangles cover: the triangle, the pixel's number, and the nearness there."""
    rows = high[:, 1] - low[:, 1]
    # First the rows of each triangle, then the pixels of each row.
    of = np.repeat(np.arange(len(rows)), rows)
    down = _counted(rows) + low[of, 1]
    (ax, ay, an), (bx, by, bn), (cx, cy, cn) = np.moveaxis(corners, 0, -1)
    y = down + 0.5 - ay[of]
    row_b, row_c = y * (cx - ax)[of], y * (bx - ax)[of]
    columns = (high[:, 0] - low[:, 0])[of]
    row = np.repeat(np.arange(len(columns)), columns)
    which = of[row]
    across = _counted(columns) + low[:, 0][which]
    x = across + 0.5 - ax[which]
    to_b = (x * (cy - ay)[which] - row_b[row]) / area[which]
    to_c = (row_c[row] - (by - ay)[which] * x) / area[which]
    inside = np.flatnonzero((to_b >= 0) & (to_c >= 0) & (to_b + to_c <= 1))
    which, to_b, to_c = which[inside], to_b[inside], to_c[inside]
    near = an[which] + to_b * (bn - an)[which] + to_c * (cn - an)[which]
    return which, down[row[inside]] * width + across[inside], near


def _counted(counts: Int[np.ndarray, " parts"]) -> Int[np.ndarray, " all"]:
    """0, 1, 2 and so on within each of several parts."""
    return np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
