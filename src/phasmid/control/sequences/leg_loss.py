"""Legs that can no longer be used: noticed, and folded with the joints that still work."""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np
from jaxtyping import Bool, Float

from phasmid.control.observation import Observation
from phasmid.control.sequences.reaching import knees_and_feet
from phasmid.control.sequences.settings import SequenceSettings
from phasmid.robot import JOINTS, Robot

ANSWER_TIME = 0.2
"""A servo that does not answer for longer is lost [s]."""

DOUBT_TIME = 0.02
"""One that does not answer for longer is not counted on meanwhile [s]."""

ROUND_OFF = 1e-9
"""Of times [s]."""

ANGLES = 25
"""Angles of each joint among which a folded pose is looked for."""


class LegFaultDetector:
    """Notices servos that have shut down or answer no more; what is lost stays so.

    Attributes:
        lost: Which servos are lost, shape (L, 3).
        legs: Numbers of the legs with a lost servo, from 1.
        doubtful: Whether there is one that does not answer, and is not lost yet.
        events: Sentences on those that were lost since `reset`, with their times [s].
    """

    def __init__(self, robot: Robot) -> None:
        self._names = robot.leg_names
        self.lost: Bool[np.ndarray, "legs 3"] = np.zeros((len(robot.legs), 3), dtype=bool)
        self.legs: frozenset[int] = frozenset()
        self.doubtful = False
        self.events: list[tuple[float, str]] = []
        self._answered = np.full(self.lost.shape, -math.inf)
        self._all_answered = -math.inf

    def reset(self, time: float) -> None:
        """Forget all; every servo is taken for sound at a time [s]."""
        self.lost[:] = self.doubtful = False
        self.legs = frozenset()
        self._answered[:] = self._all_answered = time
        self.events.clear()

    def notice(self, observation: Observation) -> bool:
        """Look at an observation.

        Returns:
            Whether a servo has been lost by it.
        """
        running, self.doubtful = observation.servo_running, False
        if running is None:
            return False
        time = observation.time
        if running.all():
            self._all_answered = time
            return False
        self._answered[running] = time
        last = np.fmax(self._answered, self._all_answered)
        silence = np.where(self.lost, 0.0, time - last)
        new = silence > ANSWER_TIME + ROUND_OFF
        self.doubtful = bool((silence > DOUBT_TIME + ROUND_OFF).any() and not new.any())
        if not new.any():
            return False
        self.lost |= new
        self.legs = frozenset(int(leg) + 1 for leg in np.flatnonzero(self.lost.any(axis=1)))
        for leg, joint in np.argwhere(new):
            name = f"{self._names[leg]}.{JOINTS[joint]}"
            self.events.append((time, f"servo {name} answers no more; its leg is lost."))
        return True


def lifted_leg(
    robot: Robot,
    leg: int,
    height: float,
    settings: SequenceSettings,
    *,
    dead: Collection[int] = (),
    now: Float[np.ndarray, "3"] | None = None,
) -> tuple[Float[np.ndarray, "3"], float]:
    """A leg off the ground and out of the way, by the joints that still work.

    Of a limp joint nothing is known but its limits: the pose is the one whose knee and foot are
    highest whatever angle that joint takes. With all joints at work it is the most compact one of
    those well clear of the ground.

    Args:
        robot: The robot, L legs.
        leg: Index of the leg.
        height: Of the body's origin over level ground [m].
        settings: Clearances and distances from the joint limits.
        dead: Joints that do not move, 0 to 2.
        now: Its joint angles at present [rad], which dead joints keep; None: unknown.

    Returns:
        Joint angles [rad], shape (3,), and the least height of knee and foot over the ground [m].
    """
    limits = robot.arrays.joint_limits[leg]
    low, high = limits[:, 0] + settings.limit_margin, limits[:, 1] - settings.limit_margin
    low[2] = max(low[2], settings.knee_fold - math.pi)
    share = np.linspace(0.0, 1.0, ANGLES)
    femur, tibia = (low[i] + share * (high[i] - low[i]) for i in (1, 2))
    q = np.zeros((ANGLES, ANGLES, len(robot.legs), 3))
    q[..., leg, 0] = np.clip(0.0, low[0], high[0])
    q[..., leg, 1], q[..., leg, 2] = femur[:, None], tibia
    knees, feet = (points[..., leg, :] for points in knees_and_feet(robot, q))
    lowest = np.minimum(knees[..., 2], feet[..., 2]) + height
    if not {1, 2} & set(dead):
        hip = robot.arrays.p_body_hip[leg]
        away = np.maximum(
            *(np.linalg.norm((points - hip)[..., :2], axis=-1) for points in (knees, feet))
        )
        enough = min(2 * settings.step_height, float(lowest.max()))
        # Compact seen from above, and low.
        size = np.where(lowest >= enough, away + 0.5 * feet[..., 2] + 0.25 * knees[..., 2], np.inf)
        index = np.unravel_index(np.argmin(size), lowest.shape)
        clear = float(lowest[index])
    else:
        # Over each angle of a limp joint the lowest counts.
        worst = lowest
        for axis, joint in enumerate((1, 2)):
            if joint in dead:
                worst = np.broadcast_to(worst.min(axis=axis, keepdims=True), lowest.shape)
        index = np.unravel_index(np.argmax(worst), worst.shape)
        clear = float(worst[index])
    angles = q[index][leg].copy()
    for joint in dead:
        angles[joint] = angles[joint] if now is None else now[joint]
    return angles, clear
