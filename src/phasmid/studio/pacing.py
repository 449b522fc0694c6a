"""Simulated time against the wall clock."""

from __future__ import annotations

import math
from collections import deque

MOST_BEHIND = 0.1
"""Longest time that is caught up, times the pace; the rest of a delay is dropped [s]."""

WINDOW = 1.0
"""Time over which the measured pace is averaged [s]."""


class Pacing:
    """Number of updates that are due, and the pace that is reached.

    Attributes:
        factor: Commanded ratio of simulated to real time.
    """

    def __init__(self) -> None:
        self.factor = 1.0
        self._wall = self._target = 0.0
        self._marks: deque[tuple[float, float]] = deque()

    def begin(self, wall: float, now: float) -> None:
        """Start at a wall time and a simulated time [s]."""
        self._wall, self._target = wall, now
        self._marks.clear()

    def due(self, wall: float, now: float, period: float) -> int:
        """Return the number of updates that are due.

        Args:
            wall: Wall time [s].
            now: Simulated time [s].
            period: Simulated time of an update [s].
        """
        self._target += (wall - self._wall) * self.factor
        self._target = min(self._target, now + MOST_BEHIND * max(self.factor, 1.0) + period)
        self._wall = wall
        self._marks.append((wall, now))
        while len(self._marks) > 2 and self._marks[1][0] <= wall - WINDOW:
            self._marks.popleft()
        return math.floor((self._target - now) / period + 1e-6)

    @property
    def measured(self) -> float:
        """Simulated seconds per second of late; NaN until it is known."""
        if len(self._marks) < 2:
            return math.nan
        (wall, time), (last, now) = self._marks[0], self._marks[-1]
        return (now - time) / (last - wall) if last > wall else math.nan
