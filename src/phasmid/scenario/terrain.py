"""Terrain of a scenario."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import count
from pathlib import Path
from typing import Annotated, Any, Literal

from annotated_types import Ge, Gt, Le, Lt
from pydantic import FailFast, model_validator

from phasmid.errors import InvalidInput, located
from phasmid.tables import Angle, Count, Hint, Length, Number, Of, Table, in_si
from phasmid.terrain import (
    Blocks,
    Course,
    Flat,
    Ground,
    HeightMap,
    Patch,
    Rough,
    Shape,
    Slope,
    Steps,
    Waves,
    height_text,
    heights_from_text,
    read_heights,
)
from phasmid.terrain.ground import HIGHEST_FRICTION, MOST_PATCHES
from phasmid.terrain.height_map import RAMP
from phasmid.terrain.height_text import BEGINNING, LONGEST
from phasmid.toml import is_file

START = 0.3
"""Default start of a terrain, just ahead of the PhantomX's first footholds [m]."""

FIELD_LENGTH, ICE_WIDTH = 2.4, 1.2
"""Length of a field of ice or of beams, and width of one of ice [m]."""


class TerrainTable(Table):
    """``[terrain]``, or ``terrain = "stairs"``: the ground.

    Before its start every terrain is level; only a slope has none unless it is given one, and a
    height map grows out of level ground in the 0.1 m before.

    Attributes:
        kind: ``flat``; ``slope``; ``stairs``; one ``step``; ``gap``, a ditch; ``steps`` at the
            places of `edge_x`; ``beams`` across the path; ``blocks`` of different heights;
            ``stepping-stones`` above a floor; ``course``: stairs, blocks, a gap, stones and rubble,
            3 m long; ``waves``; ``rough`` ground; ``height-map`` from a file; ``ice``: level, with
            slippery tiles.
        friction: Coefficient of Coulomb friction between foot and ground.
        patches: Rectangles of other friction along the terrain, each from x, to x, from y, to y
            [m], friction.
        planned_on: Ground of the plan: this ``terrain``, or ``level`` ground.
        terrain_start: Distance from the robot's start to the beginning of the terrain [m]; absent:
            300 mm, 400 mm for a height map whose left edge is not at height 0; a slope has none.
        terrain_yaw: Angle of the terrain to the left of the direction of walking [rad].
        terrain_seed: Seed of the heights of blocks, stones, courses and rough ground.
        slope: Angle of the slope, uphill [rad].
        rise: Height of the step, or of each of the stairs [m].
        run: Depth of each of the stairs [m].
        stair_count: Number of the stairs.
        gap_width: Width of the gap [m].
        gap_depth: Depth of the gap, and of gaps between blocks or stones [m].
        edge_x: Positions of the edges of ``steps`` [m].
        edge_z: Height behind each edge of ``steps`` [m].
        block_size: Side of a block [m].
        block_gap: Distance between blocks [m].
        block_height: Height range of blocks or stones [m].
        stone_size: Side of a stepping stone [m].
        stone_distance: Distance of neighbouring stepping stones, centre to centre [m].
        beam_width: Width of a beam along the path [m].
        beam_height: Height of the beams [m].
        beam_distance: Distance of neighbouring beams, centre to centre [m].
        course_level: Difficulty of the course, from 0, level ground, to 1: rises, ranges of heights
            and a gap of 60 mm, stones of 100 mm at 200 mm.
        wave_height: Height of the waves from trough to crest [m].
        wave_length: Length of the waves from crest to crest [m].
        roughness: Standard deviation of the height of rough ground [m].
        rough_length: Length of rough ground's shortest waves [m].
        height_map: An image, ``.npy`` or ``.csv`` file, seen from above with the walk to the right.
        map_cell: Distance of two samples of the height map [m].
        map_height: Height of white where the height map is an image [m].
        ice_friction: Friction of the slippery tiles.
        tile: Side of the slippery tiles [m].
    """

    kind: Literal[
        "flat",
        "slope",
        "stairs",
        "step",
        "gap",
        "steps",
        "beams",
        "blocks",
        "stepping-stones",
        "course",
        "waves",
        "rough",
        "height-map",
        "ice",
    ] = "flat"
    friction: Annotated[Number, Ge(0)] = 0.7
    patches: Annotated[
        tuple[tuple[Number, Number, Number, Number, Number], ...],
        FailFast(),
        Hint("patches = [[0.2, 0.4, -1, 1, 0.3]]"),
    ] = ()
    planned_on: Literal["terrain", "level"] = "terrain"
    terrain_start: Annotated[Length, Ge(-100), Le(100)] | None = None
    terrain_yaw: Annotated[Angle, Ge(-math.pi), Le(math.pi)] = 0.0
    terrain_seed: Annotated[
        Count, Ge(0), Lt(2**63), Of("blocks", "stepping-stones", "course", "rough")
    ] = 1
    slope: Annotated[Angle, Of("slope")] = math.radians(10)
    rise: Annotated[Length, Gt(-2), Lt(2), Of("stairs", "step")] = 0.020
    run: Annotated[Length, Gt(0), Le(10), Of("stairs")] = 0.120
    stair_count: Annotated[Count, Gt(0), Le(1000), Of("stairs")] = 5
    gap_width: Annotated[Length, Gt(0), Le(10), Of("gap")] = 0.030
    gap_depth: Annotated[Length, Gt(0), Le(10), Of("gap", "blocks", "stepping-stones")] = 0.100
    edge_x: Annotated[tuple[Length, ...], FailFast(), Of("steps")] = ()
    edge_z: Annotated[tuple[Length, ...], FailFast(), Of("steps")] = ()
    block_size: Annotated[Length, Gt(0), Le(10), Of("blocks")] = 0.080
    block_gap: Annotated[Length, Ge(0), Le(10), Of("blocks")] = 0.0
    block_height: Annotated[Length, Ge(0), Le(2), Of("blocks", "stepping-stones")] = 0.020
    stone_size: Annotated[Length, Gt(0), Le(10), Of("stepping-stones")] = 0.100
    stone_distance: Annotated[Length, Gt(0), Le(10), Of("stepping-stones")] = 0.200
    beam_width: Annotated[Length, Gt(0), Le(10), Of("beams")] = 0.050
    beam_height: Annotated[Length, Ge(0), Le(2), Of("beams")] = 0.030
    beam_distance: Annotated[Length, Gt(0.01), Le(10), Of("beams")] = 0.300
    course_level: Annotated[Number, Ge(0), Le(1), Of("course")] = 0.5
    wave_height: Annotated[Length, Ge(0), Le(2), Of("waves")] = 0.030
    wave_length: Annotated[Length, Gt(0), Le(100), Of("waves")] = 0.400
    roughness: Annotated[Length, Ge(0), Le(1), Of("rough")] = 0.006
    rough_length: Annotated[Length, Gt(0), Le(100), Of("rough")] = 0.150
    height_map: Annotated[str, Of("height-map")] = ""
    map_cell: Annotated[Length, Gt(0), Le(100), Of("height-map")] = 0.010
    map_height: Annotated[Length, Ge(0), Le(100), Of("height-map")] = 0.050
    ice_friction: Annotated[Number, Ge(0), Le(HIGHEST_FRICTION), Of("ice")] = 0.1
    tile: Annotated[Length, Gt(0.01), Le(10), Of("ice")] = 0.100

    @model_validator(mode="before")
    @classmethod
    def _from_name(cls, raw: Any) -> Any:
        if isinstance(raw, str):
            return {"kind": raw}
        if isinstance(raw, dict) and raw.get("kind") == "height-map":
            return _carried(in_si(cls, raw))
        return raw

    @model_validator(mode="after")
    def _check(self) -> TerrainTable:
        if self.friction > HIGHEST_FRICTION:
            raise InvalidInput(
                f"terrain.friction is {self.friction:g}; coefficients above "
                f"{HIGHEST_FRICTION:g} are refused."
            )
        # What no ground can be is refused here, not when the walk is planned.
        self.ground()
        return self

    def ground(self) -> Ground:
        """Return the ground that this table describes.

        Raises:
            InvalidInput: No such ground is known to the contact model, or its file is absent.
        """
        patches = [Patch((x0, x1), (y0, y1), mu) for x0, x1, y0, y1, mu in self.patches]
        with located("terrain"):
            if self.kind == "ice":
                patches = [*self._tiles(MOST_PATCHES - len(patches)), *patches]
            return Ground(self._shape(), self.friction, tuple(patches), self.terrain_yaw)

    @property
    def _start(self) -> float:
        return START if self.terrain_start is None else self.terrain_start

    def _shape(self) -> Shape:
        start = self._start
        if self.kind == "slope":
            return Slope(self.slope, self.terrain_start)
        if self.kind == "stairs":
            return Steps.stairs(start, rise=self.rise, run=self.run, count=self.stair_count)
        if self.kind == "step":
            return Steps((start,), (self.rise,))
        if self.kind == "gap":
            return Steps.gap(start, width=self.gap_width, depth=self.gap_depth)
        if self.kind == "steps":
            return Steps(self.edge_x, self.edge_z)
        if self.kind == "blocks":
            return Blocks(
                self.block_size,
                self.block_gap,
                self.block_height,
                self.gap_depth,
                start,
                seed=self.terrain_seed,
            )
        if self.kind == "stepping-stones":
            return Blocks.stones(
                start,
                size=self.stone_size,
                distance=self.stone_distance,
                height_range=self.block_height,
                depth=self.gap_depth,
                seed=self.terrain_seed,
            )
        if self.kind == "beams":
            return Steps.beams(
                start,
                width=self.beam_width,
                height=self.beam_height,
                distance=self.beam_distance,
                count=max(1, round(FIELD_LENGTH / self.beam_distance)),
            )
        if self.kind == "course":
            return Course.mixed(start, difficulty=self.course_level, seed=self.terrain_seed)
        if self.kind == "waves":
            return Waves(self.wave_height, self.wave_length, start)
        if self.kind == "rough":
            return Rough(self.roughness, self.rough_length, start, self.terrain_seed)
        if self.kind == "height-map":
            if not self.height_map:
                raise InvalidInput(
                    "a height map needs a file; terrain.height_map names none.",
                    hint="a .png, .npy or .csv file of heights as height_map",
                )
            source = self.height_map
            white, cell = self.map_height, self.map_cell
            return _height_map(source, _stamp(source), white, cell, self.terrain_start)
        return Flat()

    def _tiles(self, most: int) -> list[Patch]:
        """Return every second tile of the field, as on a chessboard.

        Args:
            most: Number of tiles that are allowed; below 0 the other patches are refused.

        Raises:
            InvalidInput: There would be more.
        """
        number = _tile_count(self.tile)
        if number > most >= 0:
            larger = count(math.ceil(1000 * self.tile))
            raise InvalidInput(
                f"ice in tiles of {1000 * self.tile:g} mm has {number} slippery ones; the limit "
                f"of patches of friction leaves {most}.",
                hint=f"tile_mm = {next(mm for mm in larger if _tile_count(mm / 1000) <= most)}",
            )
        along, across = _field(self.tile)
        left = -across * self.tile / 2
        tiles = []
        for i in range(along):
            for j in range(i % 2, across, 2):
                x, y = self._start + i * self.tile, left + j * self.tile
                tiles.append(Patch((x, x + self.tile), (y, y + self.tile), self.ice_friction))
        return tiles


