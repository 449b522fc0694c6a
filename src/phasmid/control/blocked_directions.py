"""Directions in which feet have found no ground, as at the edge of a table."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.control.types import SearchStage, State
from phasmid.control.vectors import point_velocity

ROUGH, MOST_RETURNS, SAME_PLACE = 0.005, 3, 0.06
"""Roughness from which on ground is rough [m]; returns of feet after which their directions are
blocked on rough ground or with a height map, where the next foothold may be on ground (elsewhere
after the first); distance that the robot walks after which they are counted anew [m]."""

SAME_DIRECTION = 0.5
"""Cosine of the angle up to which two directions count as the same."""


class BlockedDirections:
    """Directions that the robot does not walk in, since feet have returned from there.

    Args:
        state: State of the engine.
    """

    def __init__(self, state: State) -> None:
        self._state = state
        self.clear()

    def clear(self) -> None:
        """Unblock all directions."""
        self._directions: dict[int, np.ndarray] = {}
        self._count, self._place = 0, np.zeros(2)
        self._changes, self._returned = 0, np.zeros(self._state.leg_count, dtype=bool)

    def update(self, roughness: float, mapped: bool) -> bool:
        """Block the directions of feet that have returned.

        Args:
            roughness: Estimated roughness of the ground [m].
            mapped: Whether footholds are planned on a height map.

        Returns:
            Whether there is a new direction.
        """
        state = self._state
        if state.clock.search_changes == self._changes:
            return False
        self._changes = state.clock.search_changes
        returned = state.search_stage == SearchStage.RETURNED
        new, self._returned = returned & ~self._returned, returned
        if new.any():
            if math.dist(state.path[:2], self._place) > SAME_PLACE:
                self._count, self._place = 0, state.path[:2].copy()
            self._count += 1
            if (mapped or roughness >= ROUGH) and self._count < MOST_RETURNS:
                return False
        for leg in np.flatnonzero(new):
            direction = (state.missed_foothold - state.last_foothold)[leg, :2]
            length = math.hypot(*direction)
            if length > 0:
                self._directions[int(leg)] = direction / length
        return bool(new.any())

    def blocking_leg(self, velocity: Float[np.ndarray, "3"]) -> int | None:
        """Return the leg whose foot would go in a blocked direction; None for none.

        A velocity in another direction unblocks all: the ground there may be different.

        Args:
            velocity: Velocity of the body, vx, vy [m/s] and wz [rad/s], shape (3,).
        """
        for leg, blocked in self._directions.items():
            x, y, _ = self._state.missed_foothold[leg]
            v = np.array(point_velocity(self._state.path, velocity, x, y))
            if v @ blocked > SAME_DIRECTION * math.hypot(*v):
                return leg
        if np.any(velocity):
            self._directions.clear()
        return None
