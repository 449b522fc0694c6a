"""Simulated time against the wall clock."""

from __future__ import annotations

import math
from collections import deque

MOST_BEHIND = 0.1
"""Longest time that is caught up, times the pace; the rest of a delay is dropped [s]."""

WINDOW = 1.0
"""Time over which the measured pace is averaged [s]."""


class Pacing:
    """Count of the updates that are due, and the pace that is reached.

    Attributes:
        factor: Commanded ratio of simulated to real time.
    """

    def __init__(self) -> None:
        self.factor = 1.0
        self._wall = self._due = 0.0
        self._marks: deque[tuple[float, float]] = deque()

    def begin(self, wall: float) -> None:
        """Start at this wall time [s]."""
        self._wall, self._due = wall, 0.0
        self._marks.clear()

    def due(self, wall: float, period: float) -> int:
        """Return the number of updates that are due.

        Args:
            wall: Wall time [s].
            period: Simulated time of an update [s].
        """
        self._due += (wall - self._wall) * self.factor
        self._wall = wall
        self._due = min(self._due, MOST_BEHIND * max(self.factor, 1.0) + period)
        return math.floor(self._due / period + 1e-9)

    def done(self, wall: float, now: float, passed: float) -> None:
        """Count simulated time as done.

        Args:
            wall: Wall time [s].
            now: Simulated time [s].
            passed: New part of it [s].
        """
        self._due -= passed
        self._marks.append((wall, now))
        while len(self._marks) > 2 and self._marks[1][0] <= wall - WINDOW:
            self._marks.popleft()

    @property
    def measured(self) -> float:
        """Simulated seconds per second of late; NaN until it is known."""
        if len(self._marks) < 2:
            return math.nan
        (wall, time), (last, now) = self._marks[0], self._marks[-1]
        return (now - time) / (last - wall) if last > wall else math.nan
