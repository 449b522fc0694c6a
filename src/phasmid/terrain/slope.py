"""A slope."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput

STEEPEST = math.radians(45)
"""Steepest slope on which the contact is tested [rad]."""


@dataclass(frozen=True)
class Slope:
    """A plane that rises along u.

    Attributes:
        angle: Of the plane to the level [rad]; below 0 it falls.
        start: Where it begins, with level ground before it [m]; None: the plane has no beginning
            and goes through the origin.
    """

    angle: float
    start: float | None = None

    def __post_init__(self) -> None:
        if not abs(self.angle) <= STEEPEST:
            raise InvalidInput(
                f"slope of {math.degrees(self.angle):g}° exceeds {math.degrees(STEEPEST):g}°, the "
                "steepest this contact model is verified for."
            )

    def height(
        self, u: Float[np.ndarray, "*batch"], v: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch"]:
        """Height [m], shape (...)."""
        along = u + 0.0 * v
        if self.start is not None:
            along = np.maximum(along - self.start, 0.0)
        return math.tan(self.angle) * along

    def gradient(
        self, u: Float[np.ndarray, "*batch"], v: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch 2"]:
        """Slope along u and v, shape (..., 2)."""
        along = u + 0.0 * v
        rising = np.ones(along.shape) if self.start is None else 1.0 * (along >= self.start)
        return np.stack([math.tan(self.angle) * rising, 0.0 * along], axis=-1)
