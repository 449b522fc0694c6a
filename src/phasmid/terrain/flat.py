"""Level ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class Flat:
    """Level ground at height 0.

    Attributes:
        coefficient: Of Coulomb friction, everywhere the same.
    """

    coefficient: float

    def height(
        self, x: Float[np.ndarray, "*batch"], y: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch"]:
        """Zero everywhere [m], shape (...)."""
        return np.zeros(np.broadcast_shapes(np.shape(x), np.shape(y)))

    def normal(
        self, x: Float[np.ndarray, "*batch"], y: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch 3"]:
        """Straight up, shape (..., 3)."""
        shape = np.broadcast_shapes(np.shape(x), np.shape(y))
        return np.broadcast_to([0.0, 0.0, 1.0], (*shape, 3)).copy()

    def friction(
        self, x: Float[np.ndarray, "*batch"], y: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch"]:
        """The coefficient, shape (...)."""
        shape = np.broadcast_shapes(np.shape(x), np.shape(y))
        return np.full(shape, self.coefficient)
