"""Terrain: a shape in the world with its friction."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.terrain.shapes import Blocky, Flat, Places, Shape

HIGHEST_FRICTION = 10.0
"""Coefficients of friction above this one are refused."""

MOST_PATCHES = 1000
"""Most patches of friction: every foot looks at all of them in every step."""


@dataclass(frozen=True)
class Patch:
    """Rectangle with its own friction.

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
    """Shape with friction, rotated about the vertical through the origin.

    Attributes:
        shape: Height and slope, in the terrain's own axes.
        coefficient: Of Coulomb friction outside of all patches.
        patches: Where friction is another, in the terrain's own axes; the last one counts.
        yaw: Direction of the terrain's own x axis in the world [rad].
        offset: Distance of the surface from the shape, along its normal [m]; see `raised`.
    """

    shape: Shape
    coefficient: float
    patches: tuple[Patch, ...] = ()
    yaw: float = 0.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        _check_friction(self.coefficient, "friction")
        if len(self.patches) > MOST_PATCHES:
            raise InvalidInput(
                f"ground has {len(self.patches)} patches of friction; the limit is {MOST_PATCHES}.",
                hint="patches = []",
            )

    @property
    def is_level(self) -> bool:
        """The ground is level, at height 0 if it is not raised."""
        return isinstance(self.shape, Flat)

    @property
    def faces_up(self) -> bool:
        """The normal is vertical wherever it is defined."""
        return isinstance(self.shape, Flat | Blocky)

    def raised(self, radius: float) -> Ground:
        """Return the surface on which centres of balls of a radius [m] are that touch the ground.

        It is exact on planes. Where the ground curves by κ the ball touches beside its centre's
        normal, and the height is off by about κ (radius · slope)² / 2.
        """
        return replace(self, offset=self.offset + radius) if radius else self

    def surface(
        self, x: Float[np.ndarray, "*batch"], y: Float[np.ndarray, "*batch"]
    ) -> tuple[Float[np.ndarray, "*batch"], Float[np.ndarray, "*batch 2"]]:
        """Return height [m], shape (...), and slope along the world's x and y, shape (..., 2)."""
        shape = np.broadcast_shapes(np.shape(x), np.shape(y))
        height, slope = self.shape.surface(*self._own(x, y))
        if self.yaw:
            c, s = math.cos(self.yaw), math.sin(self.yaw)
            along, across = slope[..., 0], slope[..., 1]
            slope = np.stack([c * along - s * across, s * along + c * across], axis=-1)
        if self.offset:
            height = height + self.offset * np.sqrt(1.0 + np.sum(slope**2, axis=-1))
        return height.reshape(shape), slope.reshape(*shape, 2)

    def height(
        self, x: Float[np.ndarray, "*batch"], y: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch"]:
        """Return the height of the ground in world axes [m], shape (...)."""
        return self.surface(x, y)[0]

    def normal(
        self, x: Float[np.ndarray, "*batch"], y: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch 3"]:
        """Return the outward unit normal in world axes, shape (..., 3)."""
        return upright(self.surface(x, y)[1])

    def friction(
        self, x: Float[np.ndarray, "*batch"], y: Float[np.ndarray, "*batch"]
    ) -> Float[np.ndarray, "*batch"]:
        """Return the coefficient of Coulomb friction, shape (...)."""
        shape = np.broadcast_shapes(np.shape(x), np.shape(y))
        u, v = (w[:, None] for w in self._own(x, y))
        low_u, high_u, low_v, high_v, coefficients = self._patches
        inside = (low_u <= u) & (u < high_u) & (low_v <= v) & (v < high_v)
        # The last patch that contains a point, or the ground itself, which is first.
        last = np.where(inside, np.arange(1, len(coefficients)), 0).max(axis=1, initial=0)
        return coefficients[last].reshape(shape)

    @cached_property
    def _patches(self) -> tuple[np.ndarray, ...]:
        """Return bounds of the patches, each of shape (P,), and coefficients, shape (1 + P,)."""
        bounds = np.array([(*patch.x, *patch.y) for patch in self.patches]).reshape(-1, 4).T
        return *bounds, np.array([self.coefficient, *(p.coefficient for p in self.patches)])

    def _own(self, x: np.ndarray, y: np.ndarray) -> tuple[Places, Places]:
        """Return coordinates in the terrain's axes [m], in one row."""
        if np.shape(x) != np.shape(y):
            x, y = np.broadcast_arrays(x, y)
        x, y = np.ravel(x), np.ravel(y)
        if not self.yaw:
            return x, y
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return c * x + s * y, c * y - s * x


def upright(slope: Float[np.ndarray, "*batch 2"]) -> Float[np.ndarray, "*batch 3"]:
    """Return outward unit normals of a surface with slopes, shape (..., 3)."""
    up = 1.0 / np.sqrt(1.0 + slope[..., 0] ** 2 + slope[..., 1] ** 2)
    return np.stack([-slope[..., 0] * up, -slope[..., 1] * up, up], axis=-1)


def _check_friction(coefficient: float, what: str) -> None:
    if not 0 <= coefficient <= HIGHEST_FRICTION:
        raise InvalidInput(
            f"{what} is {coefficient:g}; it must be 0 or more and {HIGHEST_FRICTION:g} or less."
        )
