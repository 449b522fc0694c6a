"""Detection of lost legs, and a pose that keeps such a leg off the ground."""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np
from jaxtyping import Bool, Float

from phasmid.control.sequences.posture import KNEE_FOLD, leg_poses, resting_limits
from phasmid.control.sequences.stance import STEP_HEIGHT
from phasmid.experiment.observation import Observation
from phasmid.robot import Robot

LOSS_TIME = 0.2
"""Silence after which a servo is lost [s]."""

DOUBT_TIME = 0.02
"""Silence after which a servo is doubtful [s]."""

ROUND_OFF = 1e-9
"""Of times [s]."""

ANGLES = 25
"""Femur and tibia angles each, among which the pose of a lost leg is searched."""


class LegFaultDetector:
    """Detects servos that have shut down or do not answer; a lost servo stays lost.

    Attributes:
        lost: Lost servos, shape (L, 3).
        legs: Numbers of the legs with a lost servo, from 1.
        doubtful: Whether a servo does not answer that is not lost yet.
    """

    def __init__(self, robot: Robot) -> None:
        self.lost: Bool[np.ndarray, "legs 3"] = np.zeros((len(robot.legs), 3), dtype=bool)
        self._answered = np.zeros(self.lost.shape)
        self.reset(0.0)

    def reset(self, time: float) -> None:
        """Take every servo as sound at a time [s]."""
        self.lost[:] = self.doubtful = False
        self.legs: frozenset[int] = frozenset()
        self._answered[:] = time

    def update(self, observation: Observation) -> list[tuple[int, int]]:
        """Return indices of leg and joint of servos that an observation shows as lost."""
        running, self.doubtful = observation.servo_running, False
        if running is None:
            return []
        if running.all():
            self._answered[:] = observation.time
            return []
        self._answered[running | self.lost] = observation.time
        silence = observation.time - self._answered
        found = np.argwhere(silence > LOSS_TIME + ROUND_OFF).tolist()
        self.doubtful = not found and bool(silence.max() > DOUBT_TIME + ROUND_OFF)
        for leg, joint in found:
            self.lost[leg, joint] = True
            self.legs |= {leg + 1}
        return [(leg, joint) for leg, joint in found]


def lifted_leg(
    robot: Robot,
    leg: int,
    height: float,
    dead: Collection[int],
    q: Float[np.ndarray, "3"],
) -> tuple[Float[np.ndarray, "3"], float]:
    """Search a pose of a lost leg off the ground, by the joints that still work.

    A dead femur or tibia may turn to any angle. The pose is the one whose knee and foot stay
    highest whatever that angle is. If only the coxa is dead, it is the most compact pose well
    clear of the ground. Dead joints, 0 to 2, keep their measured angles [rad].

    Returns:
        Joint angles [rad], shape (3,), and the least height of knee and foot [m].
    """
    low, high = resting_limits(robot)
    low[:, 2] = np.maximum(low[:, 2], KNEE_FOLD - math.pi)
    poses, points, extent = leg_poses(robot, low, high, ANGLES)
    lowest = points[..., leg, 2].min(axis=0) + height
    limp = tuple(joint - 1 for joint in (1, 2) if joint in dead)
    if limp:
        cost = -np.broadcast_to(lowest.min(axis=limp, keepdims=True), lowest.shape)
        clearance = float(-cost.min())
    else:
        enough = min(2 * STEP_HEIGHT, float(lowest.max()))
        cost = np.where(lowest >= enough, extent[..., leg], np.inf)
        clearance = float(lowest.flat[np.argmin(cost)])
    pose = poses[..., leg, :].reshape(-1, 3)[np.argmin(cost)].copy()
    dead = list(dead)
    if np.isfinite(q).all():
        pose[dead] = q[dead]
    return pose, clearance
