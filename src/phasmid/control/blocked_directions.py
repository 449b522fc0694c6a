"""Ways on which feet have found no ground, as at the edge of a table."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.control.types import SearchStage, State

SAME_WAY = 0.5
"""Cosine of the angle up to which a foot's way is that on which there was no ground."""

UNKNOWN = -1
"""No number of a leg."""


class Edge:
    """Where a robot goes no farther, since feet have come back from there.

    Args:
        state: Where the engine is.
    """

    def __init__(self, state: State) -> None:
        self._state = state
        self.forget()

    def forget(self) -> None:
        """Forget all."""
        self._ways: dict[int, np.ndarray] = {}
        self._seen, self._back = 0, np.zeros(self._state.leg_count, dtype=bool)

    def is_found(self) -> bool:
        """Whether a foot has come back since this was asked last; its way is then closed."""
        if int(self._state.clock.search_changes) == self._seen:
            return False
        self._seen = int(self._state.clock.search_changes)
        back = self._state.search_stage == SearchStage.RETURNED
        new, self._back = back & ~self._back, back
        for leg in np.flatnonzero(new):
            way = (self._state.missed_foothold - self._state.last_foothold)[leg, :2]
            size = math.hypot(*way)
            if size > 0:
                self._ways[int(leg)] = way / size
        return bool(new.any())

    def closed_by(self, velocity: Float[np.ndarray, "3"]) -> int:
        """The leg whose foot would go where it has found no ground; `UNKNOWN`: none.

        A velocity that leads elsewhere opens all ways again: the ground there may be another.

        Args:
            velocity: Of the body, ahead, left [m/s] and turn [rad/s], shape (3,).
        """
        for leg, closed in self._ways.items():
            way = self._way_of(leg, velocity)
            if way @ closed > SAME_WAY * math.hypot(*way):
                return leg
        if np.any(velocity):
            self._ways.clear()
        return UNKNOWN

    def _way_of(self, leg: int, velocity: Float[np.ndarray, "3"]) -> Float[np.ndarray, "2"]:
        """The velocity in odom at which the body takes a place along where a foot found none."""
        x, y, heading = self._state.path
        c, s = math.cos(heading), math.sin(heading)
        there = self._state.missed_foothold[leg]
        return np.array(
            [
                c * velocity[0] - s * velocity[1] - velocity[2] * (there[1] - y),
                s * velocity[0] + c * velocity[1] + velocity[2] * (there[0] - x),
            ]
        )
