"""How simulated time follows the clock on the wall."""

from __future__ import annotations

import math
from collections import deque

MOST_BEHIND = 0.1
"""Simulated time falls behind where it is later than this, times the pace [s]."""

WINDOW = 1.0
"""Over which the pace that was got is averaged [s]."""


class Pacing:
    """Says how many updates are due, and how fast time really goes.

    A machine that is too slow is not asked for more and more: what could not be done in time is
    left out of the account.

    Attributes:
        factor: How much faster than real time it shall go.
    """

    def __init__(self) -> None:
        self.factor = 1.0
        self._wall = self._owed = 0.0
        self._marks: deque[tuple[float, float]] = deque()

    def begin(self, wall: float) -> None:
        """Time passes from now on.

        Args:
            wall: The clock [s].
        """
        self._wall, self._owed = wall, 0.0
        self._marks.clear()

    def due(self, wall: float, period: float) -> int:
        """Updates that are to be made now.

        Args:
            wall: The clock [s].
            period: Simulated time of an update [s].
        """
        self._owed += (wall - self._wall) * self.factor
        self._wall = wall
        self._owed = min(self._owed, MOST_BEHIND * max(self.factor, 1.0) + period)
        return math.floor(self._owed / period + 1e-9)

    def done(self, wall: float, now: float, passed: float) -> None:
        """Take in what was made.

        Args:
            wall: The clock [s].
            now: Simulated time [s].
            passed: How much of it is new [s].
        """
        self._owed -= passed
        self._marks.append((wall, now))
        while len(self._marks) > 2 and self._marks[1][0] <= wall - WINDOW:
            self._marks.popleft()

    @property
    def got(self) -> float:
        """Simulated seconds in a second, of late; not a number until it is known."""
        if len(self._marks) < 2:
            return math.nan
        (wall, time), (last, now) = self._marks[0], self._marks[-1]
        return (now - time) / (last - wall) if last > wall else math.nan
