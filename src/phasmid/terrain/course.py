"""Course of blocky shapes one behind the other, for comparisons of controllers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.terrain.shapes import FAR, Block, Blocks, Places, Steps, Surface, level

RISE, RUN = 0.060, 0.150
"""Rise of the hardest stairs, and range of the hardest blocks' heights; depth of a stair [m]."""

BLOCK, RUBBLE, LATTICE = 0.100, 0.050, 0.200
"""Sides of blocks and of rubble, distance of stepping stones [m]."""

WIDTH = 4.0
"""Width of fields [m]: a robot that meets the course at 20° and drifts stays on them."""

DEPTH = 0.100
"""Depth of the gap and of the floor between stones [m]."""

SLIVER = 1e-9
"""Parts of blocks that are thinner come from rounding [m]."""


class Section(NamedTuple):
    """Section of a course.

    Attributes:
        start: Where it begins [m]; it goes on to the next section.
        base: Height of its shape's level ground [m].
        shape: Shape, whose own coordinates are those of the course.
    """

    start: float
    base: float
    shape: Steps | Blocks


@dataclass(frozen=True)
class Course:
    """Sections along u, with level ground before the first.

    Attributes:
        sections: In order of their starts; the last one has no end.
    """

    sections: tuple[Section, ...]

    def __post_init__(self) -> None:
        for one, other in pairwise(self.sections):
            if not one.start < other.start:
                raise InvalidInput(
                    f"a section of a course begins at {other.start:g} m, the one before at "
                    f"{one.start:g} m; their starts must increase."
                )

    @classmethod
    def mixed(cls, start: float, *, difficulty: float, seed: int = 1) -> Course:
        """Return a course of 3 m, whose last 0.5 m are level.

        Two stairs lead up to a plateau with blocks, a gap and stepping stones. Two stairs lead
        down to rubble.

        Args:
            start: Where it begins [m].
            difficulty: From 0, level ground, to 1: stairs and ranges of heights of 60 mm (30 mm for
                stones), a gap of 60 mm, and stones of 100 mm at 200 mm.
            seed: Of all heights and displacements.
        """
        if not 0 <= difficulty <= 1:
            raise InvalidInput(
                f"the difficulty of a course is {difficulty:g}; it must be 0 or more and 1 or less."
            )
        size = difficulty * RISE
        top = 2 * size
        if size < SLIVER:
            return cls(())
        blocks, gap, stones, down, rubble, end = (
            start + u for u in (0.35, 0.85, 1.1, 1.7, 2.1, 2.5)
        )
        return cls(
            (
                Section(start, 0.0, Steps.stairs(start, rise=size, run=RUN, count=2)),
                Section(blocks, top, Blocks(BLOCK, 0.0, size, DEPTH, blocks, 0.5, WIDTH, seed)),
                Section(gap, top, Steps.gap(gap + 0.1, width=size, depth=DEPTH)),
                Section(
                    stones,
                    top,
                    Blocks.stones(
                        stones,
                        size=LATTICE - difficulty * BLOCK,
                        distance=LATTICE,
                        height_range=size / 2,
                        depth=DEPTH,
                        length=0.6,
                        width=WIDTH,
                        seed=seed + 1,
                    ),
                ),
                Section(down, top, Steps.stairs(down + 0.1, rise=-size, run=RUN, count=2)),
                Section(
                    rubble, 0.0, Blocks(RUBBLE, 0.0, size, DEPTH, rubble, 0.4, WIDTH, seed + 2)
                ),
                Section(end, 0.0, Steps((), ())),
            )
        )

    def surface(self, u: Places, v: Places) -> Surface:
        """Return the height [m] and a slope of zero: edges have none."""
        heights = np.zeros(len(u))
        number = np.searchsorted([section.start for section in self.sections], u, side="right")
        for k, section in enumerate(self.sections, start=1):
            here = number == k
            heights[here] = section.base + section.shape.surface(u[here], v[here])[0]
        return level(heights)

    @cached_property
    def blocks(self) -> tuple[Block, ...]:
        """Blocks of all sections, cut off at the ends of each."""
        ends = [*(section.start for section in self.sections), FAR]
        found = [Block((-FAR, ends[0]), (-FAR, FAR), 0.0)]
        for section, end in zip(self.sections, ends[1:], strict=True):
            for block in section.shape.blocks:
                u0, u1 = max(block.u[0], section.start), min(block.u[1], end)
                if u1 - u0 > SLIVER:
                    found.append(Block((u0, u1), block.v, section.base + block.top))
        return tuple(found)
