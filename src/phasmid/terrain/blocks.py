"""Stepping blocks: a field of square tops of different heights."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.terrain.shape import FAR, Block, Places, Surface, level

MOST_BLOCKS = 10_000
"""Most blocks of a field."""


@dataclass(frozen=True)
class Blocks:
    """A field of square blocks with level ground around it.

    Attributes:
        size: Side of a block [m].
        gap: Between neighbours [m].
        height_range: Difference between the highest and the lowest possible top, which lie around
            0 [m].
        gap_depth: Depth of the floor between blocks [m].
        start: Where the field begins [m].
        length: Of the field along u [m].
        width: Of the field along v, half of it to each side [m].
        seed: Of the heights.
    """

    size: float
    gap: float
    height_range: float
    gap_depth: float
    start: float
    length: float = 2.4
    width: float = 1.6
    seed: int = 1

    def __post_init__(self) -> None:
        if not (self.size > 0 and self.gap >= 0 and self.height_range >= 0):
            raise InvalidInput(
                f"blocks of {self.size:g} m, {self.gap:g} m apart, with heights over "
                f"{self.height_range:g} m; the first must be greater than 0, the others 0 or more."
            )
        across, down = self.length / self.pitch, self.width / self.pitch
        if across * down > MOST_BLOCKS:
            raise InvalidInput(
                f"a field of {across * down:.0f} blocks; the limit is {MOST_BLOCKS}.",
                hint="larger blocks",
            )
        if self.gap > 0 and not self.gap_depth > self.height_range / 2:
            raise InvalidInput(
                f"the floor between blocks lies {self.gap_depth:g} m deep; it must be deeper than "
                f"the lowest block, {self.height_range / 2:g} m."
            )

    @property
    def pitch(self) -> float:
        """Distance between the edges of neighbouring blocks [m]."""
        return self.size + self.gap

    @cached_property
    def tops(self) -> Float[np.ndarray, "along across"]:
        """Heights of the blocks [m]."""
        shape = (max(1, round(self.length / self.pitch)), max(1, round(self.width / self.pitch)))
        tops = np.random.default_rng(self.seed).uniform(-0.5, 0.5, shape) * self.height_range
        tops.flags.writeable = False
        return tops

    @property
    def _corner(self) -> tuple[float, float]:
        return self.start, -self.tops.shape[1] * self.pitch / 2

    def surface(self, u: Places, v: Places) -> Surface:
        """Return the height [m] and a slope of zero: edges have none."""
        places = [(w - w0) / self.pitch for w, w0 in zip((u, v), self._corner, strict=True)]
        cells = [np.floor(place) for place in places]
        inside, on_top = np.ones(u.shape, dtype=bool), np.ones(u.shape, dtype=bool)
        for place, cell, count in zip(places, cells, self.tops.shape, strict=True):
            inside &= (cell >= 0) & (cell < count)
            on_top &= (place - cell) * self.pitch <= self.size
        i, j = (
            np.clip(np.nan_to_num(cell), 0, count - 1).astype(int)
            for cell, count in zip(cells, self.tops.shape, strict=True)
        )
        return level(np.where(inside, np.where(on_top, self.tops[i, j], -self.gap_depth), 0.0))

    @property
    def blocks(self) -> tuple[Block, ...]:
        """Blocks, ground around the field, and floor between the blocks."""
        u0, v0 = self._corner
        u1, v1 = (w + n * self.pitch for w, n in zip((u0, v0), self.tops.shape, strict=True))
        found = [
            Block((-FAR, u0), (-FAR, FAR), 0.0),
            Block((u1, FAR), (-FAR, FAR), 0.0),
            Block((u0, u1), (-FAR, v0), 0.0),
            Block((u0, u1), (v1, FAR), 0.0),
        ]
        for (i, j), top in np.ndenumerate(self.tops):
            u, v = u0 + i * self.pitch, v0 + j * self.pitch
            found.append(Block((u, u + self.size), (v, v + self.size), float(top)))
        if self.gap > 0:
            found.append(Block((u0, u1), (v0, v1), -self.gap_depth))
        return tuple(found)
