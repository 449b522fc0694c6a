"""How low the trunk may go: a pose must not lay it on the ground."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.kinematics import quaternion_rotation, rpy_quaternion
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
        half = np.asarray(robot.body.size) / 2
        self._corners = half * [[x, y, -1.0] for x in (-1.0, 1.0) for y in (-1.0, 1.0)]
        self._height = height

    def lowest(self, pose: Float[np.ndarray, "6"]) -> float:
        """Height of its lowest corner over the plane of the feet [m].

        Args:
            pose: Of the body beside its path and its neutral height [m, rad], shape (6,).
        """
        roll, pitch = (np.array(angle) for angle in pose[3:5])
        up = quaternion_rotation(rpy_quaternion(roll, pitch, np.array(0.0)))[2]
        return float(self._height + pose[2] + (self._corners @ up).min())

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
