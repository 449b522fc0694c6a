"""Workspace of the feet: reach of a leg, reachable targets, longest stride."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.kinematics.frames import hip_from_body, neutral_feet
from phasmid.kinematics.leg import angles_and_margin
from phasmid.robot import Leg, Robot

LIMIT_TOLERANCE = 1e-9
"""An angle may pass a joint limit by this much, which is round-off [rad]."""


def reach(leg: Leg, height: float) -> tuple[float, float]:
    """Nearest and farthest distance of the foot from the coxa axis.

    Args:
        leg: The leg; its joint limits are not regarded.
        height: Height of the foot over the hip along that axis, which is vertical unless the hip
            is tilted [m], negative below it.

    Returns:
        Nearest and farthest distance [m]; both NaN where the leg cannot reach that height.
    """
    coxa, femur, tibia = map(float, leg.lengths)
    left = float(leg.lateral_offsets.sum())
    if abs(height) > femur + tibia:
        return math.nan, math.nan
    far = math.sqrt((femur + tibia) ** 2 - height**2)
    hole = (femur - tibia) ** 2 - height**2
    near = coxa + math.sqrt(hole) if hole > 0 else max(coxa - far, 0.0)
    return math.hypot(near, left), math.hypot(coxa + far, left)


def within_reach(
    robot: Robot, p_hip_feet: Float[np.ndarray, "*batch legs 3"]
) -> Float[np.ndarray, "*batch legs"]:
    """Check which foot targets are reachable within the joint limits.

    Args:
        robot: The robot, L legs.
        p_hip_feet: Targets in the hip frames [m], shape (..., L, 3).

    Returns:
        Ones where a target is reachable, else zeros, shape (..., L).
    """
    q, margin = angles_and_margin(robot.arrays, p_hip_feet)
    lower, upper = np.moveaxis(robot.arrays.joint_limits, -1, 0)
    allowed = (q >= lower - LIMIT_TOLERANCE) & (q <= upper + LIMIT_TOLERANCE)
    return ((margin > 0) & allowed.all(axis=-1)).astype(float)


def longest_stride(robot: Robot, direction: float = 0.0) -> float:
    """Longest straight stride that every leg can make about its neutral foot.

    Args:
        robot: The robot; link lengths and joint limits count, touching legs do not.
        direction: Direction of travel in the body frame, 0 forward [rad].

    Returns:
        Length of the longest step on level ground, feet at neutral height [m].
    """
    away = np.array([math.cos(direction), math.sin(direction), 0.0])
    centre = neutral_feet(robot)

    def reachable(half: np.ndarray) -> np.ndarray:
        ahead = centre + half[:, None, None] * away
        behind = centre - half[:, None, None] * away
        both = within_reach(robot, hip_from_body(robot, np.stack([ahead, behind])))
        return np.asarray(both.all(axis=(0, 2)))

    # A first pass finds the first gap, a second one its edge within a hundredth of a millimetre.
    low, high = 0.0, 2.0 * float(robot.arrays.lengths.sum(axis=1).max())
    for _ in range(3):
        halves = np.linspace(low, high, 401)
        good = reachable(halves)
        first = int(np.argmin(good))
        if good[first]:
            return 2 * high
        if first == 0:
            return 0.0
        low, high = float(halves[first - 1]), float(halves[first])
    return 2 * low
