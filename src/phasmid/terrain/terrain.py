"""What every terrain tells, to the planner and to the simulation alike."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float


@runtime_checkable
class Terrain(Protocol):
    """Ground over the world's x-y plane; every point of it has one height."""

    def height(
        self, x: Float[np.ndarray, "*batch"], y: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch"]:
        """Height of the ground in world axes [m], shape (...).

        Args:
            x: World coordinate [m], shape (...).
            y: World coordinate [m], shape (...).
        """

    def normal(
        self, x: Float[np.ndarray, "*batch"], y: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch 3"]:
        """Unit vector out of the ground, world axes, shape (..., 3)."""

    def friction(
        self, x: Float[np.ndarray, "*batch"], y: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch"]:
        """Coefficient of Coulomb friction between foot and ground, shape (...)."""
