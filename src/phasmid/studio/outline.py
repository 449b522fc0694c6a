"""Where a foot can go: outlines to draw, within the joint limits of its leg."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.kinematics import foot_position
from phasmid.robot import Leg, Robot

STEP = np.radians(3.0)
"""Angle between neighbouring points of an arc: on a leg of 0.25 m they leave it by 0.1 mm."""


class Workspace(NamedTuple):
    """Where the foot of a leg can go.

    Attributes:
        side: Closed curves in the leg's own plane, whose fillings together are the reachable
            region: distance from the coxa axis and height over the hip [m], each of shape (N, 2).
            Each is one way to bend the knee.
        above: The region's shadow along the coxa axis, a closed curve of x and y in the hip frame
            [m], shape (N, 2).
    """

    side: tuple[Float[np.ndarray, "points 2"], ...]
    above: Float[np.ndarray, "points 2"]


def workspace(robot: Robot, leg: int) -> Workspace:
    """Outlines of the region that a foot reaches within its joint limits; computed once per leg.

    Args:
        robot: The robot.
        leg: The leg's number, from 1.

    Returns:
        The region outwards of the coxa axis, where the inverse kinematics looks for feet.

    Raises:
        InvalidRobot: There is no such leg.
    """
    return _workspace(robot.leg(leg))


@lru_cache(32)
def _workspace(leg: Leg) -> Workspace:
    (coxa_low, coxa_high), (low, high), (bent, straight) = leg.joint_limits.tolist()
    # With the knee bent to one side no two pairs of angles share a foot, so that the edges of the
    # limits are the edges of the region. A knee that passes the stretched leg makes two regions.
    flat = np.pi * np.arange(np.ceil(bent / np.pi), np.floor(straight / np.pi) + 1)
    bends = np.unique([bent, *flat, straight])
    side = tuple(_sheet(leg, (low, high), pair) for pair in pairwise(bends.tolist()))
    out = np.concatenate(side)[:, 0]
    turn = _between(coxa_low, coxa_high)
    arc = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    return Workspace(side, np.concatenate([out.max() * arc, out.min() * arc[::-1]]))


def _sheet(leg: Leg, femur: tuple[float, float], tibia: tuple[float, float]) -> np.ndarray:
    """The foot along the edges of a rectangle of angles: its distance and height [m]."""
    up, bend = _between(*femur), _between(*tibia)
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


def _between(low: float, high: float) -> np.ndarray:
    return np.linspace(low, high, 2 + int((high - low) / STEP))


def at_height(side: Float[np.ndarray, "points 2"], height: float) -> list[tuple[float, float]]:
    """Distances from the coxa axis at which a closed curve encloses this height.

    Args:
        side: One of `Workspace.side`.
        height: Over the hip [m].

    Returns:
        Nearest and farthest distance of each stretch [m]; none where it does not come so high.
    """
    (r0, z0), (r1, z1) = side.T, np.roll(side, -1, axis=0).T
    crosses = (z0 <= height) != (z1 <= height)
    share = (height - z0[crosses]) / (z1 - z0)[crosses]
    crossings = np.sort(r0[crosses] + share * (r1 - r0)[crosses]).tolist()
    pairs = zip(crossings[::2], crossings[1::2], strict=True)
    return [(near, far) for near, far in pairs if far > near]
