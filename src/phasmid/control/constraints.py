"""Constraints that limit a velocity or a pose, and the largest share that they allow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from phasmid.gait import shortfall
from phasmid.robot import JOINTS, Robot

NOTHING, REACH, SPEED, SUPPORT, CLEARANCE = range(5)
"""Kinds of constraints."""


class Constraint(NamedTuple):
    """Constraint that a motion violates.

    Attributes:
        kind: `NOTHING` where the motion is feasible, `REACH`, `SPEED`, `SUPPORT` or `CLEARANCE`.
        leg: Index of the leg; -1 for none.
        joint: Index of the joint that would be too fast; -1 for none.
        margin: Support margin [m].
    """

    kind: int
    leg: int
    joint: int
    margin: float

    def sentence(self, robot: Robot) -> str:
        """Return the constraint in words."""
        if self.kind == REACH:
            return f"leg {robot.leg_names[self.leg]} reaches no farther"
        if self.kind == SPEED:
            joint, name = JOINTS[self.joint], robot.leg_names[self.leg]
            return f"the {joint} of leg {name} turns no faster"
        if self.kind == SUPPORT and self.margin <= 0:
            return shortfall(self.margin)
        if self.kind == SUPPORT:
            return f"the support margin would be only {1000 * self.margin:.1f} mm"
        if self.kind == CLEARANCE:
            return "the trunk would come too near to the ground"
        return "nothing"


@dataclass(frozen=True, slots=True)
class VelocityLimit:
    """Largest velocity in a direction, and the constraint that limits it.

    Attributes:
        velocity: vx, vy [m/s] and wz [rad/s].
        reason: The constraint in words.
        leg: Number of the leg that limits, from 1; None for none.
        joint: Index of the joint that would be too fast; None for none.
    """

    velocity: tuple[float, float, float]
    reason: str
    leg: int | None = None
    joint: int | None = None


def largest_share(
    constraint_at: Callable[[float], Constraint],
    most: float = 1.0,
    *,
    relative: float = 0.0,
    absolute: float = 1e-6,
) -> tuple[float, Constraint]:
    """Return the largest feasible share by bisection, and the constraint that limits it.

    Args:
        constraint_at: Constraint that a share violates.
        most: Largest share.
        relative: Error of the share, as a part of it.
        absolute: Least error of the share.
    """
    limit = constraint_at(most)
    if limit.kind == NOTHING:
        return most, limit
    low, high = 0.0, most
    while high - low > max(relative * high, absolute):
        share = (low + high) / 2
        violated = constraint_at(share)
        if violated.kind == NOTHING:
            low = share
        else:
            high, limit = share, violated
    return low, limit
