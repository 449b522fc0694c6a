"""Rough ground: hills in all directions, the same for the same seed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.terrain.shape import ramp

WAVES = 24
"""Number of plane waves that are added up."""

WIDEST = 4.0
"""Length of the longest wave, in lengths of the shortest."""

RAMP = 0.1
"""Way over which rough ground grows out of the level [m]."""


@dataclass(frozen=True)
class Rough:
    """Plane waves of random direction, phase and length, all equally steep, added up.

    Every point's height is a closed form of its place and the seed; there is no grid.

    Attributes:
        roughness: Standard deviation of the height far from the start [m].
        shortest: Length of the shortest wave [m]; the longest is four times as long.
        start: Where it grows out of level ground, within 0.1 m [m].
        seed: Of the waves.
    """

    roughness: float
    shortest: float
    start: float
    seed: int = 1

    def __post_init__(self) -> None:
        if not (self.roughness >= 0 and self.shortest > 0):
            raise InvalidInput(
                f"rough ground of {self.roughness:g} m in waves of {self.shortest:g} m; the first "
                "must be 0 or more, the second greater than 0."
            )

    @cached_property
    def _waves(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Wave vectors [rad/m], shape (2, W), phases [rad] and amplitudes [m], shape (W,)."""
        random = np.random.default_rng(self.seed)
        angle, phase = random.uniform(0, 2 * np.pi, (2, WAVES))
        length = self.shortest * WIDEST ** random.uniform(0, 1, WAVES)
        # The mean square of a sum of waves is half the sum of their amplitudes' squares.
        amplitude = self.roughness * np.sqrt(2) * length / np.linalg.norm(length)
        return 2 * np.pi / length * np.stack([np.cos(angle), np.sin(angle)]), phase, amplitude

    def height(
        self, u: Float[np.ndarray, "*batch"], v: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch"]:
        """Height [m], shape (...)."""
        u, v = np.broadcast_arrays(u, v)
        return ramp(u, self.start, RAMP)[0] * self._hills(u, v)[0]

    def gradient(
        self, u: Float[np.ndarray, "*batch"], v: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch 2"]:
        """Slope along u and v, shape (..., 2)."""
        u, v = np.broadcast_arrays(u, v)
        share, growth = ramp(u, self.start, RAMP)
        hills, slope_u, slope_v = self._hills(u, v)
        return np.stack([share * slope_u + growth * hills, share * slope_v], axis=-1)

    def _hills(self, u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Height without the ramp, and its slopes."""
        (ku, kv), phase, amplitude = self._waves
        hills, slope_u, slope_v = np.zeros((3, *u.shape))
        # Wave by wave: the sum does not depend on how many points are asked for.
        for i in range(WAVES):
            angle = ku[i] * u + kv[i] * v + phase[i]
            hills += amplitude[i] * np.sin(angle)
            slope = amplitude[i] * np.cos(angle)
            slope_u += ku[i] * slope
            slope_v += kv[i] * slope
        return hills, slope_u, slope_v
