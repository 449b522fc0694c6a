"""Waves."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.terrain.shape import Places, Surface


@dataclass(frozen=True)
class Waves:
    """Sinusoid along u, which begins in a trough at the height of level ground.

    Attributes:
        wave_height: From trough to crest [m].
        wave_length: From crest to crest [m].
        start: Where the first wave begins to rise [m].
    """

    wave_height: float
    wave_length: float
    start: float

    def __post_init__(self) -> None:
        steepest = math.pi * self.wave_height / self.wave_length if self.wave_length > 0 else 2.0
        if not abs(steepest) <= 1.0:
            raise InvalidInput(
                f"waves of {1000 * self.wave_height:g} mm in {1000 * self.wave_length:g} mm are "
                f"steeper than 45°, the steepest this contact model is verified for.",
                hint=f"waves of {1000 * math.pi * self.wave_height:.0f} mm length or more",
            )

    def surface(self, u: Places, v: Places) -> Surface:
        """Return height [m], and slope along u and v."""
        k = 2 * np.pi / self.wave_length
        phase = k * np.maximum(u - self.start, 0.0)
        height = self.wave_height / 2 * (1 - np.cos(phase))
        return height, np.stack(
            [self.wave_height / 2 * k * np.sin(phase), np.zeros_like(v)], axis=-1
        )
