"""A camera, and which triangle it sees at each pixel; no graphics card is asked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from jaxtyping import Float, Int

ROWS = 1 << 14
"""Rows of pixels of triangles that are looked at together, about."""

LEVEL = 1e-9
"""Pixels by which an edge rises that runs along a row of them."""


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
        return _vectors([across, down, near])

    def rays(self, across: np.ndarray, down: np.ndarray) -> np.ndarray:
        """Directions through pixels, 1 m deep, of the shape that both have together and 3."""
        x = (across - self.shift[0]) / self.focal
        y = (self.shift[1] - down) / self.focal
        return _vectors([x * a + (y * b - c) for a, b, c in self.axes.T])

    def at(self, rays: np.ndarray, depth: np.ndarray) -> np.ndarray:
        """Points of such directions at depths [m], shape (..., 3)."""
        return _vectors([eye + rays[..., k] * depth for k, eye in enumerate(self.eye)])


def along(
    vectors: Float[np.ndarray, "*batch 3"], axes: Float[np.ndarray, "3 3"]
) -> Float[np.ndarray, "*batch 3"]:
    """``vectors @ axes.T`` for a million vectors, for which a library's threads are too much.

    Args:
        vectors: Their parts along the old axes.
        axes: The new axes as rows.
    """
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return _vectors([x * a + y * b + z * c for a, b, c in axes])


def _vectors(parts: list[Any]) -> np.ndarray:
    """Vectors of their parts. Each stays together in memory, since they are worked on in turn."""
    return np.moveaxis(np.stack(parts), 0, -1)


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
    # Rows whose middles lie between the corners.
    across, down = (np.sort(corners[..., k], axis=1) for k in range(2))
    top = np.maximum(np.ceil(down[:, 0] - 0.5).astype(int), 0)
    bottom = np.minimum(np.floor(down[:, 2] + 0.5).astype(int), height)
    beside = (across[:, 2] < 0) | (across[:, 0] > width)
    seen = np.flatnonzero((top < bottom) & ~beside)
    rows = (bottom - top)[seen]
    # Many triangles are small: as many as fit a processor's cache are looked at together.
    parts = np.searchsorted(np.cumsum(rows), np.arange(ROWS, rows.sum(), ROWS))
    for part in np.split(seen, np.unique(parts)):
        if len(part):
            which, pixel, near = _covered(corners[part], top[part], bottom[part], width)
            better = np.flatnonzero(near > nearest[pixel])
            which, pixel, near = which[better], pixel[better], near[better]
            np.maximum.at(nearest, pixel, near)
            # Of several that are equally near the first is seen, which is written last.
            front = np.flatnonzero(near == nearest[pixel])[::-1]
            index[pixel[front]] = part[which[front]]
    return index.reshape(height, width), nearest.reshape(height, width)


def _covered(
    corners: Float[np.ndarray, "triangles 3 3"],
    top: Int[np.ndarray, " triangles"],
    bottom: Int[np.ndarray, " triangles"],
    width: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pixels that triangles cover: the triangle, the pixel's number, and the nearness there."""
    rows = bottom - top
    of = np.repeat(np.arange(len(rows)), rows)
    row = _counted(rows) + top[of]
    # A row of pixels runs through a triangle from its longest edge, between the upmost and the
    # lowest corner, to one of the others, above or below the third corner.
    y = row + 0.5
    up, middle, low = _downwards(*np.moveaxis(corners[..., :2], (1, 2), (0, 1)))
    short, slope = np.concatenate([_line(up, middle), _line(middle, low)], axis=1)
    other = of + len(corners) * (y >= middle[1][of])
    one = short[other] + slope[other] * y
    long, slope = _line(up, low)
    two = long[of] + slope[of] * y
    first = np.clip(np.ceil(np.minimum(one, two) - 0.5), 0, width).astype(int)
    after = np.clip(np.floor(np.maximum(one, two) + 0.5), 0, width).astype(int)
    hit = np.flatnonzero(after > first)
    first, row, of = first[hit], row[hit], of[hit]
    counts = after[hit] - first
    near, over_x, over_y = _plane(corners)
    begin = near[of] + over_x[of] * (first + 0.5) + over_y[of] * y[hit]
    step = _counted(counts)
    spread = np.repeat(np.arange(len(counts)), counts)
    whose = of[spread]
    return whose, (row * width + first)[spread] + step, begin[spread] + step * over_x[whose]


Points: TypeAlias = Float[np.ndarray, "2 triangles"]
"""Pixel across and pixel down of a corner of each triangle."""


def _downwards(a: Points, b: Points, c: Points) -> tuple[Points, Points, Points]:
    """The corners from above to below."""
    a, b = _in_order(a, b)
    b, c = _in_order(b, c)
    a, b = _in_order(a, b)
    return a, b, c


def _in_order(a: Points, b: Points) -> tuple[Points, Points]:
    """Two corners, the upper one first."""
    wrong = a[1] > b[1]
    return np.where(wrong, b, a), np.where(wrong, a, b)


def _line(start: Points, end: Points) -> Float[np.ndarray, "2 triangles"]:
    """Pixel across of an edge at pixel down 0, and its slope."""
    across, fall = end - start
    is_level = np.abs(fall) < LEVEL
    slope = np.where(is_level, 0.0, across / np.where(is_level, 1.0, fall))
    return np.stack([start[0] - slope * start[1], slope])


def _plane(corners: Float[np.ndarray, "triangles 3 3"]) -> Float[np.ndarray, "3 triangles"]:
    """Nearness of triangles at pixel (0, 0), and its slopes across and down."""
    (ax, ay, an), (bx, by, bn), (cx, cy, cn) = np.moveaxis(corners, 0, -1)
    area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
    # What is seen edge on covers at most a row's middles, and is as near as its first corner.
    is_thin = np.abs(area) < LEVEL
    share = np.where(is_thin, 0.0, 1.0 / np.where(is_thin, 1.0, area))
    over_x = ((bn - an) * (cy - ay) - (cn - an) * (by - ay)) * share
    over_y = ((cn - an) * (bx - ax) - (bn - an) * (cx - ax)) * share
    return np.stack([an - over_x * ax - over_y * ay, over_x, over_y])


def _counted(counts: Int[np.ndarray, " parts"]) -> Int[np.ndarray, " all"]:
    """0, 1, 2 and so on within each of several parts."""
    return np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
