"""Height maps."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.terrain.shapes import Places, Surface, ramp

MOST_SAMPLES = 4096 * 4096
"""Most samples of a height map."""

MOST_IN_LINE = 65_536
"""Most rows, and most columns, of a height map: 650 m at the usual distance of samples."""

TALLEST = 2.0
"""Height of hills above which a map that is too steep is likely in other units than metres [m]."""

RAMP = 0.1
"""Distance before the map over which its left edge grows out of level ground [m]."""


_WEIGHTS = np.array([[0, 2, 0, 0], [-1, 0, 1, 0], [2, -5, 4, -1], [-1, 3, -3, 1]]) / 2
CUBIC = np.hstack([_WEIGHTS, np.arange(1, 5)[:, None] * np.roll(_WEIGHTS, -1, axis=0)])
CUBIC[3, 4:] = 0.0
"""Weights of four neighbours by powers of the way from the second to the third, and their slope."""


MOST_OVER = 1.5 * 1.25
"""By how much the cubic's slope may exceed the largest difference of the samples around it: its
weights of their differences add up to 1.5 at the most, those across to 1.25."""

MOST_CELLS = 10_000
"""Most cells whose slope is evaluated between the samples, the steepest ones."""


@dataclass(frozen=True, eq=False)
class HeightMap:
    """Heights on a grid, as a picture from above with u to the right and v up.

    A cubic with continuous slope interpolates the samples, so that feet do not stand on edges that
    only the sampling made. The first column lies at the start and the middle row on the u axis.
    From the first column on, the ground has the heights of the map; in the 0.1 m before, the
    heights of the first column grow out of level ground. Beyond the other edges the heights there
    go on.

    Attributes:
        heights: Row by row from the left of the way to its right, along u in each row [m], (R, C).
        cell: Distance of two samples [m].
        start: Place of the first column along u [m].
    """

    heights: Float[np.ndarray, "rows columns"]
    cell: float
    start: float

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, HeightMap):
            return NotImplemented
        same = (self.cell, self.start) == (other.cell, other.start)
        return same and np.array_equal(self.heights, other.heights)

    def __hash__(self) -> int:
        return hash((self.cell, self.start, self.heights.shape))

    def __post_init__(self) -> None:
        check_samples(*self.heights.shape)
        check_finite(self.heights)
        if not self.cell > 0:
            raise InvalidInput(
                f"samples of the height map are {self.cell:g} m apart; it must be greater than 0."
            )
        for axis in (0, 1):
            slope = np.abs(np.diff(self.heights, axis=axis)) / self.cell
            self._check_slope(slope, "", lambda at: at)
        self._check_between()

    def _check_between(self) -> None:
        """Refuse slopes above 45° between samples, and on the ramp before the first column."""
        rows, columns = self.heights.shape

        def sample_at(u: np.ndarray, v: np.ndarray, where: str) -> None:
            u, v = (np.ravel(each) for each in np.broadcast_arrays(u, v))
            column = np.clip(np.round((u - self.start) / self.cell), 0, columns - 1)
            row = np.clip(np.round((rows - 1) / 2 - v / self.cell), 0, rows - 1)
            steep = np.linalg.norm(self.surface(u, v)[1], axis=1)
            self._check_slope(steep, where, lambda at: (row[at], column[at]))

        # Largest differences of neighbours that affect each cell, from the first one along u and
        # the one before the first along v.
        steps = (np.abs(np.diff(self._grid, axis=axis)) for axis in (0, 1))
        windows = ((3, 4), (4, 3))
        along, across = map(_window_maximum, steps, windows)
        bound = MOST_OVER / self.cell * np.hypot(along, across)
        cells = np.flatnonzero(bound > 1)
        if len(cells) > MOST_CELLS:
            cells = cells[np.argpartition(-bound.flat[cells], MOST_CELLS)[:MOST_CELLS]]
        i, j = np.unravel_index(cells, bound.shape)
        inside = np.linspace(0.0, 1.0, 5)
        u = self.start + self.cell * (i[:, None, None] + inside[:, None])
        v = self.cell * (j[:, None, None] - 1 + inside - (rows - 1) / 2)
        sample_at(u, v, " between its samples")
        if self.heights[:, 0].any():
            u = self.start - np.linspace(0.0, RAMP, 21)[:, None]
            v = self.cell * (np.arange(-2.0, 2 * rows + 1) - (rows - 1)) / 2
            sample_at(u, v, " where it grows out of the level ground before it")

    def _check_slope(
        self, slope: np.ndarray, where: str, sample: Callable[[Any], Sequence[Any]]
    ) -> None:
        """Refuse slopes above 45°; `sample` returns row and column of one of them."""
        # Allow for round-off.
        if slope.max(initial=0.0) <= 1 + 1e-9:
            return
        at = np.unravel_index(np.argmax(slope), slope.shape)
        row, column = (int(index) + 1 for index in np.ravel(sample(at)))
        raise InvalidInput(
            f"height map has a slope of {math.degrees(math.atan(slope[at])):.0f}°{where} near row "
            f"{row}, column {column}; 45° is the steepest this contact model is verified for.",
            hint="are these numbers millimetres? a .npy or .csv holds metres"
            if float(np.ptp(self.heights)) > TALLEST
            else f"map_cell_mm = {math.ceil(1001 * self.cell * float(slope[at])):g}",
        )

    @cached_property
    def _grid(self) -> Float[np.ndarray, "along across"]:
        """Heights by u and v, both increasing, with one before the first u and two beyond others.

        The one before the first is extrapolated: the first column keeps the slope of the file.
        """
        grid = np.pad(self.heights[::-1].T, ((1, 2), (2, 2)), mode="edge")
        grid[0] = 2 * grid[1] - grid[2]
        return grid

    def surface(self, u: Places, v: Places) -> Surface:
        """Return height [m], and slope along u and v."""
        share, growth = ramp(u, self.start - RAMP, RAMP)
        height, slope_u, slope_v = self._between(u, v)
        slope = np.stack([share * slope_u + growth * height, share * slope_v], axis=-1)
        return share * height, slope

    def _between(self, u: Places, v: Places) -> tuple[Places, Places, Places]:
        """Height without the ramp, and its slopes; before the first column its heights go on.

        Source: R. G. Keys, Cubic convolution interpolation for digital image processing, IEEE
        Transactions on Acoustics, Speech, and Signal Processing 29(6), 1981, a = -1/2.
        """
        rows, columns = self.heights.shape
        last = np.array([[columns - 1.0], [rows - 1.0]])
        place = np.stack([(u - self.start) / self.cell, v / self.cell + (rows - 1) / 2])
        # These two leave NaN at the far edge.
        place = np.fmax(np.fmin(place, last + 1), [[0.0], [-1.0]])
        corner = np.minimum(np.floor(place), last)
        t = (place - corner)[..., None]
        weights = (((CUBIC[3] * t + CUBIC[2]) * t + CUBIC[1]) * t + CUBIC[0]).reshape(2, -1, 2, 4)
        i, j = corner.astype(int)[..., None] + [[np.arange(4)], [np.arange(1, 5)]]
        near = self._grid[i[:, :, None], j[:, None, :]]
        found = weights[0] @ near @ np.swapaxes(weights[1], 1, 2)
        slope_u = np.where(u < self.start, 0.0, found[:, 1, 0] / self.cell)
        return found[:, 0, 0], slope_u, found[:, 0, 1] / self.cell


def _window_maximum(
    values: Float[np.ndarray, "rows columns"], window: tuple[int, int]
) -> Float[np.ndarray, "windows_down windows_across"]:
    """Return the maxima over all windows, ten times as fast as by `sliding_window_view`."""
    for axis, length in enumerate(window):
        count = values.shape[axis] - length + 1
        slices = (slice(k, k + count) for k in range(length))
        values = reduce(np.maximum, (values[s] if axis == 0 else values[:, s] for s in slices))
    return values


def check_samples(rows: int, columns: int) -> None:
    """Refuse a height map that is too small or too large, before memory is allocated.

    Args:
        rows: Of its grid.
        columns: Of its grid.

    Raises:
        InvalidInput: It has less than 2 × 2 or more than 4096 × 4096 samples, or too many in a row
            or column.
    """
    if rows < 2 or columns < 2:
        raise InvalidInput(f"height map is {rows} × {columns}; it needs at least 2 × 2 samples.")
    check_most_samples(rows, columns)


def check_most_samples(rows: int, columns: int) -> None:
    """Refuse a height map that is too large, also while its rows are still counted."""
    if max(rows, columns) > MOST_IN_LINE:
        raise InvalidInput(
            f"height map is {rows} × {columns}; the limit is {MOST_IN_LINE} rows or columns."
        )
    if rows * columns > MOST_SAMPLES:
        raise InvalidInput(f"height map is {rows} × {columns}; the limit is 4096 × 4096 samples.")


def check_finite(heights: Float[np.ndarray, "rows columns"]) -> None:
    """Refuse heights that are not finite; the message has the first, counted from 1."""
    bad = ~np.isfinite(heights)
    if bad.any():
        row, column = np.argwhere(bad)[0] + 1
        raise InvalidInput(
            f"height map is not finite in {bad.sum()} places, first at row {row}, column {column}."
        )
