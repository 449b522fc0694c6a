"""Weight and length of a robot relative to the one for which absolute numbers were chosen."""

from __future__ import annotations

import math
from dataclasses import dataclass

from phasmid.robot import Robot
from phasmid.units import STANDARD_GRAVITY

REFERENCE_WEIGHT = 4.3333
"""Weight per leg of the preset ``phantomx-ax`` [N]."""

REFERENCE_LENGTH = 0.251
"""Length of coxa, femur and tibia together of the preset ``phantomx-ax`` [m]."""


@dataclass(frozen=True)
class Scale:
    """A robot relative to the preset ``phantomx-ax``.

    Two robots are similar under one gravity if forces follow their weight, lengths their length and
    times the root of their length (Froude). A stiffness then follows force / length, a damping
    force / √length.

    Attributes:
        force: Ratio of the weights per leg.
        length: Ratio of the leg lengths.
    """

    force: float = 1.0
    length: float = 1.0

    @property
    def time(self) -> float:
        """Ratio of the times."""
        return math.sqrt(self.length)

    @property
    def stiffness(self) -> float:
        """Ratio of the stiffnesses."""
        return self.force / self.length

    @property
    def damping(self) -> float:
        """Ratio of the dampings."""
        return self.force * self.time / self.length


def scale_of(robot: Robot, payload: float = 0.0) -> Scale:
    """Return the scale of a robot as its file gives it.

    The weight is that at standard gravity and without payload: the ground must not change with
    what the robot carries or with the planet. The leg length is coxa, femur and tibia, the mean of
    all legs. Ratios have four digits: round-off of an imported file must not change a run.

    Args:
        robot: The robot.
        payload: Part of its mass that it carries [kg].
    """
    weight = (robot.mass - payload) * STANDARD_GRAVITY / len(robot.legs)
    length = float(robot.arrays.lengths.sum(axis=1).mean())
    return Scale(
        float(f"{weight / REFERENCE_WEIGHT:.4g}"), float(f"{length / REFERENCE_LENGTH:.4g}")
    )
