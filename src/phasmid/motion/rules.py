"""Differentiation rules for scalar functions of time."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.motion.curves import Path


def total(a: Path, b: Path) -> Path:
    """Return the sum of two functions."""
    return Path(*(x + y for x, y in zip(a, b, strict=True)))


def scaled(a: Path, factor: float) -> Path:
    """Return a function times a constant."""
    return Path(*(factor * x for x in a))


def product(a: Path, b: Path) -> Path:
    """Return the product of two functions."""
    return Path(
        a.position * b.position,
        a.velocity * b.position + a.position * b.velocity,
        a.acceleration * b.position + 2 * a.velocity * b.velocity + a.position * b.acceleration,
    )


def composed(
    value: Float[np.ndarray, "*batch"],
    slope: Float[np.ndarray, "*batch"],
    bend: Float[np.ndarray, "*batch"],
    inner: Path,
) -> Path:
    """Return a function of a function, by the chain rule."""
    return Path(
        value,
        slope * inner.velocity,
        slope * inner.acceleration + bend * inner.velocity**2,
    )


def root(a: Path) -> Path:
    """Return the square root of a positive function."""
    value = np.sqrt(a.position)
    return composed(value, 0.5 / value, -0.25 / value**3, a)


def inverse(a: Path) -> Path:
    """Return the reciprocal of a function without zeros."""
    value = 1 / a.position
    return composed(value, -(value**2), 2 * value**3, a)


def arctan(a: Path) -> Path:
    """Return the arc tangent of a function [rad]."""
    slope = 1 / (1 + a.position**2)
    return composed(np.arctan(a.position), slope, -2 * a.position * slope**2, a)


def cos_and_sin(angle: Path) -> tuple[Path, Path]:
    """Return cosine and sine of a function [rad]."""
    c, s = np.cos(angle.position), np.sin(angle.position)
    return composed(c, -s, -c, angle), composed(s, c, -s, angle)
