"""The pose of a robot that lies on its belly with its legs folded, and how it can get up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.control.sequences.reaching import angles_and_reach, knees_and_feet
from phasmid.control.sequences.resting import lying
from phasmid.control.sequences.settings import SequenceSettings
from phasmid.errors import InfeasibleWalk
from phasmid.kinematics import neutral_feet
from phasmid.robot import Robot

ANGLES = 61
"""Angles of femur and tibia each among which the folded pose is looked for."""

PLACES = np.concatenate([[1.0], *([1 + d, 1 - d] for d in np.arange(0.05, 0.65, 0.05))])
"""Distances of a foot from its hip at which it may be put down to get up, in neutral ones."""

HEIGHTS = 25
"""Heights between lying and standing at which it must be within reach."""


@dataclass(frozen=True, slots=True, eq=False)
class Packing:
    """Where a robot folds its legs, and where it puts its feet to rise.

    Attributes:
        folded: Joint angles of the folded legs [rad], shape (L, 3).
        feet: Where the feet are put down beside the lying body, in the body frame [m], (L, 3).
        rise: From there to standing [m].
    """

    folded: Float[np.ndarray, "legs 3"]
    feet: Float[np.ndarray, "legs 3"]
    rise: float


def packing(robot: Robot, settings: SequenceSettings) -> Packing:
    """How a robot lies: legs folded as closely as its joints allow and clear of the ground.

    Args:
        robot: The robot, L legs.
        settings: Clearance, and distance from the joint limits.

    Raises:
        InfeasibleWalk: A leg cannot be folded beside the lying body, or cannot lift it.
    """
    standing = neutral_feet(robot)
    underside = -float(robot.body.size[2]) / 2
    feet = standing.copy()
    feet[:, 2] = underside
    hips = robot.arrays.p_body_hip
    missing = np.ones(len(robot.legs), dtype=bool)
    levels = np.linspace(0.0, 1.0, HEIGHTS)[:, None]
    for share in PLACES:
        p = np.repeat(feet[None], HEIGHTS, axis=0)
        p[..., :2] = hips[:, :2] + share * (standing - hips)[:, :2]
        p[..., 2] = underside + levels * (standing[:, 2] - underside)
        _, reached = angles_and_reach(robot, p, settings.limit_margin / 2)
        good = missing & reached.all(axis=0)
        feet[good] = p[0, good]
        missing &= ~good
    if missing.any():
        name = robot.leg_names[int(np.argmax(missing))]
        raise InfeasibleWalk(
            f"leg {name} cannot lift the body from its belly: no place beside its hip is within "
            "reach and joint limits all the way up.",
            where="robot",
        )
    return Packing(_folded(robot, settings), feet, float((feet - standing)[:, 2].mean()))


def _folded(robot: Robot, settings: SequenceSettings) -> Float[np.ndarray, "legs 3"]:
    """The most compact angles of each leg that keep it off ground, itself and trunk."""
    limits = robot.arrays.joint_limits
    low = limits[..., 0] + settings.limit_margin
    high = limits[..., 1] - settings.limit_margin
    share = np.linspace(0.0, 1.0, ANGLES)
    # The neutral direction where that is allowed, with all pairs of femur and tibia.
    q = np.empty((ANGLES, ANGLES, len(robot.legs), 3))
    q[..., 0] = np.clip(0.0, low[:, 0], high[:, 0])
    q[..., 1] = (low[:, 1] + share[:, None] * (high - low)[:, 1])[:, None]
    q[..., 2] = low[:, 2] + share[:, None] * (high - low)[:, 2]
    knees, feet = knees_and_feet(robot, q)
    ground = lying(robot)
    knee, foot = ground.over(knees), ground.over(feet)
    arrays = robot.arrays
    away = [np.linalg.norm((p - arrays.p_body_hip)[..., :2], axis=-1) for p in (knees, feet)]
    fold = np.pi - settings.knee_fold
    allowed = (knee >= settings.clearance) & (foot >= settings.clearance)
    allowed &= (np.abs(q[..., 2]) <= fold) & (away[1] >= arrays.lengths[:, 0])
    # Compact seen from above, and low.
    size = np.maximum(*away) + 0.5 * foot + 0.25 * knee
    size = np.where(allowed, size, np.inf).reshape(-1, len(robot.legs))
    best = np.argmin(size, axis=0)
    legs = np.arange(len(robot.legs))
    if not np.isfinite(size[best, legs]).all():
        name = robot.leg_names[int(np.argmin(np.isfinite(size[best, legs])))]
        raise InfeasibleWalk(
            f"leg {name} cannot be folded: at all its angles knee or foot is in the ground on "
            "which the trunk lies, or in the trunk.",
            where="robot",
        )
    return q.reshape(-1, len(robot.legs), 3)[best, legs]
