"""Height maps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.terrain.shape import Places, Surface, ramp

MOST_SAMPLES = 4096 * 4096
"""Most samples of a height map."""

TALLEST = 2.0
"""Height of hills above which a map that is too steep is likely in other units than metres [m]."""

RAMP = 0.1
"""Way over which the map grows out of the level ground before it [m]."""


_WEIGHTS = np.array([[0, 2, 0, 0], [-1, 0, 1, 0], [2, -5, 4, -1], [-1, 3, -3, 1]]) / 2
CUBIC = np.hstack([_WEIGHTS, np.arange(1, 5)[:, None] * np.roll(_WEIGHTS, -1, axis=0)])
CUBIC[3, 4:] = 0.0
"""Weights of four neighbours by powers of the way from the second to the third, and their slope."""


MOST_OVER = 1.5 * 1.25
"""By how much the cubic's slope may exceed the largest difference of the samples around it: its
weights of their differences add up to 1.5 at the most, those across to 1.25."""

MOST_CELLS = 10_000
"""Most cells whose slope is sampled between the nodes, the steepest ones."""

STRIP = 1 << 18
"""Samples that are evaluated at once."""


@dataclass(frozen=True, eq=False)
class HeightMap:
    """Heights on a grid, as a picture from above with u to the right and v up.

    Between samples a cubic runs through them whose slope is continuous, so that feet do not stand
    on edges that only the sampling made. The map's left edge lies across the start and its middle
    row on the u axis. Beyond its edges the heights there go on.

    Attributes:
        heights: Row by row from the left of the way to its right, along u in each row [m], (R, C).
        cell: Distance of two samples [m].
        start: Where the map begins to grow out of level ground, within 0.1 m [m].
    """

    heights: Float[np.ndarray, "rows columns"]
    cell: float
    start: float

    def __post_init__(self) -> None:
        check_samples(*self.heights.shape)
        check_finite(self.heights)
        if not self.cell > 0:
            raise InvalidInput(
                f"samples of the height map are {self.cell:g} m apart; it must be greater than 0."
            )
        steepest = [0.0, 0.0]
        for axis in (0, 1):
            steepest[axis] = float(np.abs(np.diff(self.heights, axis=axis)).max()) / self.cell
        if max(steepest) > 1.0:
            axis = int(np.argmax(steepest))
            rise = np.abs(np.diff(self.heights, axis=axis))
            row, column = np.unravel_index(int(np.argmax(rise)), rise.shape)
            raise InvalidInput(
                f"height map has a slope of {math.degrees(math.atan(max(steepest))):.0f}° at row "
                f"{row + 1}, column {column + 1}; 45° is the steepest this contact model is "
                "verified for.",
                hint="are these numbers millimetres? a .npy or .csv holds metres"
                if float(np.ptp(self.heights)) > TALLEST
                else "a larger map_cell, or of an image a smaller map_height",
            )
        self._check_between()

    def _check_between(self) -> None:
        """Refuse slopes above 45° between samples, and on the ramp at the start."""
        rows = self.heights.shape[0]
        i, j = self._steep_cells()
        inside = np.linspace(0.0, 1.0, 5)
        u = self.start + self.cell * (i[:, None, None] + inside[:, None])
        v = self.cell * (j[:, None, None] + inside - (rows - 1) / 2)
        self._check_slope(u, v, "between its samples")
        if self.heights.any():
            u = self.start + np.linspace(0.0, RAMP, 21)[:, None]
            v = self.cell * (np.arange(-2.0, 2 * rows + 1) - (rows - 1)) / 2
            where = "where it grows out of the level ground before it"
            self._check_slope(u, v, where)

    def _check_slope(self, u: np.ndarray, v: np.ndarray, where: str) -> None:
        u, v = (np.ravel(each) for each in np.broadcast_arrays(u, v))
        steepest, at = 1.0, -1
        for first in range(0, len(u), STRIP):
            slope = self.surface(u[first : first + STRIP], v[first : first + STRIP])[1]
            steep = np.hypot(slope[:, 0], slope[:, 1])
            if steep.max() > steepest:
                at = first + int(np.argmax(steep))
                steepest = float(steep.max())
        # Allow for round-off.
        if at < 0 or steepest <= 1 + 1e-9:
            return
        rows, columns = self.heights.shape
        column = min(max(round((u[at] - self.start) / self.cell), 0), columns - 1)
        row = min(max(round((rows - 1) / 2 - v[at] / self.cell), 0), rows - 1)
        raise InvalidInput(
            f"height map has a slope of {math.degrees(math.atan(steepest)):.0f}° {where} near row "
            f"{row + 1}, column {column + 1}; 45° is the steepest this contact model is verified "
            "for.",
            hint="lower heights, by a smaller map_height where the map is an image",
        )

    def _steep_cells(self) -> tuple[np.ndarray, np.ndarray]:
        """Return cells that may be steeper than 45°, numbered along u and v."""
        grid, (rows, columns) = self._grid, self.heights.shape
        strip = max(1, STRIP // (rows + 4))
        steepness, cells = [], []
        for first in range(0, columns + 1, strip):
            part = grid[first : min(first + strip, columns + 1) + 3]
            along = _largest(_largest(np.abs(np.diff(part, axis=0)), 3).T, 4).T
            across = _largest(_largest(np.abs(np.diff(part, axis=1)), 4).T, 3).T
            steep = MOST_OVER / self.cell * np.hypot(along, across)
            found = np.argwhere(steep > 1)
            steepness.append(steep[tuple(found.T)])
            # The first window lies around the cell before the first sample.
            cells.append(found + np.array([first - 1, -1]))
        most = np.argsort(-np.concatenate(steepness), kind="stable")[:MOST_CELLS]
        i, j = np.concatenate(cells)[most].T
        return i, j

    @cached_property
    def _grid(self) -> Float[np.ndarray, "along across"]:
        """Heights by u and v, both increasing, with two more beyond each edge."""
        return np.pad(self.heights[::-1].T, 2, mode="edge")

    def surface(self, u: Places, v: Places) -> Surface:
        """Return height [m], and slope along u and v."""
        share, growth = ramp(u, self.start, RAMP)
        height, slope_u, slope_v = self._between(u, v)
        slope = np.stack([share * slope_u + growth * height, share * slope_v], axis=-1)
        return share * height, slope

    def _between(self, u: Places, v: Places) -> tuple[Places, Places, Places]:
        """Height without the ramp, and its slopes.

        Source: R. G. Keys, Cubic convolution interpolation for digital image processing, IEEE
        Transactions on Acoustics, Speech, and Signal Processing 29(6), 1981, a = -1/2.
        """
        rows, columns = self.heights.shape
        last = np.array([[columns - 1.0], [rows - 1.0]])
        place = np.stack([(u - self.start) / self.cell, v / self.cell + (rows - 1) / 2])
        # These two leave NaN at the far edge.
        place = np.fmax(np.fmin(place, last + 1), -1.0)
        corner = np.minimum(np.floor(place), last)
        t = (place - corner)[..., None]
        weights = (((CUBIC[3] * t + CUBIC[2]) * t + CUBIC[1]) * t + CUBIC[0]).reshape(2, -1, 2, 4)
        i, j = corner.astype(int)[..., None] + np.arange(1, 5)
        near = self._grid[i[:, :, None], j[:, None, :]]
        found = weights[0] @ near @ np.swapaxes(weights[1], 1, 2)
        return found[:, 0, 0], found[:, 1, 0] / self.cell, found[:, 0, 1] / self.cell


def _largest(values: np.ndarray, width: int) -> np.ndarray:
    """Return the largest of neighbours along the first axis, where all of them exist."""
    count = len(values) - width + 1
    found = values[:count]
    for k in range(1, width):
        found = np.maximum(found, values[k : k + count])
    return found


def check_samples(rows: int, columns: int) -> None:
    """Refuse a height map that is too small or too large, before memory is allocated.

    Args:
        rows: Of its grid.
        columns: Of its grid.

    Raises:
        InvalidInput: It has less than 2 × 2 or more than 4096 × 4096 samples.
    """
    if rows < 2 or columns < 2:
        raise InvalidInput(f"height map is {rows} × {columns}; it needs at least 2 × 2 samples.")
    check_count(rows * columns)


def check_count(samples: int) -> None:
    """Refuse more samples than a height map may have.

    Raises:
        InvalidInput: With the memory that they would take.
    """
    if samples > MOST_SAMPLES:
        raise InvalidInput(
            f"height map of {samples:,} samples needs {8 * samples / 1e9:.3g} GB; the limit is "
            "4096 × 4096.".replace(",", " ")
        )


def check_finite(heights: Float[np.ndarray, "rows columns"]) -> None:
    """Refuse heights that are not finite; rows and columns are counted from 1.

    Raises:
        InvalidInput: With their number and the first of them.
    """
    bad = ~np.isfinite(heights)
    if bad.any():
        row, column = np.unravel_index(int(np.argmax(bad)), bad.shape)
        many = int(bad.sum())
        raise InvalidInput(
            f"height map has {many} value{'s that are' if many > 1 else ' that is'} not finite, "
            f"first at row {row + 1}, column {column + 1}."
        )
