"""Where feet may stand, for the poses of the body that are asked for."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.control.foothold_region import bound_region
from phasmid.control.types import DIRECTIONS

KEPT = 8
"""For how many poses they are kept."""


class Regions:
    """Where feet may stand, by the body's pose, kept for the last few poses.

    Args:
        model: Record of the robot, L legs.
    """

    def __init__(self, model: np.void) -> None:
        self._model = model
        self._known: dict[tuple[float, ...], np.ndarray] = {}

    def at(self, pose: Float[np.ndarray, "6"]) -> Float[np.ndarray, "legs directions 3"]:
        """Half-planes about the neutral feet, as in `State.region`.

        Args:
            pose: Of the body beside its path [m, rad], shape (6,).
        """
        key = tuple(pose)
        if key not in self._known:
            if len(self._known) >= KEPT:
                self._known.clear()
            region = np.zeros((self._model["leg_count"], DIRECTIONS, 3))
            for leg in range(len(region)):
                bound_region(self._model, leg, pose, np.zeros(3), region[leg])
            self._known[key] = region
        return self._known[key]
