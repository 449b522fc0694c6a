"""Terrains: height, normal and friction of the ground."""

from phasmid.terrain.course import Course, Section
from phasmid.terrain.ground import Ground, Patch
from phasmid.terrain.height_file import read_heights
from phasmid.terrain.height_map import HeightMap
from phasmid.terrain.height_text import height_text, heights_from_text
from phasmid.terrain.rough import Rough
from phasmid.terrain.shapes import Block, Blocks, Blocky, Flat, Shape, Slope, Steps, Waves

__all__ = [
    "Block",
    "Blocks",
    "Blocky",
    "Course",
    "Flat",
    "Ground",
    "HeightMap",
    "Patch",
    "Rough",
    "Section",
    "Shape",
    "Slope",
    "Steps",
    "Waves",
    "height_text",
    "heights_from_text",
    "read_heights",
]
