"""Shapes of the ground in the terrain's own axes: plane, slope, waves, steps and blocks."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, TypeAlias, runtime_checkable

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.kinematics.shared_kernels import quintic

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
    share, slope, _ = quintic(np.minimum(np.maximum((u - start) / length, 0.0), 1.0))
    return share, slope / length


@dataclass(frozen=True)
class Flat:
    """Level ground at height 0."""

    def surface(self, u: Places, v: Places) -> Surface:
        """Return zero."""
        del v
        return level(np.zeros(len(u)))


STEEPEST = math.radians(45)
"""Steepest slope on which the contact is tested [rad]."""


@dataclass(frozen=True)
class Slope:
    """Plane that rises along u.

    Attributes:
        angle: Of the plane to the level [rad]; below 0 it falls.
        start: Where it begins, with level ground before it [m]; None: the plane has no beginning
            and goes through the origin.
    """

    angle: float
    start: float | None = None

    def __post_init__(self) -> None:
        if not abs(self.angle) <= STEEPEST:
            raise InvalidInput(
                f"slope of {math.degrees(self.angle):g}° exceeds {math.degrees(STEEPEST):g}°, the "
                "steepest this contact model is verified for."
            )

    def surface(self, u: Places, v: Places) -> Surface:
        """Return height [m], and slope along u and v."""
        along, steepness = u, math.tan(self.angle)
        rising = np.full(along.shape, steepness)
        if self.start is not None:
            along = along - self.start
            rising, along = steepness * (along >= 0), np.maximum(along, 0.0)
        return steepness * along, np.stack([rising, np.zeros_like(v)], axis=-1)


@dataclass(frozen=True)
class Waves:
    """Sinusoid along u, which begins in a trough at the height of level ground.

    Attributes:
        wave_height: From trough to crest [m].
        wave_length: From crest to crest [m].
        start: Where the first wave begins to rise [m].
    """

    wave_height: float
    wave_length: float
    start: float

    def __post_init__(self) -> None:
        steepest = math.pi * self.wave_height / self.wave_length if self.wave_length > 0 else 2.0
        if not abs(steepest) <= 1.0:
            raise InvalidInput(
                f"waves of {1000 * self.wave_height:g} mm in {1000 * self.wave_length:g} mm are "
                f"steeper than 45°, the steepest this contact model is verified for.",
                hint=f"wave_length_mm = {math.ceil(1000 * math.pi * abs(self.wave_height))}",
            )

    def surface(self, u: Places, v: Places) -> Surface:
        """Return height [m], and slope along u and v."""
        k = 2 * np.pi / self.wave_length
        phase = k * np.maximum(u - self.start, 0.0)
        height = self.wave_height / 2 * (1 - np.cos(phase))
        return height, np.stack(
            [self.wave_height / 2 * k * np.sin(phase), np.zeros_like(v)], axis=-1
        )


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

    @classmethod
    def beams(
        cls, start: float, *, width: float, height: float, distance: float, count: int
    ) -> Steps:
        """Return equal beams across u on level ground, the first at `start`.

        Args:
            start: Place of the first edge [m].
            width: Of each beam along u [m].
            height: Of their tops above the ground [m].
            distance: From each beam to the next, centre to centre [m].
            count: Number of beams.
        """
        if not 0 < width < distance:
            raise InvalidInput(
                f"beams of {width:g} m width, {distance:g} m from centre to centre; the width must "
                "be greater than 0 and less than the distance."
            )
        near = [start + distance * k for k in range(count)]
        return cls(tuple(x for u in near for x in (u, u + width)), (height, 0.0) * count)

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
        seed: Of the heights and displacements.
        jitter: Largest displacement of a block from the middle of its cell, along u and v [m];
            every second row is moved by half a cell. None: all blocks lie at the near corners of
            their cells.
    """

    size: float
    gap: float
    height_range: float
    gap_depth: float
    start: float
    length: float = 2.4
    width: float = 1.6
    seed: int = 1
    jitter: float | None = None

    def __post_init__(self) -> None:
        if not (self.size > 0 and self.gap >= 0 and self.height_range >= 0):
            raise InvalidInput(
                f"blocks of {self.size:g} m, {self.gap:g} m apart, with heights over "
                f"{self.height_range:g} m; the first must be greater than 0, the others 0 or more."
            )
        across, down = self.length / self.pitch, self.width / self.pitch
        if across * down > MOST_BLOCKS:
            least = math.sqrt(self.length * self.width / MOST_BLOCKS)
            raise InvalidInput(
                f"a field of {across * down:.0f} blocks; the limit is {MOST_BLOCKS}.",
                hint=f"block_size_mm = {math.ceil(1000 * (least - self.gap))}",
            )
        if self.gap > 0 and not self.gap_depth > self.height_range / 2:
            raise InvalidInput(
                f"the floor between blocks lies {self.gap_depth:g} m deep; it must be deeper than "
                f"the lowest block, {self.height_range / 2:g} m."
            )
        if self.jitter is not None and not 0 <= self.jitter <= self.gap / 2 > 0:
            raise InvalidInput(
                f"blocks are displaced by up to {self.jitter:g} m; it must be 0 or more, and half "
                f"the gap between them or less, {self.gap / 2:g} m, which must be greater than 0."
            )

    @classmethod
    def stones(
        cls,
        start: float,
        *,
        size: float,
        distance: float,
        height_range: float,
        depth: float,
        length: float = length,
        width: float = width,
        seed: int = 1,
    ) -> Blocks:
        """Return stepping stones, each displaced by up to a quarter of the gap.

        Args:
            start: Where the field begins [m].
            size: Side of a stone [m].
            distance: Of neighbouring stones, centre to centre [m].
            height_range: Difference between the highest and the lowest possible top [m].
            depth: Of the floor [m].
            length: Of the field along u [m].
            width: Of the field along v [m].
            seed: Of the heights and displacements.
        """
        if not 0 < size < distance:
            raise InvalidInput(
                f"stones of {size:g} m, {distance:g} m from centre to centre; the size must be "
                "greater than 0 and less than the distance."
            )
        gap = distance - size
        return cls(size, gap, height_range, depth, start, length, width, seed, gap / 4)

    @property
    def pitch(self) -> float:
        """Distance between the edges of neighbouring blocks [m]."""
        return self.size + self.gap

    @cached_property
    def tops(self) -> Float[np.ndarray, "along across"]:
        """Heights of the blocks [m]."""
        shape = (max(1, round(self.length / self.pitch)), max(1, round(self.width / self.pitch)))
        tops = np.random.default_rng(self.seed).uniform(-0.5, 0.5, shape) * self.height_range
        if self.jitter is not None:
            # A row that is moved by half a cell has one block less.
            tops[1::2, -1] = -self.gap_depth
        tops.flags.writeable = False
        return tops

    @cached_property
    def _offsets(self) -> Float[np.ndarray, "2 along across"]:
        """Offsets of the blocks from the near corners of their cells along u and v [m]."""
        shape = (2, *self.tops.shape)
        if self.jitter is None:
            return np.zeros(shape)
        random = np.random.default_rng((self.seed, 1))
        return self.gap / 2 + random.uniform(-self.jitter, self.jitter, shape)

    @property
    def _stagger(self) -> float:
        """Displacement of every second row along v, in cells."""
        return 0.0 if self.jitter is None else 0.5

    @property
    def _corner(self) -> tuple[float, float]:
        return self.start, -self.tops.shape[1] * self.pitch / 2

    def surface(self, u: Places, v: Places) -> Surface:
        """Return the height [m] and a slope of zero: edges have none."""
        u0, v0 = self._corner
        places = np.stack([u - u0, v - v0]) / self.pitch
        counts = np.array(self.tops.shape)[:, None]
        inside = ((places >= 0) & (places < counts)).all(axis=0)
        places[1] -= self._stagger * (np.floor(places[0]) % 2)
        cells = np.floor(places)
        # In a row that is moved -1 is the missing last block.
        i, j = np.clip(np.nan_to_num(cells), -1, counts - 1).astype(int)
        beyond = (places - cells) * self.pitch - self._offsets[:, i, j]
        on_top = ((beyond >= 0) & (beyond <= self.size)).all(axis=0)
        return level(np.where(inside, np.where(on_top, self.tops[i, j], -self.gap_depth), 0.0))

    @cached_property
    def blocks(self) -> tuple[Block, ...]:
        """Blocks, ground around the field, and floor between the blocks.

        Cached: Python 3.11 evaluates it in each test for `Blocky`, once per update of a controller.
        A drive of 10 s over 384 blocks takes 1.1 s instead of 2.2 s.
        """
        u0, v0 = self._corner
        u1, v1 = (w + n * self.pitch for w, n in zip((u0, v0), self.tops.shape, strict=True))
        found = [
            Block((-FAR, u0), (-FAR, FAR), 0.0),
            Block((u1, FAR), (-FAR, FAR), 0.0),
            Block((u0, u1), (-FAR, v0), 0.0),
            Block((u0, u1), (v1, FAR), 0.0),
        ]
        for (i, j), top in np.ndenumerate(self.tops):
            if self.gap > 0 and top == -self.gap_depth:
                continue
            along, across = self._offsets[:, i, j]
            u = u0 + i * self.pitch + float(along)
            v = v0 + (j + self._stagger * (i % 2)) * self.pitch + float(across)
            found.append(Block((u, u + self.size), (v, v + self.size), float(top)))
        if self.gap > 0:
            found.append(Block((u0, u1), (v0, v1), -self.gap_depth))
        return tuple(found)
