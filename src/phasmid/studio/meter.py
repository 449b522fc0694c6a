"""Speed, power and cost of the walk, averaged over its last cycle."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from phasmid.reporting.joints import SHORTEST_DISTANCE


class Reading(NamedTuple):
    """What the last cycle gave; not a number until it is known.

    Attributes:
        velocity: In the body's heading: ahead, to the left [m/s], turn to the left [rad/s].
        power: What servos of their own law drew, or else what the joints gave, nothing won back
            [W].
        cost_of_transport: That energy over weight and way.
    """

    velocity: tuple[float, float, float]
    power: float
    cost_of_transport: float


UNKNOWN = Reading((math.nan,) * 3, math.nan, math.nan)


class _Mark(NamedTuple):
    time: float
    x: float
    y: float
    yaw: float
    work: float


class Meter:
    """Remembers as much of the way as a cycle takes.

    Args:
        weight: Of the robot [N].
    """

    def __init__(self, weight: float) -> None:
        self._weight = weight
        self._marks: deque[_Mark] = deque()
        self._work = 0.0

    def note(self, time: float, place: tuple[float, float, float], work: float) -> None:
        """Take in where the body is now.

        Args:
            time: [s].
            place: x, y [m] and yaw [rad] in the world.
            work: Energy since the last note [J].
        """
        x, y, yaw = place
        if self._marks:
            turned = yaw - self._marks[-1].yaw
            yaw -= 2 * math.pi * round(turned / (2 * math.pi))
        self._work += work
        self._marks.append(_Mark(time, x, y, yaw, self._work))

    def read(self, cycle: float) -> Reading:
        """The averages over the last cycle.

        Args:
            cycle: How long it takes [s].
        """
        marks = self._marks
        while len(marks) > 2 and marks[1].time <= marks[-1].time - cycle:
            marks.popleft()
        if len(marks) < 2:
            return UNKNOWN
        old, new = marks[0], marks[-1]
        span, dx, dy = new.time - old.time, new.x - old.x, new.y - old.y
        if span <= 0:
            return UNKNOWN
        # The chord of a steady curve points where the body looked half way.
        c, s = math.cos((old.yaw + new.yaw) / 2), math.sin((old.yaw + new.yaw) / 2)
        velocity = ((c * dx + s * dy) / span, (c * dy - s * dx) / span, (new.yaw - old.yaw) / span)
        way, work = math.hypot(dx, dy), new.work - old.work
        cost = work / (self._weight * way) if way >= SHORTEST_DISTANCE else math.nan
        return Reading(velocity, work / span, cost)
