"""The largest velocity in a direction, and what keeps a robot from a larger one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.control.types import REACH, SPEED, SUPPORT
from phasmid.gait import shortfall
from phasmid.robot import JOINTS, Robot


@dataclass(frozen=True, slots=True)
class VelocityLimit:
    """The largest velocity in a direction, and what keeps the robot from a larger one.

    Attributes:
        velocity: Ahead, left [m/s] and turn [rad/s].
        reason: In words.
        leg: Number of the leg that limits, from 1; None: none alone.
        joint: Index of its joint that would turn too fast; None: it is not its speed.
    """

    velocity: tuple[float, float, float]
    reason: str
    leg: int | None = None
    joint: int | None = None


def limiting_constraint(
    verdict: Float[np.ndarray, "4"], robot: Robot
) -> tuple[str, int | None, int | None]:
    """What keeps a robot from more, in words; number of the leg, and index of its joint.

    Args:
        verdict: As `gait_is_feasible` writes it.
        robot: Its legs have names.
    """
    what, leg, joint, value = verdict
    if what == REACH:
        return f"leg {robot.legs[int(leg)].name} reaches no farther", int(leg) + 1, None
    if what == SPEED:
        name, which = robot.legs[int(leg)].name, JOINTS[int(joint)]
        return f"the {which} of leg {name} turns no faster", int(leg) + 1, int(joint)
    if what == SUPPORT:
        if value <= 0:
            return shortfall(value), None, None
        return f"the support margin would be only {1000 * value:.1f} mm", None, None
    return "nothing", None, None
