"""Rules of differentiation for scalars that change with time."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.motion.curves import Path


def total(a: Path, b: Path) -> Path:
    """The sum of two scalars, and its derivatives."""
    return Path(*(x + y for x, y in zip(a, b, strict=True)))


def scaled(a: Path, factor: float) -> Path:
    """A scalar times a constant, and its derivatives."""
    return Path(*(factor * x for x in a))


def product(a: Path, b: Path) -> Path:
    """The product of two scalars, and its derivatives."""
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
    """A function of a scalar that changes, by its value and derivatives there: the chain rule."""
    return Path(
        value,
        slope * inner.velocity,
        slope * inner.acceleration + bend * inner.velocity**2,
    )


def root(a: Path) -> Path:
    """The square root of a scalar above 0, and its derivatives."""
    value = np.sqrt(a.position)
    return composed(value, 0.5 / value, -0.25 / value**3, a)


def inverse(a: Path) -> Path:
    """One over a scalar that is not 0, and its derivatives."""
    value = 1 / a.position
    return composed(value, -(value**2), 2 * value**3, a)


def arctan(a: Path) -> Path:
    """The angle whose tangent is a scalar, and its derivatives [rad]."""
    slope = 1 / (1 + a.position**2)
    return composed(np.arctan(a.position), slope, -2 * a.position * slope**2, a)


def cos_and_sin(angle: Path) -> tuple[Path, Path]:
    """Cosine and sine of an angle [rad], and their derivatives."""
    c, s = np.cos(angle.position), np.sin(angle.position)
    return composed(c, -s, -c, angle), composed(s, c, -s, angle)
