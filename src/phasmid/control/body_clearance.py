"""Clearance of the trunk over the ground, which a pose must keep."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.control.constraints import CLEARANCE, NOTHING, Constraint, largest_share
from phasmid.robot import Robot

LEAST = 0.02
"""Least clearance; compliant joints take part of it [m]."""


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
    ) -> tuple[float, Constraint]:
        """Return the share of a pose that keeps the clearance, and the constraint.

        Args:
            base: Pose that is not scaled, shape (6,); it may have less clearance.
            pose: Pose that is added to it, shape (6,).
        """
        least = min(LEAST, self.clearance(base))
        return largest_share(
            lambda share: Constraint(
                NOTHING if self.clearance(base + share * pose) >= least else CLEARANCE
            ),
            absolute=2**-12,
        )
