"""Level ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.terrain.shape import no_slope


@dataclass(frozen=True)
class Flat:
    """Level ground at height 0."""

    def height(
        self, u: Float[np.ndarray, "*batch"], v: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch"]:
        """Zero everywhere [m], shape (...)."""
        return np.zeros(np.broadcast_shapes(np.shape(u), np.shape(v)))

    def gradient(
        self, u: Float[np.ndarray, "*batch"], v: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch 2"]:
        """Zero everywhere, shape (..., 2)."""
        return no_slope(u, v)
