"""Polynomial curves of feet and body, and derivatives of functions of them."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.polynomial.polynomial import polyder, polyval

from phasmid.kinematics.shared_kernels import quintic

Curve = Literal["quintic", "cubic-spline"]


class Path(NamedTuple):
    """Function of time: its values and its first two derivatives, of one shape.

    Sums, differences and products are those of functions and constants, with their derivatives.
    """

    position: Float[np.ndarray, "*batch"]
    velocity: Float[np.ndarray, "*batch"]
    acceleration: Float[np.ndarray, "*batch"]

    def __add__(self, other: Path | np.ndarray | float) -> Path:  # type: ignore[override]
        if not isinstance(other, Path):
            return Path(self.position + other, self.velocity, self.acceleration)
        return Path(*(x + y for x, y in zip(self, other, strict=True)))

    def __sub__(self, other: Path) -> Path:
        return Path(*(x - y for x, y in zip(self, other, strict=True)))

    def __mul__(self, other: Path | np.ndarray | float) -> Path:  # type: ignore[override]
        if not isinstance(other, Path):
            return Path(*(x * other for x in self))
        p, v, a = other
        return Path(
            self.position * p,
            self.velocity * p + self.position * v,
            self.acceleration * p + 2 * self.velocity * v + self.position * a,
        )

    def over(self, duration: Float[np.ndarray, "*batch"] | float) -> Path:
        """Return the function by time, from its derivatives by the fraction of a duration [s]."""
        return Path(self.position, self.velocity / duration, self.acceleration / duration**2)


def blend(curve: Curve, u: Float[np.ndarray, "*batch"]) -> Path:
    """Return a blend from 0 at u = 0 to 1 at u = 1, at rest at both ends.

    Args:
        curve: ``quintic`` also starts and ends without acceleration; ``cubic-spline`` is one piece
            of a clamped cubic spline.
        u: Fraction of the way in time, in [0, 1].

    Returns:
        The fraction of the way and its derivatives by u.

    Source: the paper's 5th degree polynomial; its reference [11] for the spline.
    """
    u = np.asarray(u, dtype=float)
    if curve == "quintic":
        return Path(*quintic(u))
    return Path(u**2 * (3 - 2 * u), 6 * u * (1 - u), 6 - 12 * u)


def lift(curve: Curve, u: Float[np.ndarray, "*batch"]) -> Path:
    """Return a lift from 0 to 1 at u = 1/2 and back to 0 at u = 1, of two blends.

    With the cubic curve this is the clamped cubic spline through lift-off, apex and touchdown.

    Args:
        curve: Polynomial of both halves.
        u: Fraction of the swing in time, in [0, 1].

    Returns:
        The fraction of the height and its derivatives by u.
    """
    u = np.asarray(u, dtype=float)
    half = blend(curve, np.where(u < 0.5, 2 * u, 2 - 2 * u))
    rising = np.where(u < 0.5, 1.0, -1.0)
    return Path(half.position, 2 * rising * half.velocity, 4 * half.acceleration)


def join(
    curve: Curve,
    u: Float[np.ndarray, "*#batch"],
    start: Float[np.ndarray, "*#batch"],
    end: Float[np.ndarray, "*#batch"],
    velocity: tuple[Float[np.ndarray, "*#batch"], Float[np.ndarray, "*#batch"]],
) -> Path:
    """Return a curve between two points with given velocities and no acceleration at its ends.

    Args:
        curve: A cubic has no freedom left for the accelerations at its ends.
        u: Fraction of the way in time, in [0, 1].
        start: Where it starts.
        end: Where it ends.
        velocity: Derivative by u at start and end.

    Returns:
        The position and its derivatives by u.
    """
    v0, v1 = velocity
    way = end - start
    # The quintic's u^2 vanishes with the acceleration.
    if curve == "quintic":
        cubic, quartic = 10 * way - 6 * v0 - 4 * v1, -15 * way + 8 * v0 + 7 * v1
        powers = [start, v0, 0 * way, cubic, quartic, 6 * way - 3 * v0 - 3 * v1]
    else:
        powers = [start, v0, 3 * way - 2 * v0 - v1, -2 * way + v0 + v1]
    coefficients = np.array(np.broadcast_arrays(*powers))
    return Path(*(polyval(u, polyder(coefficients, k), tensor=False) for k in range(3)))


def vector(*components: Path) -> Path:
    """Return the vector of components, along a new last axis."""
    return Path(*(np.stack(orders, axis=-1) for orders in zip(*components, strict=True)))


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
