"""Solids as triangles, the parts of robots without meshes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True, eq=False)
class Mesh:
    """Coloured triangles; from outside their corners run counter-clockwise.

    Attributes:
        corners: Corners of each triangle [m], shape (T, 3, 3).
        colours: Colour of each triangle, red, green and blue, 0 to 1, shape (T, 3).
    """

    corners: Float[np.ndarray, "triangles 3 3"]
    colours: Float[np.ndarray, "triangles 3"]

    def at(self, X: Float[np.ndarray, "4 4"]) -> Mesh:
        """Return the mesh moved by a pose."""
        return Mesh(self.corners @ X[:3, :3].T + X[:3, 3], self.colours)


def joined(meshes: list[Mesh]) -> Mesh:
    """Return several meshes as one."""
    return Mesh(
        np.concatenate([mesh.corners for mesh in meshes]),
        np.concatenate([mesh.colours for mesh in meshes]),
    )


def rgb(colour: str) -> Float[np.ndarray, "3"]:
    """Return a colour such as ``#4a6fc4`` as red, green and blue from 0 to 1."""
    return np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])


def loft(rings: Float[np.ndarray, "rings points 3"], colour: str) -> Mesh:
    """Return the closed solid through rings of points, each counter-clockwise seen from the last.

    Args:
        rings: Convex outlines of equal number of points, from the first end to the last [m].
        colour: Such as ``#4a6fc4``.
    """
    low, high = rings[:-1], rings[1:]
    low_next, high_next = np.roll(low, -1, axis=1), np.roll(high, -1, axis=1)
    sides = [np.stack(c, axis=-2) for c in ((low, low_next, high_next), (low, high_next, high))]
    triangles = [side.reshape(-1, 3, 3) for side in sides]
    for ring, order in ((rings[0], -1), (rings[-1], 1)):
        outline = ring[::order]
        hub = np.broadcast_to(outline.mean(axis=0), outline.shape)
        triangles.append(np.stack([hub, outline, np.roll(outline, -1, axis=0)], axis=1))
    corners = np.concatenate(triangles)
    return Mesh(corners, np.broadcast_to(rgb(colour), (len(corners), 3)))


def _outline(half_y: float, half_z: float, chamfer: float) -> np.ndarray:
    """Return a rectangle with cut corners in y and z, counter-clockwise, shape (8, 2)."""
    c = chamfer * min(half_y, half_z)
    y, z = half_y, half_z
    points = [(y, z - c), (y - c, z), (c - y, z), (-y, z - c)]
    points += [(-y, c - z), (c - y, -z), (y - c, -z), (y, c - z)]
    return np.array(points)


def beam(sections: list[tuple[float, float, float]], colour: str, chamfer: float = 0.35) -> Mesh:
    """Return a beam along x through rectangles with cut corners.

    Args:
        sections: Place along x, half width in y and half width in z of each [m].
        colour: Such as ``#4a6fc4``.
        chamfer: Part of the smaller half width that is cut off a corner.
    """
    rings = np.zeros((len(sections), 8, 3))
    for ring, (x, half_y, half_z) in zip(rings, sections, strict=True):
        ring[:, 0] = x
        ring[:, 1:] = _outline(half_y, half_z, chamfer)
    return loft(rings, colour)


def box(centre: tuple[float, float, float], size: tuple[float, float, float], colour: str) -> Mesh:
    """Return a box along the axes with bevelled edges [m]."""
    length, width, height = size
    bevel = 0.12 * min(size)
    end, inner = length / 2, length / 2 - bevel
    y, z = width / 2, height / 2
    mesh = beam(
        [(-end, y - bevel, z - bevel), (-inner, y, z), (inner, y, z), (end, y - bevel, z - bevel)],
        colour,
        chamfer=0.24,
    )
    return Mesh(mesh.corners + np.array(centre), mesh.colours)


def cylinder(
    start: Float[np.ndarray, "3"],
    end: Float[np.ndarray, "3"],
    radii: tuple[float, float],
    colour: str,
    sides: int = 28,
) -> Mesh:
    """Return a cylinder with bevelled ends, or a cone where the radii differ [m]."""
    axis = end - start
    length = float(np.linalg.norm(axis))
    axis = axis / length
    aside = np.cross(axis, [0.0, 0.0, 1.0] if abs(axis[2]) < 0.9 else [1.0, 0.0, 0.0])
    aside /= np.linalg.norm(aside)
    angle = np.arange(sides) * 2 * math.pi / sides
    round_about = np.cos(angle)[:, None] * aside + np.sin(angle)[:, None] * np.cross(axis, aside)
    bevel = 0.15 * min(*radii, length) if radii[0] == radii[1] else 0.0
    places = [(0.0, radii[0] - bevel), (bevel, radii[0])]
    places += [(length - bevel, radii[1]), (length, radii[1] - bevel)]
    if bevel == 0.0:
        places = places[::3]
    rings = np.stack([start + place * axis + radius * round_about for place, radius in places])
    return loft(rings, colour)


def ball(centre: Float[np.ndarray, "3"], radius: float, colour: str) -> Mesh:
    """Return a ball [m]."""
    angle = np.arange(20) * math.pi / 10
    latitudes = np.linspace(-1.45, 1.45, 9)
    around = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    rings = np.zeros((len(latitudes), len(angle), 3))
    rings[..., :2] = np.cos(latitudes)[:, None, None] * around
    rings[..., 2] = np.sin(latitudes)[:, None]
    return loft(centre + radius * rings, colour)


def slab(
    points: Float[np.ndarray, "points 2"], radius: float, low: float, high: float, colour: str
) -> Mesh:
    """Return a plate whose outline is the hull of some points, rounded off about them.

    Args:
        points: Seen from above [m].
        radius: Of the rounding, and the margin about the points [m].
        low: Height of the lower face [m].
        high: Height of the upper face [m].
        colour: Such as ``#4a6fc4``.
    """
    angle = np.arange(24) * math.pi / 12
    circle = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    outline = _hull((points[:, None] + circle).reshape(-1, 2))
    middle = outline.mean(axis=0)
    bevel = 0.2 * (high - low)
    size = np.linalg.norm(outline - middle, axis=1, keepdims=True)
    inset = outline - (outline - middle) / size * bevel
    heights = ((low, inset), (low + bevel, outline), (high - bevel, outline), (high, inset))
    return loft(
        np.stack([np.c_[ring, np.full(len(ring), height)] for height, ring in heights]), colour
    )


def _hull(points: np.ndarray) -> np.ndarray:
    """Return the corners of the convex hull, counter-clockwise (Andrew's monotone chain)."""
    ordered = points[np.lexsort((points[:, 1], points[:, 0]))]

    def chain(row: np.ndarray) -> list[np.ndarray]:
        kept: list[np.ndarray] = []
        for point in row:
            while len(kept) > 1:
                a, b = kept[-1] - kept[-2], point - kept[-2]
                if a[0] * b[1] - a[1] * b[0] > 1e-15:
                    break
                kept.pop()
            kept.append(point)
        return kept[:-1]

    return np.array(chain(ordered) + chain(ordered[::-1]))
