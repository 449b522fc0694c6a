"""Depth sensor on the trunk: points of the ground along the rays of a camera or a lidar.

The true ground and the pose of the trunk go in; points in body axes come out. The simulation's
observer calls it.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.experiment import Sensors
from phasmid.kinematics import neutral_feet, quaternion_rotation
from phasmid.robot import Robot
from phasmid.simulation.sensors.models import Sampling, random_stream, rotated
from phasmid.terrain import Ground

DEPTH = 5
"""Number of the sensor's random stream, beside those of `phasmid.simulation.sensors.models`."""

ROWS, COLUMNS, WIDTH = 30, 40, math.radians(70)
"""Rays of the camera, and its horizontal angle of view [rad]."""

CAMERA_HEIGHT, LIDAR_HEIGHT = 0.03, 0.06
"""Heights of the sensors over the trunk's upper side [m]."""

NEAR, FAR = 0.1, 0.8
"""Level ground that the camera sees: from a distance before the front feet to one before the body's
origin [m]."""

RINGS, AZIMUTHS = 16, 100
"""Rays of the lidar: elevations, and directions of each."""

LEAST_DEPTH, MOST_DEPTH = math.radians(8), math.radians(55)
"""Angles below the horizon of the lidar's rays [rad]."""

ADVANCE = (math.sqrt(5) - 1) / 2
"""Part of the angle between the lidar's rays by which each reading begins later."""

EXACT_STEP, EXACT_RADIUS = 0.02, 0.5
"""Lattice of the exact sensor, and its extent around the body's origin [m]."""

STEP = 0.01
"""Step along a ray, and distance of the nodes between which the ground is interpolated [m]."""

TILE, MOST_TILES = 32, 600
"""Nodes along the sides of the squares in which heights are computed, and most squares kept."""

BRACKET, HALVINGS = 0.03, 6
"""Distance from an interpolated side of a block within which the true one lies along a ray [m],
and bisections by which it is found."""


class DepthSensor:
    """Camera, lidar or exact sensor of the ground around a robot.

    The camera is a pinhole above the trunk's front, pitched down. The lidar rotates on a mast.
    Rays do not meet the robot's own legs. Sides of blocks give readings, as tops do. The mounting
    angles drift by a random walk that the sensor's readings do not allow for.

    Args:
        table: Kind, range, noise, drift and seed.
        robot: Its trunk and neutral feet place the sensor.
        ground: The true ground.

    Attributes:
        sampling: Rate and delay.
    """

    def __init__(self, table: Sensors, robot: Robot, ground: Ground) -> None:
        self._table, self._ground = table, ground
        exact = table.depth == "exact"
        self.sampling = Sampling(table.depth_rate, 0.0 if exact else table.depth_delay)
        self._rng = random_stream(table.sensor_seed, DEPTH)
        self._angles, self._readings = np.zeros(3), 0
        self._tiles: dict[tuple[int, int], np.ndarray] = {}
        feet = neutral_feet(robot)
        if table.depth == "camera":
            self._mount = robot.body.box_points(np.array([1.0, 0.0, 1.0]))
            self._mount[2] += CAMERA_HEIGHT
            front, above = self._mount[0], self._mount[2] - feet[:, 2].mean()
            near, far = feet[:, 0].max() + NEAR - front, FAR - front
            self._rays = camera_rays(math.atan2(above, near), math.atan2(above, far))
        else:
            self._mount = robot.body.box_points(np.array([0.0, 0.0, 1.0]))
            self._mount[2] += LIDAR_HEIGHT

    def read(self, pose: Float[np.ndarray, "7"]) -> Float[np.ndarray, "points 3"]:
        """Return points of the ground in body axes [m], shape (N, 3).

        Args:
            pose: Position of the body in the world [m], and its orientation, w x y z.
        """
        table, p, R = self._table, pose[:3], quaternion_rotation(pose[3:])
        if table.depth == "exact":
            return self._lattice(p, R)
        rays = self._rays if table.depth == "camera" else lidar_rays(self._readings * ADVANCE)
        self._readings += 1
        noise, chance = self._rng.standard_normal(len(rays)), self._rng.random(len(rays))
        true = quaternion_rotation(rotated(np.array([1.0, 0.0, 0.0, 0.0]), self._angles))
        step = table.depth_drift / math.sqrt(60.0 * table.depth_rate)
        self._angles += step * self._rng.standard_normal(3)
        distance = self.distances(p + R @ self._mount, rays @ (R @ true).T)
        distance *= 1.0 + table.depth_noise * noise
        seen = (distance <= table.depth_range) & (chance >= table.depth_dropout)
        return self._mount + distance[seen, None] * rays[seen]

    def distances(
        self, origin: Float[np.ndarray, "3"], rays: Float[np.ndarray, "rays 3"]
    ) -> Float[np.ndarray, " rays"]:
        """Return the distances at which rays meet the ground [m], shape (N,); NaN: they do not.

        Args:
            origin: Of all rays, in the world [m].
            rays: Unit vectors in the world, shape (N, 3).
        """
        ends = origin[:2] + self._table.depth_range * rays[:, :2]
        low = np.minimum(ends.min(axis=0), origin[:2])
        high = np.maximum(ends.max(axis=0), origin[:2])
        first = np.floor(low / (STEP * TILE)).astype(int)
        last = np.floor(high / (STEP * TILE) + 1 / TILE).astype(int)
        if len(self._tiles) > MOST_TILES:
            self._tiles.clear()
        rows = [
            [self._tile(i, j) for j in range(first[1], last[1] + 1)]
            for i in range(first[0], last[0] + 1)
        ]
        heights = np.concatenate([np.concatenate(row, axis=1) for row in rows])
        corner = first * (STEP * TILE)
        found: np.ndarray = march(heights, corner, origin, rays, self._table.depth_range)
        if self._ground.faces_up and not self._ground.is_level:
            return self._on_blocks(origin, rays, found)
        return found

    def _on_blocks(self, origin: np.ndarray, rays: np.ndarray, found: np.ndarray) -> np.ndarray:
        """Find where rays meet blocks, whose sides the interpolation leans; near edges a few miss.

        Args:
            origin: Of all rays, in the world [m].
            rays: Unit vectors in the world, shape (N, 3).
            found: Distances at which they meet the interpolated ground [m], shape (N,).
        """

        def clearance(t: np.ndarray) -> np.ndarray:
            x, y, z = (origin + t[:, None] * rays[hits]).T
            return z - self._ground.height(x, y)

        distance, hits = np.full(len(rays), math.nan), np.flatnonzero(np.isfinite(found))
        low, high = np.maximum(found[hits] - BRACKET, 0.0), found[hits] + BRACKET
        over, under = clearance(low), clearance(high)
        meets = (over > 0) & (under <= 0)
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            value = clearance(middle)
            is_over = value > 0
            low, over = np.where(is_over, (middle, value), (low, over))
            high, under = np.where(is_over, (high, under), (middle, value))
        share = over[meets] / (over - under)[meets]
        distance[hits[meets]] = low[meets] + share * (high - low)[meets]
        return distance

    def _tile(self, i: int, j: int) -> Float[np.ndarray, "32 32"]:
        """Return the heights at the nodes of a square of the world, kept for later readings."""
        if (i, j) not in self._tiles:
            x, y = (STEP * (TILE * k + np.arange(TILE)) for k in (i, j))
            self._tiles[i, j] = self._ground.height(*np.meshgrid(x, y, indexing="ij"))
        return self._tiles[i, j]

    def _lattice(
        self, p: Float[np.ndarray, "3"], R: Float[np.ndarray, "3 3"]
    ) -> Float[np.ndarray, "points 3"]:
        """Return the true ground on a lattice of the world, in body axes [m]."""
        reach = math.ceil(EXACT_RADIUS / EXACT_STEP)
        steps = np.arange(-reach, reach + 1)
        x, y = (EXACT_STEP * (round(w / EXACT_STEP) + steps) for w in p[:2])
        x, y = (w.ravel() for w in np.meshgrid(x, y))
        near = np.hypot(x - p[0], y - p[1]) <= EXACT_RADIUS
        x, y = x[near], y[near]
        points: np.ndarray = (np.stack([x, y, self._ground.height(x, y)], axis=1) - p) @ R
        return points


