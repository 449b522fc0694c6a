"""The course of a walk over level ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.gait import Gait, sway
from phasmid.kinematics import neutral_feet
from phasmid.motion.curves import Path
from phasmid.motion.feet import coxa_only_feet, straight_feet
from phasmid.motion.sway import swayed
from phasmid.motion.trunk import TrunkMotion, progress, trunk_motion
from phasmid.robot import Robot
from phasmid.scenario.stride import StrideTable


@dataclass(frozen=True, eq=False)
class LevelCourse:
    """Motion of trunk and feet over level ground.

    Attributes:
        robot: The robot, L legs.
        gait: The gait.
        stride: Heights, times and curves.
        step: Displacement of one step: forward [m], left [m], turn [rad].
    """

    robot: Robot
    gait: Gait
    stride: StrideTable
    step: Float[np.ndarray, "3"]

    def motion(self, time: Float[np.ndarray, " time"]) -> tuple[TrunkMotion, Path]:
        """Return the motion of the trunk, and of the feet in the body frame.

        Args:
            time: Times [s], shape (N,).
        """
        robot, gait, stride, step = self.robot, self.gait, self.stride, self.step
        # Level ground lies under the mean of the neutral feet.
        height = -float(neutral_feet(robot)[:, 2].mean())
        trunk = trunk_motion(step, height, progress(gait, stride, time))
        if gait.sway:
            trunk = swayed(trunk, sway(gait, neutral_feet(robot), stride.period, time))
        if stride.stance_law == "straight":
            return trunk, straight_feet(robot, gait, stride, step, time, trunk)
        return trunk, coxa_only_feet(robot, gait, stride, step, time, height)
