"""Interface of terrains."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float


@runtime_checkable
class Terrain(Protocol):
    """Ground over the world's x-y plane."""

    def height(
        self, x: Float[np.ndarray, "*batch"], y: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch"]:
        """Return the height of the ground in world axes [m], shape (...).

        Args:
            x: World coordinate [m], shape (...).
            y: World coordinate [m], shape (...).
        """

    def normal(
        self, x: Float[np.ndarray, "*batch"], y: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch 3"]:
        """Return the outward unit normal in world axes, shape (..., 3)."""

    def friction(
        self, x: Float[np.ndarray, "*batch"], y: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch"]:
        """Return the coefficient of Coulomb friction, shape (...)."""
