"""How low the trunk may go: a pose must not lay it on the ground."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.robot import Robot

CLEARANCE = 0.02
"""Least height of the underside over the plane of the feet; soft joints take a part of it [m]."""

LOOKS = 12
"""How often the part of a pose is halved that can be had."""


class Belly:
    """The trunk's underside.

    Args:
        robot: The robot.
        height: Of the body's origin over the feet in its neutral pose [m].
    """

    def __init__(self, robot: Robot, height: float) -> None:
        self._half = tuple(float(size) / 2 for size in robot.body.size)
        self._height = height

    def lowest(self, pose: Float[np.ndarray, "6"]) -> float:
        """Height of its lowest corner over the plane of the feet [m].

        Args:
            pose: Of the body beside its path and its neutral height [m, rad], shape (6,).
        """
        roll, pitch = float(pose[3]), float(pose[4])
        length, width, height = self._half
        # By how much each half of the box reaches down: its sides along the world's vertical.
        down = length * abs(math.sin(pitch)) + width * abs(math.cos(pitch) * math.sin(roll))
        down += height * math.cos(pitch) * math.cos(roll)
        return self._height + float(pose[2]) - down

    def share(self, base: Float[np.ndarray, "6"], pose: Float[np.ndarray, "6"]) -> float:
        """Part of a pose at which it stays as high as it must be, or as it is without.

        Args:
            base: Of which nothing is taken away, shape (6,).
            pose: What is added to it, shape (6,).
        """
        least = min(CLEARANCE, self.lowest(base))
        if self.lowest(base + pose) >= least:
            return 1.0
        low, high = 0.0, 1.0
        for _ in range(LOOKS):
            middle = (low + high) / 2
            if self.lowest(base + middle * pose) >= least:
                low = middle
            else:
                high = middle
        return low
