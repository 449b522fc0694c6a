"""What the robot walks on: height, normal and friction at every point."""

from phasmid.terrain.flat import Flat
from phasmid.terrain.terrain import Terrain

__all__ = ["Flat", "Terrain"]
