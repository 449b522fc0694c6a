"""Stairs and gaps: level ground whose height changes at edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.terrain.shape import FAR, Block, Places, Surface, level


@dataclass(frozen=True)
class Steps:
    """Level ground whose height changes at edges across u.

    Attributes:
        x: Places of the edges along u, increasing [m].
        z: Height behind each edge [m]; before the first it is 0.
    """

    x: tuple[float, ...]
    z: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.x) != len(self.z):
            raise InvalidInput(
                f"steps.z has {len(self.z)} values; one per edge, {len(self.x)} in all."
            )
        for name, values in (("x", self.x), ("z", self.z)):
            for i, value in enumerate(values):
                if not abs(value) < FAR:
                    raise InvalidInput(
                        f"steps.{name}[{i}] is {value:g} m; it must be a number below {FAR:g} m."
                    )
        for i in range(1, len(self.x)):
            if self.x[i] <= self.x[i - 1]:
                raise InvalidInput(
                    f"steps.x must increase; steps.x[{i}] = {self.x[i]:.2f} "
                    f"follows {self.x[i - 1]:.2f}."
                )

    @classmethod
    def stairs(cls, start: float, *, rise: float, run: float, count: int) -> Steps:
        """Return equal steps, the first at `start`.

        Args:
            start: Place of the first edge [m].
            rise: Height of each step [m]; below 0 the stairs lead down.
            run: Depth of each step [m].
            count: Number of steps.
        """
        return cls(
            tuple(start + run * k for k in range(count)),
            tuple(rise * (k + 1) for k in range(count)),
        )

    @classmethod
    def gap(cls, start: float, *, width: float, depth: float) -> Steps:
        """Return a ditch across u.

        Args:
            start: Place of its near edge [m].
            width: From edge to edge [m].
            depth: [m].
        """
        return cls((start, start + width), (-depth, 0.0))

    def surface(self, u: Places, v: Places) -> Surface:
        """Return the height [m] and a slope of zero: edges have none."""
        del v
        heights = np.array([0.0, *self.z])
        return level(heights[np.searchsorted(np.array(self.x), u, side="right")])

    @property
    def blocks(self) -> tuple[Block, ...]:
        """Return one block between edges."""
        edges = (-FAR, *self.x, FAR)
        return tuple(
            Block((edges[i], edges[i + 1]), (-FAR, FAR), top)
            for i, top in enumerate((0.0, *self.z))
        )
