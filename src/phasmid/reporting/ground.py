"""The ground of a picture: a faint grid that fades into the distance, and shadows on it."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.reporting.camera import View, rasterise
from phasmid.reporting.landscape import landscape
from phasmid.reporting.light import LIGHT, ShadowMap
from phasmid.reporting.shapes import Mesh, rgb
from phasmid.terrain import Blocky, Ground

GRID = 0.1
"""Distance of the lines [m]."""

FLOOR, LINE, SHADE = rgb("#f3f5f8"), rgb("#d5dae2"), rgb("#596579")
LOW, HIGH = rgb("#9fb2c6"), rgb("#fdf6e3")
"""Colours of the lowest and the highest place in a picture of uneven ground."""

FULL_RANGE = 0.02
"""Range of heights from which on these colours are full; level ground has none of them [m]."""

SLIPPERY, GRIPPING = rgb("#8fc7ee"), rgb("#dcb98f")
"""Colours of ground without friction, and with twice that of the ground about it."""

FARTHEST = 2.0
"""Where the ground has faded away, in sizes of the robot."""

EDGE_SHADE = 0.55
"""By how much the edge of a step is darker."""

SHARP = 0.004
"""Jump of the nearness, as a part of it, that is drawn as a full edge."""

MAP = 360
"""Pixels across the map of what hangs over the ground."""

ROWS = 32
"""Rows of the picture that are worked on together."""


def ground(
    view: View, shadows: ShadowMap, solid: Mesh, terrain: Ground
) -> tuple[Float[np.ndarray, "height width 3"], Float[np.ndarray, "height width"]]:
    """The ground as the camera sees it.

    Args:
        view: The camera.
        shadows: What the light sees.
        solid: What stands on the ground and dims it.
        terrain: The ground.

    Returns:
        Colours, white where there is no ground, and its nearness [1/m], 0 where it hides nothing.
    """
    width, height = view.size
    image = np.ones((3, height * width))
    middle = solid.corners.mean(axis=(0, 1))
    low, high = solid.extent()
    size = float((high - low)[:2].max())
    near = np.zeros((height, width))
    if not terrain.is_level:
        mesh = landscape(terrain, middle[:2], FARTHEST * size)
        index, near = rasterise(view.project(mesh.corners), width, height)
        near = np.maximum(near, 0.0)
        index, edges = index.ravel(), _edges(near).ravel()
    # A few rows at a time, which stay in the processor's cache.
    seen = [
        _seen(view, slice(top, min(top + ROWS, height)), terrain, near, middle, size)
        for top in range(0, height, ROWS)
    ]
    lowest = min(points[:, 2].min(initial=0.0) for _, _, _, points in seen)
    highest = max(points[:, 2].max(initial=0.0) for _, _, _, points in seen)
    cover = _Cover(solid, terrain)
    for place, reach, fade, points in seen:
        # The ground under one pixel, so that a line keeps its width on paper.
        pixel = reach / view.focal
        grid = _lines(points, GRID, pixel)
        if terrain.is_level:
            bright = np.ones(len(points))
        else:
            normals = _normals(mesh, index[place], points, terrain)
            bright = _brightness(normals) / _brightness(np.array([[0.0, 0.0, 1.0]]))
            # An edge is a line, and heights differ in colour: the eye has little else to tell a
            # step by that it looks onto from above.
            bright *= 1 - EDGE_SHADE * edges[place]
            if not isinstance(terrain.shape, Blocky):
                # On hills finer lines show the shape.
                grid = np.maximum(grid, 0.6 * _lines(points, GRID / 4, pixel))
            # Lines of x and y would run together on the side of a step.
            grid = grid * (normals[:, 2] > 0.5)
        rise = highest - lowest
        part = (points[:, 2, None] - lowest) / max(rise, 1e-9)
        by_height = FLOOR + min(rise / FULL_RANGE, 1.0) * (LOW + part * (HIGH - LOW) - FLOOR)
        floor = floor_colour(points, terrain, by_height).T
        colour = floor + grid * (LINE[:, None] - floor)
        lit = shadows.light(points, blur=0.010, bias=0.0005, taps=16)
        dim = np.minimum(0.34 * (1 - lit) + 0.34 * cover.over(points), 0.62)
        colour = np.clip((colour + dim * (SHADE[:, None] - colour)) * bright, 0, 1)
        for part, faded in zip(image, 1.0 + fade * (colour - 1.0), strict=True):
            part[place] = faded
    return np.moveaxis(image.reshape(3, height, width), 0, -1), near


def _seen(
    view: View,
    rows: slice,
    terrain: Ground,
    near: Float[np.ndarray, "height width"],
    middle: Float[np.ndarray, "3"],
    size: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Where ground is seen in some rows of a picture: pixel, depth, how much of it, and point."""
    width, height = view.size
    across = np.arange(width) + 0.5
    down = np.arange(rows.start, rows.stop)[:, None] + 0.5
    rays = view.rays(across, down)
    if terrain.is_level:
        below = rays[..., 2] < -1e-3
        reach = np.where(below, -view.eye[2] / np.where(below, rays[..., 2], -1.0), 0.0)
    else:
        below = near[rows] > 0
        reach = np.where(below, 1 / np.where(below, near[rows], 1.0), 0.0)
    # The floor fades away from the robot and towards the picture's edges.
    x, y = (view.eye[k] - middle[k] + rays[..., k] * reach for k in range(2))
    left = np.clip((FARTHEST - np.sqrt(x * x + y * y) / size) / 0.9, 0, 1)
    edge = np.minimum(np.minimum(across, width - across) / width, (height - down) / height)
    fade = left * np.sqrt(left) * np.clip(edge / 0.07, 0, 1) * below
    found = np.flatnonzero(fade > 0.004)
    reach, fade = reach.ravel()[found], fade.ravel()[found]
    rays = np.stack([rays[..., k].ravel()[found] for k in range(3)]).T
    points = view.at(rays, reach)
    return found + rows.start * width, reach, fade, points


