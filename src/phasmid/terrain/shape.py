"""Shapes of terrain in their own axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, TypeAlias, runtime_checkable

import numpy as np
from jaxtyping import Float

Places: TypeAlias = Float[np.ndarray, " points"]
"""One coordinate of each point [m]."""

Surface: TypeAlias = tuple[Float[np.ndarray, " points"], Float[np.ndarray, "points 2"]]
"""Height [m] of each point, and slope along u and along v."""

FAR = 500.0
"""Where ground without an edge of its own ends [m]."""


@runtime_checkable
class Shape(Protocol):
    """Surface over the plane of u and v; the walk begins at the origin."""

    def surface(self, u: Places, v: Places) -> Surface:
        """Return height [m], and slope along u and v."""


@dataclass(frozen=True)
class Block:
    """Piece of level ground with vertical sides.

    Attributes:
        u: From and to [m].
        v: From and to [m].
        top: Height of its upper face [m].
    """

    u: tuple[float, float]
    v: tuple[float, float]
    top: float


@runtime_checkable
class Blocky(Protocol):
    """Level shape with vertical sides, which its gradient does not contain."""

    @property
    def blocks(self) -> tuple[Block, ...]:
        """Blocks of the shape, without overlap."""


def level(height: Places) -> Surface:
    """Return a surface of heights [m] that is level almost everywhere."""
    return height, np.zeros((len(height), 2))


def ramp(u: Places, start: float, length: float) -> tuple[Places, Places]:
    """From 0 to 1 by a quintic, smooth in its second derivative at both ends, and its slope.

    Args:
        u: Place [m].
        start: Where it begins to rise [m].
        length: Over which it rises [m].
    """
    s = np.minimum(np.maximum((u - start) / length, 0.0), 1.0)
    rest = s * (1 - s)
    return s * s * s * (10 + s * (6 * s - 15)), 30 / length * rest * rest
