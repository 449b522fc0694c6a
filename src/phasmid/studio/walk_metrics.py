"""Speed, power and cost of transport, averaged over the last gait cycle."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from phasmid.reporting.numbers import SHORTEST_DISTANCE


class Metrics(NamedTuple):
    """Averages over the last cycle; NaN until they are known.

    Attributes:
        velocity: In the mean heading of the body: forward, lateral [m/s], yaw [rad/s].
        power: Electrical power of servos with their own law, else mechanical power of the joints,
            without recovery [W].
        cost_of_transport: Energy over weight and distance.
    """

    velocity: tuple[float, float, float] = (math.nan,) * 3
    power: float = math.nan
    cost_of_transport: float = math.nan


class _Mark(NamedTuple):
    time: float
    x: float
    y: float
    yaw: float
    work: float


class WalkMetrics:
    """Poses and work of the last cycle.

    Args:
        weight: Weight of the robot [N].
    """

    def __init__(self, weight: float) -> None:
        self._weight = weight
        self._marks: deque[_Mark] = deque()
        self._work = 0.0

    def add(self, time: float, pose: tuple[float, float, float], work: float) -> None:
        """Add a pose.

        Args:
            time: Simulated time [s].
            pose: x, y [m] and yaw [rad] in the world.
            work: Energy since the last pose [J].
        """
        x, y, yaw = pose
        if self._marks:
            turned = yaw - self._marks[-1].yaw
            yaw -= 2 * math.pi * round(turned / (2 * math.pi))
        self._work += work
        self._marks.append(_Mark(time, x, y, yaw, self._work))

    def mean(self, cycle: float) -> Metrics:
        """Average over the last cycle.

        Args:
            cycle: Its duration [s].
        """
        marks = self._marks
        while len(marks) > 2 and marks[1].time <= marks[-1].time - cycle:
            marks.popleft()
        if len(marks) < 2 or marks[-1].time <= marks[0].time:
            return Metrics()
        old, new = marks[0], marks[-1]
        span, dx, dy = new.time - old.time, new.x - old.x, new.y - old.y
        # The chord of a steady curve points along the mean heading.
        c, s = math.cos((old.yaw + new.yaw) / 2), math.sin((old.yaw + new.yaw) / 2)
        velocity = ((c * dx + s * dy) / span, (c * dy - s * dx) / span, (new.yaw - old.yaw) / span)
        distance, work = math.hypot(dx, dy), new.work - old.work
        cost = work / (self._weight * distance) if distance >= SHORTEST_DISTANCE else math.nan
        return Metrics(velocity, work / span, cost)