def _lines(points: np.ndarray, distance: float, pixel: np.ndarray) -> np.ndarray:
    """How much of a line across x or y runs through each point, 0 to 1."""
    x, y = (np.abs(across - np.rint(across)) for across in points[:, :2].T / distance)
    return np.clip(1.4 - np.minimum(x, y) * distance / np.maximum(pixel, 1e-6), 0, 1)


def _normals(
    mesh: Mesh, which: np.ndarray, points: np.ndarray, terrain: Ground
) -> Float[np.ndarray, "points 3"]:
    """Unit vectors out of the ground; on the side of a step, out of that."""
    edges = mesh.corners[:, 1:] - mesh.corners[:, :1]
    faces = np.cross(edges[:, 0], edges[:, 1])
    faces /= np.maximum(np.linalg.norm(faces, axis=1, keepdims=True), 1e-15)
    found = faces[which]
    upwards = found[:, 2] > 1e-6
    found[upwards] = terrain.normal(points[upwards, 0], points[upwards, 1])
    return found


def _brightness(normals: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, " points"]:
    """Light of the sky and the lamp on surfaces, told a little more strongly than it is."""
    return 0.15 + 0.10 * (0.5 + 0.5 * normals[:, 2]) + 0.75 * np.clip(normals @ LIGHT, 0, 1)


def _edges(near: Float[np.ndarray, "height width"]) -> Float[np.ndarray, "height width"]:
    """How much of an edge runs through each pixel, 0 to 1: nearness is linear on a plane."""
    bend = np.zeros_like(near)
    bend[1:-1] += np.abs(near[2:] + near[:-2] - 2 * near[1:-1])
    bend[:, 1:-1] += np.abs(near[:, 2:] + near[:, :-2] - 2 * near[:, 1:-1])
    return np.clip(bend / np.maximum(near, 1e-6) / SHARP, 0, 1)


def floor_colour(points: np.ndarray, terrain: Ground, floor: np.ndarray = FLOOR) -> np.ndarray:
    """Return the colour of the ground by its friction, shape (P, 3) or (3,).

    Args:
        points: On the ground [m], shape (P, 3).
        terrain: The ground.
        floor: Its colour outside of all patches, shape (P, 3) or (3,).
    """
    if not terrain.patches or terrain.coefficient == 0:
        return floor
    ratio = terrain.friction(points[:, 0], points[:, 1])[:, None] / terrain.coefficient
    slippery, gripping = np.clip(1 - ratio, 0, 1), np.clip(ratio - 1, 0, 1)
    return floor + slippery * (SLIPPERY - floor) + gripping * (GRIPPING - floor)


class _Cover:
    """How much of the sky is hidden over the ground, roughly: what is above, blurred."""

    def __init__(self, solid: Mesh, terrain: Ground) -> None:
        from PIL import Image, ImageFilter

        # From above only what faces up is seen.
        solid = solid.front(np.array([0.0, 0.0, 1.0]))
        low, high = (end[:2] for end in solid.extent())
        self._low = low - 0.1
        span = float((high + 0.1 - self._low).max())
        self._scale = MAP / span
        self._hidden = np.zeros((MAP, MAP))
        heights = (
            solid.corners[..., 2] - terrain.height(*np.moveaxis(solid.corners[..., :2], -1, 0))
        ).min(axis=1)
        seen = np.empty_like(solid.corners)
        seen[..., :2] = (solid.corners[..., :2] - self._low) * self._scale
        seen[..., 2] = np.where(heights < 0.03, 1.0, 0.0)[:, None]
        near = rasterise(seen, MAP, MAP)[1]
        # What is near the ground dims little of it, but sharply; what is high dims much, softly.
        for least, blur, strength in ((1.0, 0.006, 0.8), (0.0, 0.030, 0.75)):
            layer = Image.fromarray(np.where(near >= least, 255, 0).astype(np.uint8))
            soft = layer.filter(ImageFilter.GaussianBlur(blur * self._scale))
            self._hidden = np.maximum(self._hidden, strength * np.asarray(soft) / 255)

    def over(self, points: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, " points"]:
        """Part of the sky that is hidden over points of the ground."""
        across, down = (
            np.clip((points[:, k] - self._low[k]) * self._scale, 0, MAP - 1).astype(int)
            for k in range(2)
        )
        return np.asarray(self._hidden[down, across])
