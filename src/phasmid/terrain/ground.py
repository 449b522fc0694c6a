"""A terrain: a shape, laid into the world, and what its surface is like."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.terrain.flat import Flat
from phasmid.terrain.shape import Shape

HIGHEST_FRICTION = 10.0
"""Coefficients of friction above this one are refused."""


@dataclass(frozen=True)
class Patch:
    """A rectangle of other friction.

    Attributes:
        x: From and to, along the terrain [m].
        y: From and to, across the terrain [m].
        coefficient: Of Coulomb friction there.
    """

    x: tuple[float, float]
    y: tuple[float, float]
    coefficient: float

    def __post_init__(self) -> None:
        _check_friction(self.coefficient, "the friction of a patch")
        for low, high in (self.x, self.y):
            if not low < high:
                raise InvalidInput(
                    f"a patch of friction goes from {low:g} to {high:g} m; the second must be the "
                    "larger."
                )


@dataclass(frozen=True)
class Ground:
    """A shape and its friction, turned about the vertical through the origin.

    Attributes:
        shape: Height and slope, in the terrain's own axes.
        coefficient: Of Coulomb friction outside of all patches.
        patches: Where friction is another, in the terrain's own axes; the last one counts.
        yaw: Direction of the terrain's own x axis in the world [rad].
    """

    shape: Shape
    coefficient: float
    patches: tuple[Patch, ...] = ()
    yaw: float = 0.0

    def __post_init__(self) -> None:
        _check_friction(self.coefficient, "friction")

    @property
    def is_level(self) -> bool:
        """Whether it is level at height 0 everywhere."""
        return isinstance(self.shape, Flat)

    def height(
        self, x: Float[np.ndarray, "*batch"], y: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch"]:
        """Height of the ground in world axes [m], shape (...)."""
        return self.shape.height(*self._own(x, y))

    def gradient(
        self, x: Float[np.ndarray, "*batch"], y: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch 2"]:
        """Slope of the ground along the world's x and y, shape (..., 2)."""
        slope = self.shape.gradient(*self._own(x, y))
        if not self.yaw:
            return slope
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return slope @ np.array([[c, s], [-s, c]])

    def normal(
        self, x: Float[np.ndarray, "*batch"], y: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch 3"]:
        """Unit vector out of the ground, world axes, shape (..., 3)."""
        slope = self.gradient(x, y)
        up = 1.0 / np.sqrt(1.0 + np.sum(slope**2, axis=-1))
        return np.concatenate([-slope * up[..., None], up[..., None]], axis=-1)

    def friction(
        self, x: Float[np.ndarray, "*batch"], y: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch"]:
        """Coefficient of Coulomb friction between foot and ground, shape (...)."""
        u, v = self._own(x, y)
        found = np.full(np.broadcast_shapes(np.shape(u), np.shape(v)), self.coefficient)
        for patch in self.patches:
            (x0, x1), (y0, y1) = patch.x, patch.y
            found[(x0 <= u) & (u < x1) & (y0 <= v) & (v < y1)] = patch.coefficient
        return found

    def _own(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates in the terrain's own axes [m]."""
        if not self.yaw:
            return x, y
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return c * x + s * y, c * y - s * x


def _check_friction(coefficient: float, what: str) -> None:
    if not 0 <= coefficient <= HIGHEST_FRICTION:
        raise InvalidInput(
            f"{what} is {coefficient:g}; it must be 0 or more and {HIGHEST_FRICTION:g} or less."
        )
