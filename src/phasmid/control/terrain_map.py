"""Height map around the robot, from points that a depth sensor measured and from footholds.

`LocomotionEngine` writes ground points at arrival and footholds at touchdown. Heights are those of
feet that stand: where feet are balls, ground points are raised by their radius. Compiled functions
read heights by `map_height`, users by `TerrainMapView`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from jaxtyping import Float, Int

from phasmid.compiled import compiled
from phasmid.control.records import record_of, view_of

CELLS, CELL = 96, 0.01
"""Cells of a side, and their size [m]; the array shapes of `TerrainMap` repeat the first."""

RANGE_NOISE, ATTITUDE_NOISE, LEAST_NOISE = 0.01, 0.01, 0.002
"""Assumed standard deviations of a reading: of a range as its share; of the body's attitude [rad];
of all heights [m]."""

FOOT_NOISE, FOOT_RADIUS = 0.003, 0.015
"""Standard deviation of a foothold's height, and radius of the ground that it shows [m]."""

WAY_NOISE, TIME_NOISE = 0.02, 0.001
"""Drift of the odometry's height: standard deviations after a metre and a second [m]. A simulated
PhantomX AX on stairs of 20 mm drifted by 14 mm in 0.4 m."""

CONTRADICTION = 4.0
"""Standard deviations from which a measurement contradicts a cell."""

SAME_TOP = 2.5
"""Standard deviations within which the points of a cell lie on the same surface as its top."""

CONFIRMED = 0.25
"""Time for which a height resists lower measurements, as an edge within the cell causes [s]."""

WIDEST_HOLE, HIGHEST_HOLE = 4, 0.01
"""Cells of the widest hole that is filled, and largest rise across it [m]."""


class TerrainSource(IntEnum):
    """Measurements that a map consists of."""

    NONE = 0
    FEET = 1
    POINTS = 2


SOURCES = tuple(source.name.lower() for source in TerrainSource)
"""Sources of `EngineSettings.terrain_map`."""


@dataclass(eq=False)
class TerrainMap:
    """Square map with wrapped indices: cell number floor(x / CELL) modulo `CELLS`."""

    height: Float[np.ndarray, "96 96"]  # Over `plane` [m]; NaN: unknown
    variance: Float[np.ndarray, "96 96"]  # [m²]
    time: Float[np.ndarray, "96 96"]  # Of the last measurement [s]; NaN: interpolated
    plane: Float[np.ndarray, "3"]  # Height in odom at its origin [m], slopes along x and y
    centre: Int[np.ndarray, "2"]  # Cell numbers along x and y
    position: Float[np.ndarray, "2"]  # Of the body at the last change, in odom [m]
    updated: float  # Time of that change [s]


TERRAIN_MAP = record_of(TerrainMap)


def clear_map(terrain_maps: np.ndarray) -> None:
    """Make all cells unknown.

    Args:
        terrain_maps: Records of `TerrainMap`, written.
    """
    terrain_maps[:] = np.zeros((), TERRAIN_MAP)
    terrain_maps["height"] = terrain_maps["time"] = math.nan


@compiled
def is_inside(terrain_map: TerrainMap, i: int, j: int) -> bool:
    """Return whether the map covers a cell."""
    half = CELLS // 2
    x, y = i - terrain_map.centre[0] + half, j - terrain_map.centre[1] + half
    return 0 <= x < CELLS and 0 <= y < CELLS


@compiled
def map_height(terrain_map: TerrainMap, x: float, y: float) -> float:
    """Return the height of the cell at a point of odom [m], NaN where it is unknown."""
    i, j = math.floor(x / CELL), math.floor(y / CELL)
    if not is_inside(terrain_map, i, j):
        return math.nan
    plane = terrain_map.plane
    above = terrain_map.height[i % CELLS, j % CELLS]
    return above + plane[0] + plane[1] * x + plane[2] * y


@compiled
def map_variance(terrain_map: TerrainMap, x: float, y: float) -> float:
    """Return the variance of `map_height` [m²], infinite where the height is unknown."""
    i, j = math.floor(x / CELL), math.floor(y / CELL)
    if not is_inside(terrain_map, i, j) or math.isnan(terrain_map.height[i % CELLS, j % CELLS]):
        return math.inf
    return terrain_map.variance[i % CELLS, j % CELLS]


@compiled
def rotate_map(
    terrain_map: TerrainMap, R: Float[np.ndarray, "3 3"], p: Float[np.ndarray, "3"]
) -> None:
    """Rotate the map about a point of odom by a small angle.

    Heights shear with the plane from which they count; cells stay. This neglects the horizontal
    motion of the ground, its depth below the point times the angle.
    """
    a, b, plane = R[2, 0], R[2, 1], terrain_map.plane
    plane[0] -= a * p[0] + b * p[1]
    plane[1] += a
    plane[2] += b


