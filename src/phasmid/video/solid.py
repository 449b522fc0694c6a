"""Triangles as a graphics card takes them: corners once, each with the direction it faces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

CREASE = np.cos(np.radians(32.0))
"""Faces that meet at a sharper angle than this are an edge; others are one smooth surface."""

FINEST = 1e-7
"""Corners nearer than this are one [m]."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A surface of one colour or texture.

    Attributes:
        vertices: [m], shape (V, 3).
        normals: Unit vectors out of the surface there, shape (V, 3).
        faces: Indices of each triangle's corners, shape (T, 3).
    """

    vertices: Float[np.ndarray, "vertices 3"]
    normals: Float[np.ndarray, "vertices 3"]
    faces: Int[np.ndarray, "triangles 3"]


def surface(corners: Float[np.ndarray, "triangles 3 3"]) -> Surface | None:
    """The surface of loose triangles: round where they meet at flat angles, sharp at edges.

    Args:
        corners: Of each triangle, counter-clockwise from outside [m].

    Returns:
        None where no triangle has an area.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    place = _places(corners.reshape(-1, 3)).reshape(-1, 3)
    a, b, c = place.T
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(area, axis=1)
    kept = (a != b) & (b != c) & (c != a) & (size > 0)
    if not kept.any():
        return None
    corners, place, area, size = corners[kept], place[kept], area[kept], size[kept]
    facing = area / size[:, None]
    pairs = _neighbours(place)
    smooth = np.einsum("ij,ij->i", facing[pairs[:, 0]], facing[pairs[:, 1]]) > CREASE
    first, second = pairs[smooth].T
    links = coo_array((np.ones(len(first)), (first, second)), shape=(len(place), len(place)))
    group = connected_components(links, directed=False)[1]
    # A corner that several smooth surfaces share has a direction of its own on each of them.
    both = (place * (int(group.max()) + 1) + group[:, None]).ravel()
    _, kept_corner, faces = np.unique(both, return_index=True, return_inverse=True)
    faces = faces.reshape(-1, 3)
    normals = np.zeros((len(kept_corner), 3))
    for k in range(3):
        weight = np.repeat(area[:, k], 3)
        normals[:, k] = np.bincount(faces.ravel(), weight, minlength=len(kept_corner))
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    # A fold that closes on itself has no direction of its own: its face's is taken.
    own = facing[kept_corner // 3]
    normals = np.where(length > 1e-12 * size.max(), normals / np.maximum(length, 1e-300), own)
    return Surface(corners.reshape(-1, 3)[kept_corner], normals, faces)


def _places(points: Float[np.ndarray, "points 3"]) -> Int[np.ndarray, " points"]:
    """Numbers of points, the same for those that are one; far faster than to sort rows."""
    number = np.zeros(len(points), dtype=np.int64)
    for part in points.T:
        steps = np.rint((part - part.min()) / FINEST).astype(np.int64)
        # Each product fits 64 bits: as many numbers as points, and steps over some metres.
        number = np.unique(number * (int(steps.max()) + 1) + steps, return_inverse=True)[1]
        number = number.ravel()
    return number


def _neighbours(place: Int[np.ndarray, "triangles 3"]) -> Int[np.ndarray, "pairs 2"]:
    """Pairs of triangles that share an edge."""
    ends = np.sort(place[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    edges = ends[:, 0] * (int(place.max()) + 1) + ends[:, 1]
    owner = np.repeat(np.arange(len(place)), 3)
    order = np.argsort(edges, kind="stable")
    edges, owner = edges[order], owner[order]
    same = edges[1:] == edges[:-1]
    return np.stack([owner[:-1][same], owner[1:][same]], axis=1)
