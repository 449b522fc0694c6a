"""Rough ground: hills in all directions, from a seed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.terrain.shapes import Places, Surface, ramp
from phasmid.units import rounded_down

WAVES = 24
"""Number of plane waves that are added up."""

WIDEST = 4.0
"""Length of the longest wave, in lengths of the shortest."""

RAMP = 0.1
"""Distance over which rough ground grows out of the level [m]."""

CHUNK = 1 << 14
"""Points that are evaluated at once."""

CHECKED, SAMPLES = 2.4, 96
"""Side of the square behind the start whose slopes are checked [m], and samples along it: 25 mm
apart, a sixth of the default's shortest wave."""


@dataclass(frozen=True)
class Rough:
    """Sum of plane waves of random direction, phase and length, and equal steepness.

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
        # Each of the waves adds its share to the mean square of the slope, which three standard
        # deviations seldom exceed; the slopes near the start and on the ramp are sampled.
        k, _, amplitude = self._waves
        steep = 3 * float(np.linalg.norm(amplitude * np.linalg.norm(k, axis=0))) / 2
        steep = max(steep, self._steepest())
        if steep > 1:
            raise InvalidInput(
                f"rough ground of {1000 * self.roughness:g} mm in waves of "
                f"{1000 * self.shortest:g} mm is steeper than 45° in places, the steepest this "
                "contact model is verified for.",
                hint=f"roughness_mm = {rounded_down(1000 * self.roughness / steep)}",
            )

    def _steepest(self) -> float:
        """Return the steepest slope on the ramp and behind it."""
        steepest = 0.0
        for length in (RAMP, CHECKED):
            u = self.start + np.linspace(0.0, length, SAMPLES)
            v = np.linspace(-CHECKED / 2, CHECKED / 2, SAMPLES)
            slope = self.surface(np.repeat(u, SAMPLES), np.tile(v, SAMPLES))[1]
            steepest = max(steepest, float(np.hypot(slope[:, 0], slope[:, 1]).max()))
        return steepest

    @cached_property
    def _waves(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Wave vectors [rad/m], shape (2, W), phases [rad] and amplitudes [m], shape (W,)."""
        random = np.random.default_rng(self.seed)
        angle, phase = random.uniform(0, 2 * np.pi, (2, WAVES))
        length = self.shortest * WIDEST ** random.uniform(0, 1, WAVES)
        # The mean square of a sum of waves is half the sum of their amplitudes' squares.
        amplitude = self.roughness * np.sqrt(2) * length / np.linalg.norm(length)
        return 2 * np.pi / length * np.stack([np.cos(angle), np.sin(angle)]), phase, amplitude

    def surface(self, u: Places, v: Places) -> Surface:
        """Return height [m], shape (n,), and slope along u and v, shape (n, 2), at n points [m]."""
        k, phase, amplitude = self._waves
        hills, slope = np.empty(len(u)), np.empty((len(u), 2))
        for start in range(0, len(u), CHUNK):
            part = slice(start, start + CHUNK)
            angle = u[part, None] * k[0] + v[part, None] * k[1] + phase
            # The sum for a point does not depend on the other points of its chunk.
            hills[part] = (amplitude * np.sin(angle)).sum(axis=-1)
            derivative = amplitude * np.cos(angle)
            slope[part, 0] = (k[0] * derivative).sum(axis=-1)
            slope[part, 1] = (k[1] * derivative).sum(axis=-1)
        blend, blend_slope = ramp(u, self.start, RAMP)
        # The product rule.
        slope *= blend[..., None]
        slope[..., 0] += blend_slope * hills
        return blend * hills, slope
