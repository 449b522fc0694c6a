"""Height and attitude of the trunk over the planes of its feet."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from phasmid.experiment import Footing
from phasmid.motion.curves import Path, arctan, cos_and_sin, inverse, root, vector
from phasmid.motion.trunk import TrunkMotion


class Postures(NamedTuple):
    """Plane under the feet at each event of a gait, and the trunk's attitude there.

    Attributes:
        centre: Points of the planes in world axes [m], shape (E, 3).
        slope: Slopes of the planes along x and y, shape (E, 2).
        lean: Slopes of the trunk's floor along x and y, shape (E, 2).
    """

    centre: Float[np.ndarray, "events 3"]
    slope: Float[np.ndarray, "events 2"]
    lean: Float[np.ndarray, "events 2"]


def fit_postures(
    footing: Footing,
    feet: Float[np.ndarray, "events legs 3"],
    trunk: Float[np.ndarray, "events 2"],
) -> Postures:
    """Fit planes to the feet by least squares of the heights.

    Args:
        footing: Attitude of the trunk and its largest lean.
        feet: In world axes [m].
        trunk: x and y of the trunk [m], at which the planes' points are given.
    """
    rows = np.concatenate([feet[..., :2] - trunk[:, None], np.ones((*feet.shape[:2], 1))], axis=-1)
    turned = np.swapaxes(rows, -1, -2)
    fit = np.linalg.solve(turned @ rows, turned @ feet[..., 2:])[..., 0]
    slope, height = fit[:, :2], fit[:, 2]
    steepness = np.hypot(*slope.T)
    most = math.tan(footing.steepest_lean) if footing.trunk_attitude == "follow-terrain" else 0.0
    share = np.minimum(1.0, most / np.where(steepness > 0, steepness, 1.0))
    return Postures(np.concatenate([trunk, height[:, None]], axis=1), slope, slope * share[:, None])


def leaning_trunk(
    postures: Postures,
    before: Int[np.ndarray, " time"],
    s: Path,
    level: TrunkMotion,
    height: float,
) -> TrunkMotion:
    """Return the motion of the trunk over successive planes.

    Between two events the plane under the trunk is a mixture of theirs. On one and the same plane
    the motion is exactly along it.

    Args:
        postures: The planes.
        before: Number of the last event, shape (N,).
        s: Way from it to the next, 0 to 1, and its derivatives by time.
        level: Motion over level ground; its way over the map and its heading are kept.
        height: Height of the body frame over the ground, across it [m].
    """
    x = Path(level.position[:, :2], level.velocity[:, :2], level.acceleration[:, :2])
    yaw = Path(level.yaw, level.attitude_rate[:, 2], level.attitude_acceleration[:, 2])
    last, following = (_height_over(postures, before + k, x) for k in (0, 1))
    ground = last + (following - last) * s

    first, change = postures.lean[before], postures.lean[before + 1] - postures.lean[before]
    lean_x, lean_y = (s * change[:, i] + first[:, i] for i in (0, 1))
    pitch, roll, stretch = _attitude(lean_x, lean_y, yaw)
    east, north = (Path(*(order[:, axis] for order in x)) for axis in (0, 1))
    position = vector(east, north, ground + stretch * height)
    return TrunkMotion(*position, *vector(roll, pitch, yaw))


def _height_over(postures: Postures, event: Int[np.ndarray, " time"], x: Path) -> Path:
    """Return the height of an event's plane under the trunk with its time derivatives."""
    centre, slope = postures.centre[event], postures.slope[event]
    away = x + -centre[:, :2]
    return Path(*(np.sum(slope * v, axis=1) for v in away)) + centre[:, 2]


def _attitude(slope_x: Path, slope_y: Path, yaw: Path) -> tuple[Path, Path, Path]:
    """Pitch and roll with which the trunk's floor has a slope in the world, and its stretch.

    The stretch is the length of the floor's normal (-slope_x, -slope_y, 1). Without its yaw and of
    length 1 it is (sin pitch cos roll, -sin roll, cos pitch cos roll).
    """
    c, s = cos_and_sin(yaw)
    ahead = slope_x * c + slope_y * s
    left = slope_y * c - slope_x * s
    run = root(ahead * ahead + 1.0)
    pitch, roll = arctan(ahead * -1.0), arctan(left * inverse(run))
    return pitch, roll, root(run * run + left * left)
