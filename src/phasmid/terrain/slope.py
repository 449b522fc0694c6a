"""Slopes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.terrain.shape import Places, Surface

STEEPEST = math.radians(45)
"""Steepest slope on which the contact is tested [rad]."""


@dataclass(frozen=True)
class Slope:
    """Plane that rises along u.

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

    def surface(self, u: Places, v: Places) -> Surface:
        """Return height [m], and slope along u and v."""
        along, steepness = u, math.tan(self.angle)
        rising = np.full(along.shape, steepness)
        if self.start is not None:
            along = along - self.start
            rising, along = steepness * (along >= 0), np.maximum(along, 0.0)
        return steepness * along, np.stack([rising, np.zeros_like(v)], axis=-1)