def camera_rays(near: float, far: float) -> Float[np.ndarray, "rays 3"]:
    """Return unit vectors in body axes of a pinhole camera, shape (N, 3).

    Args:
        near: Angle of its lowest row of pixels below the horizon [rad].
        far: The same of its highest row.
    """
    pitch, half = (near + far) / 2, (near - far) / 2
    v = math.tan(half) * np.linspace(1.0, -1.0, ROWS)
    u = math.tan(WIDTH / 2) * np.linspace(1.0, -1.0, COLUMNS)
    up, left = (w.ravel() for w in np.meshgrid(v, u, indexing="ij"))
    c, s = math.cos(pitch), math.sin(pitch)
    rays = np.stack([c + s * up, left, c * up - s], axis=1)
    return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))


def lidar_rays(start: float) -> Float[np.ndarray, "rays 3"]:
    """Return unit vectors in body axes of all rings of a lidar, shape (N, 3).

    Args:
        start: Direction of the first ray as a share of the angle between two.
    """
    azimuth = 2 * math.pi / AZIMUTHS * (np.arange(AZIMUTHS) + start % 1.0)
    depth, azimuth = (
        w.ravel() for w in np.meshgrid(np.linspace(LEAST_DEPTH, MOST_DEPTH, RINGS), azimuth)
    )
    level = np.cos(depth)
    return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), -np.sin(depth)], axis=1)


@compiled
def march(
    heights: Float[np.ndarray, "rows columns"],
    corner: Float[np.ndarray, "2"],
    origin: Float[np.ndarray, "3"],
    rays: Float[np.ndarray, "rays 3"],
    most: float,
) -> Float[np.ndarray, " rays"]:
    """Return the distances at which rays meet a surface between nodes [m]; NaN: they do not.

    Args:
        heights: At nodes `STEP` apart along x and y [m], around all rays.
        corner: Place of the first node [m].
        origin: Of the rays [m].
        rays: Unit vectors.
        most: Length of the rays [m].
    """
    found, steps = np.full(len(rays), math.nan), math.ceil(most / STEP)
    rows, columns = heights.shape
    for k in range(len(rays)):
        before = math.nan
        for n in range(steps + 1):
            t = n * STEP
            x = (origin[0] + t * rays[k, 0] - corner[0]) / STEP
            y = (origin[1] + t * rays[k, 1] - corner[1]) / STEP
            i, j = math.floor(x), math.floor(y)
            if not (0 <= i < rows - 1 and 0 <= j < columns - 1):
                break
            u, v = x - i, y - j
            near = heights[i, j] + v * (heights[i, j + 1] - heights[i, j])
            far = heights[i + 1, j] + v * (heights[i + 1, j + 1] - heights[i + 1, j])
            over = origin[2] + t * rays[k, 2] - near - u * (far - near)
            if over <= 0.0:
                if n > 0:
                    found[k] = t - STEP * over / (over - before)
                break
            before = over
    return found