def _field(tile: float) -> tuple[int, int]:
    """Return the numbers of tiles along and across a field of ice."""
    return round(FIELD_LENGTH / tile), round(ICE_WIDTH / tile)


def _tile_count(tile: float) -> int:
    """Return the number of slippery tiles: every second one, the first included."""
    along, across = _field(tile)
    return math.ceil(along * across / 2)


@lru_cache(2)
def _height_map(
    source: str, stamp: tuple[int, int], white: float, cell: float, start: float | None
) -> HeightMap:
    """Read and check a height map once: a run has ten tables of the same.

    Args:
        source: Its file, or the text that holds it.
        stamp: Time and size of the file: one that changed is read again.
        white: Height of white in an image [m].
        cell: Distance of two samples [m].
        start: Place of the map's left edge [m]; None: such that `START` is on level ground.
    """
    del stamp
    if source.startswith(BEGINNING):
        heights = heights_from_text(source)
    else:
        heights = read_heights(Path(source), white=white)
    heights.flags.writeable = False
    if start is None:
        start = START + RAMP if heights[:, 0].any() else START
    return HeightMap(heights, cell, start)


def _stamp(source: str) -> tuple[int, int]:
    """Return modification time [ns] and size of a height map's file; zeros if there is none."""
    if source.startswith(BEGINNING) or not is_file(Path(source)):
        return 0, 0
    status = Path(source).stat()
    return status.st_mtime_ns, status.st_size


def _carried(raw: dict[str, Any]) -> dict[str, Any]:
    """Return a table with its height map embedded, unless it is too long."""
    name = raw.get("height_map")
    if not isinstance(name, str) or not name or name.startswith(BEGINNING):
        return raw
    white = raw.get("map_height", TerrainTable.model_fields["map_height"].default)
    if not isinstance(white, float | int) or isinstance(white, bool):
        return raw
    with located("terrain.height_map"):
        heights = read_heights(Path(name), white=float(white))
    text = height_text(heights) if heights.size <= LONGEST else ""
    embedded = 0 < len(text) <= LONGEST
    return raw | {"height_map": text if embedded else str(Path(name).absolute())}


def beside(file: Path, name: str) -> str:
    """Path of a height map that a scenario file names; text that holds a map stays as it is."""
    return name if not name or name.startswith(BEGINNING) else str(file.parent / name)
