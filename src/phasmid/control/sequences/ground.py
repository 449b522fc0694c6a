"""Ground under a robot at rest, from its joint angles, and joint angles for given feet."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from jaxtyping import Bool, Float

from phasmid.kinematics import centre_of_mass, hip_from_body, link_frames, quaternion_rotation
from phasmid.kinematics.leg import angles_and_margin
from phasmid.robot import Robot

TOUCH = 0.004
"""Points nearer to the ground than this touch it [m]."""

ROUND_OFF = 1e-7
"""Of heights [m]."""

BALL_ITERATIONS = 3
"""Planes of balls after the first; the last one moves their contacts by micrometres."""

STRETCH_MARGIN = 1e-4
"""Margin of a foot to full stretch: difference of squared lengths, relative to the leg's [1]."""


@dataclass(frozen=True, slots=True, eq=False)
class GroundPlane:
    """Level ground in body axes, under a robot at rest.

    Attributes:
        normal: Upwards, in body axes, shape (3,).
        body_height: Height of the body's origin [m].
        contact: Feet that touch the ground, shape (L,).
        belly_contact: Whether the trunk touches the ground.
    """

    normal: Float[np.ndarray, "3"]
    body_height: float
    contact: Bool[np.ndarray, " legs"]
    belly_contact: bool

    def height(self, p_body: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch"]:
        """Return heights of points of the body frame over the ground [m]."""
        return p_body @ self.normal + self.body_height


def belly_ground(robot: Robot) -> GroundPlane:
    """Return the ground under a robot that lies flat on its belly, feet in the air."""
    contact = np.zeros(len(robot.legs), dtype=bool)
    return GroundPlane(np.array([0.0, 0.0, 1.0]), -float(robot.body.box[0, 2]), contact, True)


def resting_ground(
    robot: Robot,
    q: Float[np.ndarray, "legs 3"],
    up: Float[np.ndarray, "3"] | None = None,
) -> GroundPlane:
    """Return the ground on which a robot rests with feet, knees and corners of its trunk.

    Three points carry it if no point lies below their plane and the centre of mass is above their
    triangle. Of several such planes the one whose normal is nearest to `up` counts: the measured
    direction against gravity in body axes, or the body's z axis.
    """
    corners = robot.body.box_points(np.array([(x, y, -1) for x, y in product((1, -1), repeat=2)]))
    com, axis = centre_of_mass(robot, q), np.array([0.0, 0.0, 1.0])
    ground = _plane_under(robot, q, corners, com, axis if up is None else up, axis)
    # A ball touches where its centre is over the plane: each plane moves these points a little.
    for _ in range(BALL_ITERATIONS if robot.foot_radius else 0):
        ground = _plane_under(robot, q, corners, com, axis if up is None else up, ground.normal)
    return ground


def _plane_under(
    robot: Robot,
    q: Float[np.ndarray, "legs 3"],
    corners: Float[np.ndarray, "corners 3"],
    com: Float[np.ndarray, "3"],
    up: Float[np.ndarray, "3"],
    normal_before: Float[np.ndarray, "3"],
) -> GroundPlane:
    """Return the plane that carries a robot, with feet that touch beneath along a normal."""
    knees, feet = knees_and_soles(robot, q, normal_before)
    points = np.concatenate([feet, knees, corners])
    a, b, c = points[np.array(list(combinations(range(len(points)), 3)))].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    normal /= np.where(area > 0, np.copysign(area, normal[:, 2]), 1.0)[:, None]
    heights = points @ normal.T - np.sum(a * normal, axis=1)
    carries = (area > 1e-8) & (heights.min(axis=0) > -ROUND_OFF) & (normal[:, 2] > 0.1)
    for p1, p2, p3 in ((a, b, c), (b, c, a), (c, a, b)):
        inward = np.cross(normal, p2 - p1)
        third, over = (np.sum((p - p1) * inward, axis=1) for p in (p3, com))
        carries &= third * over >= -1e-12
    if not carries.any():
        return belly_ground(robot)
    candidates = np.flatnonzero(carries)
    best = candidates[int(np.argmax(normal[candidates] @ up))]
    n, height = normal[best], -float(a[best] @ normal[best])
    return GroundPlane(
        n, height, feet @ n + height < TOUCH, bool((corners @ n + height < TOUCH).any())
    )


def up_direction(
    orientation: Float[np.ndarray, "4"] | None,
) -> Float[np.ndarray, "3"] | None:
    """Return the direction against gravity in body axes; None without a valid orientation."""
    if orientation is None or not np.isfinite(orientation).all() or not np.any(orientation):
        return None
    return np.asarray(quaternion_rotation(orientation / np.linalg.norm(orientation))[2])


def knees_and_feet(
    robot: Robot, q: Float[np.ndarray, "*batch legs 3"]
) -> tuple[Float[np.ndarray, "*batch legs 3"], Float[np.ndarray, "*batch legs 3"]]:
    """Return knees and feet in the body frame [m], each of shape (..., L, 3)."""
    frames = link_frames(robot, q)
    knees, ends = frames.position[..., 2, :], np.array([leg.tibia.end for leg in robot.legs])
    return knees, knees + (frames.rotation[..., 2, :, :] @ ends[..., None])[..., 0]


def knees_and_soles(
    robot: Robot, q: Float[np.ndarray, "*batch legs 3"], up: Float[np.ndarray, "3"]
) -> tuple[Float[np.ndarray, "*batch legs 3"], Float[np.ndarray, "*batch legs 3"]]:
    """Return knees, and the lowest points of the feet on ground with a normal `up` in body axes."""
    knees, feet = knees_and_feet(robot, q)
    return knees, feet - robot.foot_radius * up


def solve_feet(
    robot: Robot, p_body_feet: Float[np.ndarray, "*batch legs 3"], margin: float = 0.0
) -> tuple[Float[np.ndarray, "*batch legs 3"], Bool[np.ndarray, "*batch legs"]]:
    """Return joint angles [rad] for feet in the body frame [m], and which legs reach them.

    Legs keep a margin [rad] to their joint limits.
    """
    arrays = robot.arrays
    q, slack = angles_and_margin(arrays, hip_from_body(robot, p_body_feet))
    low, high = arrays.joint_limits[..., 0] + margin, arrays.joint_limits[..., 1] - margin
    # Comparisons with NaN are false: such a foot is out of reach.
    within = slack >= STRETCH_MARGIN * (arrays.lengths[:, 1] + arrays.lengths[:, 2]) ** 2
    return q, within & ((q >= low - 1e-9) & (q <= high + 1e-9)).all(axis=-1)
