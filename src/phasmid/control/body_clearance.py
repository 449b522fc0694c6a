"""Clearance of the trunk: a pose must not lay it on the ground."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.robot import Robot

CLEARANCE = 0.02
"""Least height of the underside over the plane of the feet; soft joints take part of it [m]."""

BISECTIONS = 12
"""Steps in which the feasible part of a pose is found."""


class BodyClearance:
    """Clearance of a trunk over the plane of the feet.

    Args:
        robot: The robot.
        height: Height of the body's origin over the feet in its neutral pose [m].
    """

    def __init__(self, robot: Robot, height: float) -> None:
        self._half = tuple(float(size) / 2 for size in robot.body.size)
        self._height = height

    def clearance(self, pose: Float[np.ndarray, "6"]) -> float:
        """Return the height of the trunk's lowest corner over the plane of the feet [m].

        Args:
            pose: Pose relative to the path and the neutral height [m, rad], shape (6,).
        """
        roll, pitch = float(pose[3]), float(pose[4])
        length, width, height = self._half
        # Extents of the box along the vertical.
        down = length * abs(math.sin(pitch)) + width * abs(math.cos(pitch) * math.sin(roll))
        down += height * math.cos(pitch) * math.cos(roll)
        return self._height + float(pose[2]) - down

    def feasible_pose_scale(
        self, base: Float[np.ndarray, "6"], pose: Float[np.ndarray, "6"]
    ) -> float:
        """Return the part of a pose that keeps the clearance, or that of the base if it is less.

        Args:
            base: Pose that is not scaled, shape (6,).
            pose: Pose that is added to it, shape (6,).
        """
        least = min(CLEARANCE, self.clearance(base))
        if self.clearance(base + pose) >= least:
            return 1.0
        low, high = 0.0, 1.0
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            if self.clearance(base + middle * pose) >= least:
                low = middle
            else:
                high = middle
        return low
