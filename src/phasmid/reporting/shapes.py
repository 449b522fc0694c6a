"""Solids as triangles, the parts of robots without meshes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles of one colour; from outside their corners run counter-clockwise.

    Attributes:
        corners: Corners of each triangle [m], shape (T, 3, 3).
        colour: Red, green and blue, 0 to 1.
    """

    corners: Float[np.ndarray, "triangles 3 3"]
    colour: Float[np.ndarray, "3"]

    def at(self, X: Float[np.ndarray, "4 4"]) -> Mesh:
        """Return the mesh moved by a pose."""
        return Mesh(self.corners @ X[:3, :3].T + X[:3, 3], self.colour)


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
    return Mesh(np.concatenate(triangles), rgb(colour))


def beam(sections: list[tuple[float, float, float]], colour: str, chamfer: float = 0.35) -> Mesh:
    """Return a beam along x through rectangles with cut corners.

    Args:
        sections: Place along x, half width in y and half width in z of each [m].
        colour: Such as ``#4a6fc4``.
        chamfer: Part of the smaller half width that is cut off a corner.
    """
    rings = []
    for x, y, z in sections:
        c = chamfer * min(y, z)
        upper = [(x, y, z - c), (x, y - c, z), (x, c - y, z), (x, -y, z - c)]
        lower = [(x, -y, c - z), (x, c - y, -z), (x, y - c, -z), (x, y, c - z)]
        rings.append(upper + lower)
    return loft(np.array(rings), colour)


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
    return Mesh(mesh.corners + np.array(centre), mesh.colour)


def turned(profile: list[tuple[float, float]], sides: int, colour: str) -> Mesh:
    """Return the solid of revolution about z through pairs of height and radius [m]."""
    angle = np.arange(sides) * 2 * math.pi / sides
    rings = [
        np.stack([r * np.cos(angle), r * np.sin(angle), np.full(sides, z)], axis=-1)
        for z, r in profile
    ]
    return loft(np.stack(rings), colour)


def cylinder(height: float, radius: float, colour: str) -> Mesh:
    """Return a cylinder with bevelled ends along z, about the origin [m]."""
    top, bevel = height / 2, 0.15 * min(radius, height)
    ends = [(top - bevel, radius), (top, radius - bevel)]
    return turned([*((-z, r) for z, r in reversed(ends)), *ends], 28, colour)


def ball(radius: float, colour: str) -> Mesh:
    """Return a ball about the origin [m]."""
    latitudes = np.linspace(-1.45, 1.45, 9).tolist()
    profile = [(radius * math.sin(angle), radius * math.cos(angle)) for angle in latitudes]
    return turned(profile, 20, colour)


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
    around = (points[:, None] + circle).reshape(-1, 2)
    outline = around[ConvexHull(around).vertices]
    middle = outline.mean(axis=0)
    bevel = 0.2 * (high - low)
    size = np.linalg.norm(outline - middle, axis=1, keepdims=True)
    inset = outline - (outline - middle) / size * bevel
    heights = ((low, inset), (low + bevel, outline), (high - bevel, outline), (high, inset))
    return loft(
        np.stack([np.c_[ring, np.full(len(ring), height)] for height, ring in heights]), colour
    )
