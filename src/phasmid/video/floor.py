"""The ground of a video: a checkerboard, so that motion is seen, on the terrain of the run."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float, UInt8

from phasmid.reporting.ground import floor_colour
from phasmid.reporting.landscape import CELL, landscape
from phasmid.scenario import Scenario
from phasmid.terrain import Ground
from phasmid.video.solid import surface

LIGHT_SQUARE, DARK_SQUARE = 1.0, 0.865
"""Brightness of the two kinds of squares, in that of the ground."""

SQUARE = 0.1
"""About the side of a square [m]."""

ABOUT = 2.6
"""How far about the robot's way uneven ground is shown [m]."""

MOST_CELLS = 280
"""Most cells along a side of curved ground."""

PIXELS, COARSE = 2048, 512
"""Pixels along the side of a painted ground, and of its friction."""

TILE = 256
"""Pixels along the side of the picture that is repeated on level ground."""


def square_side(scenario: Scenario) -> float:
    """Side of the squares [m]: a whole number of steps, so that each cycle passes whole squares.

    Args:
        scenario: Its steps count where they are of some length.
    """
    step = scenario.stride.step_length
    if not 0.01 <= step <= 2 * SQUARE:
        return SQUARE
    return step * max(1, round(SQUARE / step - 1e-9))


def floor(
    terrain: Ground, way: Float[np.ndarray, "frames 2"], side: float
) -> dict[str, np.ndarray]:
    """What the process that draws needs of the ground.

    Args:
        terrain: The ground.
        way: Where the robot is, in the world [m].
        side: Of the squares [m].
    """
    if terrain.is_level and not terrain.patches:
        image = _checkered(*_grid(np.zeros(2), 2 * side, TILE), side, terrain)
        return {
            "floor_image": image,
            "floor_side": np.array(2 * side),
            "floor_level": np.array(0.0),
        }
    low, high = way.min(axis=0), way.max(axis=0)
    middle = (low + high) / 2
    reach = float((high - low).max()) / 2 + ABOUT
    cell = max(CELL, 2 * reach / MOST_CELLS)
    found = surface(landscape(terrain, middle, reach, cell).corners)
    assert found is not None
    return {
        "floor_image": _checkered(*_grid(middle - reach, 2 * reach, PIXELS), side, terrain),
        "floor_vertices": found.vertices,
        "floor_normals": found.normals,
        "floor_faces": found.faces,
        "floor_places": (found.vertices[:, :2] - (middle - reach)) / (2 * reach),
    }


def _grid(
    corner: Float[np.ndarray, "2"], size: float, pixels: int
) -> tuple[Float[np.ndarray, "rows columns"], Float[np.ndarray, "rows columns"]]:
    """World coordinates x and y of pixels, x to the right and y upwards from the last row."""
    along = (np.arange(pixels) + 0.5) / pixels * size
    x, y = np.meshgrid(corner[0] + along, corner[1] + along[::-1])
    return x, y


def _checkered(
    x: Float[np.ndarray, "rows columns"],
    y: Float[np.ndarray, "rows columns"],
    side: float,
    terrain: Ground,
) -> UInt8[np.ndarray, "rows columns 3"]:
    """The ground's colours at places of the world, in squares."""
    odd = (np.floor(x / side) + np.floor(y / side)) % 2 == 1
    bright = np.where(odd, DARK_SQUARE, LIGHT_SQUARE)
    every = math.ceil(len(x) / COARSE)
    places = np.stack([x[::every, ::every].ravel(), y[::every, ::every].ravel()], axis=-1)
    colour = np.broadcast_to(floor_colour(places, terrain), (len(places), 3))
    rows = len(x[::every])
    colour = colour.reshape(rows, -1, 3).repeat(every, axis=0).repeat(every, axis=1)
    shade = colour[: len(x), : x.shape[1]] * bright[..., None]
    return np.rint(255 * np.clip(shade, 0, 1)).astype(np.uint8)
