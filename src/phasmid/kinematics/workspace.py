"""Workspace of the feet: reach of a leg, reachable targets."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.arguments import explained
from phasmid.kinematics.leg import angles_and_margin, foot_position
from phasmid.robot import Leg, Robot

ARC_STEP = np.radians(3.0)
"""Angle between neighbouring points of an arc: a chord on a leg of 0.25 m deviates by 0.1 mm."""

LIMIT_TOLERANCE = 1e-9
"""An angle may pass a joint limit by this much, which is round-off [rad]."""


@explained
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


@explained
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


def usable_limits(leg: Leg) -> Float[np.ndarray, "3 2"]:
    """Joint limits within the angles that `joint_angles` returns.

    Args:
        leg: The leg.

    Returns:
        Lowest and highest angles [rad], shape (3, 2): at most half a turn to either side, the knee
        bent down or stretched. Where the lowest is above the highest, no angle is usable.
    """
    lower, upper = leg.joint_limits.T
    return np.stack([np.maximum(lower, -np.pi), np.minimum(upper, [np.pi, np.pi, 0.0])], axis=1)


def plane_outline(
    leg: Leg, femur: tuple[float, float], tibia: tuple[float, float]
) -> Float[np.ndarray, "points 2"]:
    """Edge of the region of the foot in the leg's plane, for ranges of femur and tibia angles.

    With the knee bent to one side the foot is a one-to-one function of the angles: the edges of
    the ranges are the edges of the region.

    Args:
        leg: The leg.
        femur: Lowest and highest angle [rad].
        tibia: Lowest and highest angle, both of one sign [rad].

    Returns:
        Distance from the coxa axis and height over the hip [m], shape (N, 2), a closed curve.
    """
    up, bend = arc(*femur), arc(*tibia)
    edges = [
        (up, np.full_like(up, tibia[0])),
        (np.full_like(bend, femur[1]), bend),
        (up[::-1], np.full_like(up, tibia[1])),
        (np.full_like(bend, femur[0]), bend[::-1]),
    ]
    q2, q3 = (np.concatenate(each) for each in zip(*edges, strict=True))
    foot = foot_position(leg, np.stack([np.zeros_like(q2), q2, q3], axis=-1))[:, [0, 2]]
    # What lies behind the coxa axis folds onto it.
    return np.column_stack([np.maximum(foot[:, 0], 0.0), foot[:, 1]])


def arc(low: float, high: float) -> Float[np.ndarray, " points"]:
    """Angles from one to another, at most `ARC_STEP` apart [rad]."""
    return np.linspace(low, high, 2 + int((high - low) / ARC_STEP))