@compiled
def recentre(terrain_map: TerrainMap, p_odom_body: Float[np.ndarray, "3"], time: float) -> None:
    """Centre the map on the body, and add the drift of the odometry since the last change.

    Cells that fall out become unknown.
    """
    position, centre = terrain_map.position, terrain_map.centre
    way = math.hypot(p_odom_body[0] - position[0], p_odom_body[1] - position[1])
    elapsed = max(time - terrain_map.updated, 0.0)
    drift = WAY_NOISE * WAY_NOISE * way + TIME_NOISE * TIME_NOISE * elapsed
    variance = terrain_map.variance
    for i in range(CELLS):
        for j in range(CELLS):
            variance[i, j] += drift
    terrain_map.updated = time
    for axis in range(2):
        position[axis] = p_odom_body[axis]
        new = math.floor(p_odom_body[axis] / CELL)
        moved = new - centre[axis]
        # Numbers of the cells that come in are those of the cells that fall out.
        first = centre[axis] + CELLS // 2 if moved > 0 else new - CELLS // 2
        for k in range(min(abs(moved), CELLS)):
            index = (first + k) % CELLS
            if axis == 0:
                terrain_map.height[index, :] = math.nan
                terrain_map.time[index, :] = math.nan
            else:
                terrain_map.height[:, index] = math.nan
                terrain_map.time[:, index] = math.nan
        centre[axis] = new


@compiled
def fuse(
    terrain_map: TerrainMap, i: int, j: int, z: float, variance: float, time: float, sure: bool
) -> None:
    """Take a measured height over the plane into a cell by a scalar Kalman update.

    A contradicting measurement replaces the height; a lower one that is not sure only where no
    measurement has confirmed the height for `CONFIRMED`.
    """
    height, last = terrain_map.height[i, j], terrain_map.time[i, j]
    before = terrain_map.variance[i, j]
    innovation, total = z - height, before + variance
    # Comparisons with NaN are false.
    agrees = innovation * innovation <= CONTRADICTION * CONTRADICTION * total
    if math.isnan(last) or not agrees:
        if innovation < 0.0 and not sure and time - last < CONFIRMED:
            return
        terrain_map.height[i, j], terrain_map.variance[i, j] = z, variance
    else:
        gain = before / total
        terrain_map.height[i, j] = height + gain * innovation
        # Errors of the pose are common to many readings and do not average out.
        terrain_map.variance[i, j] = max((1.0 - gain) * before, LEAST_NOISE * LEAST_NOISE)
    terrain_map.time[i, j] = time if math.isnan(last) else max(time, last)


@compiled
def add_points(
    terrain_map: TerrainMap,
    points: Float[np.ndarray, "points 3"],
    R_odom_body: Float[np.ndarray, "3 3"],
    p_odom_body: Float[np.ndarray, "3"],
    noise: tuple[float, float, float],
    time: float,
) -> None:
    """Take a reading of a depth sensor into the map.

    Of the points in a cell the highest count: those within `SAME_TOP` of the top are averaged.

    Args:
        terrain_map: Changed.
        points: In body axes [m].
        R_odom_body: Rotation of the body at the time of the reading.
        p_odom_body: Its origin in odom [m].
        noise: Standard deviations of range (its share), attitude [rad] and all heights [m].
        time: Of the reading [s].
    """
    plane, R, p = terrain_map.plane, R_odom_body, p_odom_body
    count = len(points)
    cells, depth, above = np.empty((count, 2), np.int64), np.empty(count), np.empty(count)
    top = np.full((CELLS, CELLS), -math.inf)
    total, number = np.zeros((CELLS, CELLS)), np.zeros((CELLS, CELLS))
    for k in range(count):
        a, b, c = points[k, 0], points[k, 1], points[k, 2]
        x = p[0] + R[0, 0] * a + R[0, 1] * b + R[0, 2] * c
        y = p[1] + R[1, 0] * a + R[1, 1] * b + R[1, 2] * c
        depth[k] = R[2, 0] * a + R[2, 1] * b + R[2, 2] * c
        i, j = math.floor(x / CELL), math.floor(y / CELL)
        if not (math.isfinite(x + y + depth[k]) and is_inside(terrain_map, i, j)):
            cells[k, 0] = -1
            continue
        i, j = i % CELLS, j % CELLS
        cells[k, 0], cells[k, 1] = i, j
        above[k] = p[2] + depth[k] - plane[0] - plane[1] * x - plane[2] * y
        top[i, j] = max(top[i, j], above[k])
    for k in range(count):
        i, j = cells[k, 0], cells[k, 1]
        if i < 0:
            continue
        spread = math.hypot(noise[0] * depth[k], noise[2])
        if above[k] >= top[i, j] - SAME_TOP * spread:
            total[i, j] += above[k]
            number[i, j] += 1.0
    for k in range(count):
        i, j = cells[k, 0], cells[k, 1]
        if i < 0 or number[i, j] == 0.0:
            continue
        far = points[k, 0] ** 2 + points[k, 1] ** 2 + points[k, 2] ** 2 - depth[k] ** 2
        # The share of the range that is vertical is the depth.
        variance = (noise[0] * depth[k]) ** 2 / number[i, j] + noise[1] ** 2 * far + noise[2] ** 2
        fuse(terrain_map, i, j, total[i, j] / number[i, j], variance, time, False)
        number[i, j] = 0.0
    fill_holes(terrain_map)


