"""Level ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.terrain.shape import Surface, level


@dataclass(frozen=True)
class Flat:
    """Level ground at height 0."""

    def surface(self, u: Float[np.ndarray, "*batch"], v: Float[np.ndarray, "*batch"]) -> Surface:
        """Zero everywhere."""
        return level(np.zeros(np.broadcast_shapes(np.shape(u), np.shape(v))))
