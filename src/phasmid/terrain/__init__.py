"""Terrains: height, normal and friction of the ground."""

from phasmid.terrain.blocks import Blocks
from phasmid.terrain.flat import Flat
from phasmid.terrain.ground import Ground, Patch
from phasmid.terrain.height_file import file_hash, read_heights
from phasmid.terrain.height_map import HeightMap
from phasmid.terrain.height_text import height_text, heights_from_text
from phasmid.terrain.rough import Rough
from phasmid.terrain.shape import Block, Blocky, Shape
from phasmid.terrain.slope import Slope
from phasmid.terrain.steps import Steps
from phasmid.terrain.terrain import Terrain
from phasmid.terrain.waves import Waves

__all__ = [
    "Block",
    "Blocks",
    "Blocky",
    "Flat",
    "Ground",
    "HeightMap",
    "Patch",
    "Rough",
    "Shape",
    "Slope",
    "Steps",
    "Terrain",
    "Waves",
    "file_hash",
    "height_text",
    "heights_from_text",
    "read_heights",
]
