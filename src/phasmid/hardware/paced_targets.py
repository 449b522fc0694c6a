"""Joint targets that follow a controller's no faster than a joint speed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

ROUND_OFF = 1e-9
"""Share of a period that counts as round-off."""


class PacedTargets:
    """Follows the targets of a controller no faster than a joint speed.

    The targets are passed in straight lines from one to the next. The controller is updated when
    its last targets are reached, so that its clock is slower than real time where they are too far.

    Args:
        q: Angles at the start [rad], shape (L, 3).
        period: Period of the controller [s].
        update: Returns the targets after another period of the controller's clock.
    """

    def __init__(
        self,
        q: Float[np.ndarray, "legs 3"],
        period: float,
        update: Callable[[], Float[np.ndarray, "legs 3"]],
    ) -> None:
        self._period, self._update = period, update
        self._last = self._next = q
        self._share, self._time = 1.0, period

    def advance(self, speed: float) -> Float[np.ndarray, "legs 3"]:
        """Return the targets a period later, with a largest joint speed [rad/s]."""
        left = self._period
        while left > ROUND_OFF * self._period:
            if self._share >= 1.0 - ROUND_OFF:
                self._last, self._next, self._share = self._next, self._update(), 0.0
                farthest = float(np.abs(self._next - self._last).max())
                self._time = max(self._period, farthest / speed)
            used = min(left, (1.0 - self._share) * self._time)
            self._share += used / self._time
            left -= used
        return self._last + min(self._share, 1.0) * (self._next - self._last)
