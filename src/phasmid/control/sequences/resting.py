"""On what a robot rests, by the shape that its joints give it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from jaxtyping import Bool, Float

from phasmid.control.observation import Observation
from phasmid.control.sequences.reaching import knees_and_feet
from phasmid.kinematics import centre_of_mass, quaternion_rotation
from phasmid.robot import Robot

TOUCH = 0.004
"""What is lower than this over the ground that the robot rests on touches it [m]."""

SAME_HEIGHT = 1e-7
"""Round-off of heights [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Resting:
    """The ground as a robot at rest on it sees it, if it is level.

    Attributes:
        normal: Upwards, in body axes, shape (3,).
        height: Of the body's origin over it [m].
        feet: Which feet touch it, shape (L,).
        on_belly: Whether the trunk touches it.
    """

    normal: Float[np.ndarray, "3"]
    height: float
    feet: Bool[np.ndarray, " legs"]
    on_belly: bool

    def over(self, p_body: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch"]:
        """Height of points of the body frame over the ground [m], shape (...)."""
        return p_body @ self.normal + self.height


def belly_corners(robot: Robot) -> Float[np.ndarray, "4 3"]:
    """Corners of the trunk's underside in the body frame [m], shape (4, 3)."""
    length, width, height = robot.body.size / 2
    return np.array([[a * length, b * width, -height] for a, b in product((1, -1), repeat=2)])


def lying(robot: Robot) -> Resting:
    """The ground on which a robot lies flat with no foot on it."""
    none = np.zeros(len(robot.legs), dtype=bool)
    return Resting(np.array([0.0, 0.0, 1.0]), float(robot.body.size[2]) / 2, none, True)


def resting(
    robot: Robot,
    q: Float[np.ndarray, "legs 3"],
    up: Float[np.ndarray, "3"] | None = None,
) -> Resting:
    """On which of its feet, knees and the trunk's corners a robot comes to rest on level ground.

    It rests on three points such that all others lie above their plane and the centre of mass
    above their triangle. Of several such the one is taken whose ground is nearest to what the
    inertial sensor says is level.

    Args:
        robot: The robot, L legs.
        q: Joint angles [rad], shape (L, 3).
        up: Direction against gravity in body axes, by that sensor; None: the body's own z.
    """
    knees, feet = knees_and_feet(robot, q)
    corners = belly_corners(robot)
    points = np.concatenate([feet, knees, corners])
    com = centre_of_mass(robot, q)
    sky = np.array([0.0, 0.0, 1.0]) if up is None else up
    a, b, c = points[np.array(list(combinations(range(len(points)), 3)))].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1)
    normal *= (
        np.where(normal[:, 2] < 0, -1.0, 1.0)[:, None] / np.where(size > 0, size, 1.0)[:, None]
    )
    heights = points @ normal.T - np.sum(a * normal, axis=1)
    holds = (size > 1e-8) & (heights.min(axis=0) > -SAME_HEIGHT) & (normal[:, 2] > 0.1)
    for p1, p2, p3 in ((a, b, c), (b, c, a), (c, a, b)):
        inward = np.cross(normal, p2 - p1)
        side = np.sum((p3 - p1) * inward, axis=1)
        over = np.sum((com - p1) * inward, axis=1)
        holds &= side * over >= -1e-12
    if not holds.any():
        return lying(robot)
    found = np.flatnonzero(holds)
    best = found[int(np.argmax(normal[found] @ sky))]
    n, offset = normal[best], -float(a[best] @ normal[best])
    touching = feet @ n + offset < TOUCH
    return Resting(n, offset, touching, bool((corners @ n + offset < TOUCH).any()))


def upwards(observation: Observation) -> Float[np.ndarray, "3"] | None:
    """The direction against gravity in body axes, by the inertial sensor.

    Args:
        observation: What it tells; None is returned where it tells nothing.
    """
    turn = observation.orientation
    if turn is None or not np.isfinite(turn).all() or not np.any(turn):
        return None
    return np.asarray(quaternion_rotation(turn / np.linalg.norm(turn))[2])