@compiled
def add_foothold(
    terrain_map: TerrainMap, x: float, y: float, z: float, radius: float, time: float
) -> None:
    """Take the place of a foot on the ground, in odom [m], into the cells within a radius [m]."""
    plane, reach = terrain_map.plane, math.ceil(radius / CELL)
    above = z - plane[0] - plane[1] * x - plane[2] * y
    mid_i, mid_j = math.floor(x / CELL), math.floor(y / CELL)
    for i in range(mid_i - reach, mid_i + reach + 1):
        for j in range(mid_j - reach, mid_j + reach + 1):
            far = math.hypot((i + 0.5) * CELL - x, (j + 0.5) * CELL - y)
            own = i == mid_i and j == mid_j
            if (own or far <= radius) and is_inside(terrain_map, i, j):
                variance = FOOT_NOISE * FOOT_NOISE
                fuse(terrain_map, i % CELLS, j % CELLS, above, variance, time, True)


@compiled
def fill_holes(terrain_map: TerrainMap) -> None:
    """Interpolate narrow holes between measured cells, along x and along y.

    Holes at an edge stay. The variance grows by the square of half the
    hole's width, since such an edge may lie hidden in it.
    """
    height, variance, time = terrain_map.height, terrain_map.variance, terrain_map.time
    for axis in range(2):
        first = terrain_map.centre[axis] - CELLS // 2
        for line in range(CELLS):
            last, known = 0, False
            for k in range(first, first + CELLS):
                n = k % CELLS
                i, j = (n, line) if axis == 0 else (line, n)
                if math.isnan(time[i, j]):
                    continue
                hole = k - last - 1
                if known and 0 < hole <= WIDEST_HOLE:
                    m = last % CELLS
                    u, v = (m, line) if axis == 0 else (line, m)
                    rise = height[i, j] - height[u, v]
                    most = max(variance[i, j], variance[u, v]) + (hole * CELL / 2) ** 2
                    if abs(rise) <= HIGHEST_HOLE:
                        for step in range(1, hole + 1):
                            m = (last + step) % CELLS
                            r, s = (m, line) if axis == 0 else (line, m)
                            height[r, s] = height[u, v] + rise * step / (hole + 1)
                            variance[r, s] = most
                last, known = k, True


class TerrainMapView:
    """The engine's map for users: square arrays of cells, x along the first axis, y the second.

    Args:
        terrain_maps: Record of `TerrainMap`, shape (1,).
        now: Returns the time of the controller [s].
    """

    def __init__(self, terrain_maps: np.ndarray, now: Callable[[], float]) -> None:
        self._map, self._now = view_of(terrain_maps, TerrainMap, 0), now

    @property
    def x(self) -> Float[np.ndarray, " cells"]:
        """Centres of the cells along odom's x [m]."""
        return self._centres(0)

    @property
    def y(self) -> Float[np.ndarray, " cells"]:
        """Centres of the cells along odom's y [m]."""
        return self._centres(1)

    @property
    def height(self) -> Float[np.ndarray, "cells cells"]:
        """Heights of standing feet in odom [m]; NaN: unknown."""
        level, slope_x, slope_y = self._map.plane
        plane = level + slope_x * self.x[:, None] + slope_y * self.y
        return self._in_order(self._map.height) + plane

    @property
    def variance(self) -> Float[np.ndarray, "cells cells"]:
        """Variances of the heights [m²]; NaN: unknown."""
        return np.where(np.isnan(self.height), np.nan, self._in_order(self._map.variance))

    @property
    def age(self) -> Float[np.ndarray, "cells cells"]:
        """Times since the last measurements [s]; NaN: unknown or interpolated."""
        return self._now() - self._in_order(self._map.time)

    def arrays(self) -> tuple[np.ndarray, ...]:
        """Return x, y, height, its standard deviation [m] and its age [s] of all cells, for plots.

        Five arrays of one shape, x along the first axis.
        """
        x, y = np.meshgrid(self.x, self.y, indexing="ij")
        return x, y, self.height, np.sqrt(self.variance), self.age

    def _centres(self, axis: int) -> Float[np.ndarray, " cells"]:
        return (self._map.centre[axis] + np.arange(CELLS) - CELLS // 2 + 0.5) * CELL

    def _in_order(self, cells: Float[np.ndarray, "cells cells"]) -> np.ndarray:
        first: Int[np.ndarray, "2"] = self._map.centre - CELLS // 2
        return np.roll(cells, tuple(-first % CELLS), axis=(0, 1))
