"""Ways of all joints from one pose to another, by a share of the way from 0 to 1."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

FASTEST_BLEND, SHARPEST_BLEND, SQUARE_BLEND = 15 / 8, 10 / math.sqrt(3), (15 / 8) ** 2
"""Of the quintic from rest to rest over unit time: largest speed, acceleration, speed squared."""


@dataclass(frozen=True, slots=True, eq=False)
class JointMotion:
    """Where the joints are and how they move at one instant.

    Attributes:
        position: Angles [rad], shape (L, 3).
        velocity: Speeds [rad/s], shape (L, 3).
        acceleration: Accelerations [rad/s²], shape (L, 3).
    """

    position: Float[np.ndarray, "legs 3"]
    velocity: Float[np.ndarray, "legs 3"]
    acceleration: Float[np.ndarray, "legs 3"]


@dataclass(frozen=True, eq=False)
class JointPath:
    """A way of all joints, twice continuously differentiable; rest is at both ends.

    Attributes:
        name: What the robot does on it, such as ``raises its body``.
        coefficients: Of the cubic pieces, highest power first, shape (N, 4, L, 3); each piece's
            variable goes from 0 to 1.
        speed: Largest speed of a joint on it [rad/s].
        acceleration: Largest acceleration of a joint on it [rad/s²].
    """

    name: str
    coefficients: Float[np.ndarray, "pieces 4 legs 3"]
    speed: float
    acceleration: float

    @property
    def start(self) -> Float[np.ndarray, "legs 3"]:
        """Angles at its start [rad], shape (L, 3)."""
        return self.coefficients[0, 3]

    @cached_property
    def end(self) -> Float[np.ndarray, "legs 3"]:
        """Angles at its end [rad], shape (L, 3)."""
        return self.at(1.0, 0.0, 0.0).position

    @cached_property
    def _flat(self) -> Float[np.ndarray, "pieces 4 joints"]:
        return np.ascontiguousarray(self.coefficients.reshape(len(self.coefficients), 4, -1))

    @cached_property
    def steepness(self) -> tuple[float, float]:
        """Largest first and second derivative of a joint's angle by the share of the way."""
        n = len(self.coefficients)
        c3, c2, c1, _ = np.moveaxis(self.coefficients, 1, 0)
        # The slope of a cubic is largest at an end of its piece or at its turning point.
        turn = np.clip(-c2 / np.where(c3 == 0, 1.0, 3 * c3), 0.0, 1.0)
        slopes = [c1, c1 + 2 * c2 + 3 * c3, c1 + turn * (2 * c2 + 3 * c3 * turn)]
        bends = [2 * c2, 2 * c2 + 6 * c3]
        return n * float(np.abs(slopes).max()), n * n * float(np.abs(bends).max())

    @cached_property
    def duration(self) -> float:
        """Shortest time from rest to rest by a quintic within its limits [s].

        A joint's acceleration is q' s'' + q'' s'^2; both parts are bounded by their largest values,
        which is exact on a straight way.
        """
        first, second = self.steepness
        bend = first * SHARPEST_BLEND + second * SQUARE_BLEND
        return max(first * FASTEST_BLEND / self.speed, math.sqrt(bend / self.acceleration))

    def at(self, s: float, rate: float, bend: float) -> JointMotion:
        """The joints at a share of the way and its first two derivatives by time."""
        n = len(self.coefficients)
        piece = min(max(int(s * n), 0), n - 1)
        u = s * n - piece
        powers = np.array(
            [[u * u * u, u * u, u, 1.0], [3 * u * u, 2 * u, 1.0, 0.0], [6 * u, 2.0, 0.0, 0.0]]
        )
        legs = self.coefficients.shape[2]
        q, slope, curve = (powers @ self._flat[piece]).reshape(3, legs, 3)
        return JointMotion(
            q, slope * (n * rate), slope * (n * bend) + curve * (n * n * rate * rate)
        )


def path_through(
    name: str, q: Float[np.ndarray, "knots legs 3"], speed: float, acceleration: float
) -> JointPath:
    """The smooth way through poses that lie evenly along it.

    Args:
        name: What the robot does on it.
        q: Joint angles [rad], shape (K, L, 3), K 2 or more; a straight way where K is 2.
        speed: Largest speed of a joint [rad/s].
        acceleration: Largest acceleration of a joint [rad/s²].
    """
    if len(q) == 2:
        coefficients = np.stack([0 * q[0], 0 * q[0], q[1] - q[0], q[0]])[None]
    else:
        from scipy.interpolate import CubicSpline

        spline = CubicSpline(np.arange(len(q)), q.reshape(len(q), -1))
        coefficients = np.moveaxis(spline.c, 1, 0).reshape(-1, 4, *q.shape[1:])
    return JointPath(name, coefficients, speed, acceleration)
