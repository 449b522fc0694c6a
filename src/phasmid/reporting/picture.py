"""Solids on the ground, as a picture."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.reporting.camera import View, rasterise
from phasmid.reporting.ground import ground
from phasmid.reporting.light import LIGHT, ShadowMap
from phasmid.reporting.shapes import Mesh
from phasmid.terrain import Ground

FINE = 2
"""Each pixel is the mean of this many by as many finer ones."""


SUNK = 0.004
"""Part of its distance by which a thing may lie behind the ground and still be seen: a foot presses
into it, and its trail lies on it."""


def picture(
    solid: Mesh, flat: Mesh, view: View, terrain: Ground
) -> Float[np.ndarray, "height width 3"]:
    """A picture of solids on the ground.

    Args:
        solid: What is lit and casts shadows.
        flat: What is only drawn, in its own colour: trails and arrows.
        view: The camera.
        terrain: The ground.

    Returns:
        Red, green and blue of each pixel, 0 to 1.
    """
    width, height = view.size
    shadows = ShadowMap(solid)
    floor, before = ground(view, shadows, solid, terrain)
    solid = solid.front(view.eye - solid.corners[:, 0])
    count = len(solid.corners)
    corners = np.concatenate([solid.corners, flat.corners])
    colours = np.concatenate([solid.colours, flat.colours])
    places = view.project(corners)
    places[..., :2] *= FINE
    index, near = rasterise(places, width * FINE, height * FINE)
    hit = np.flatnonzero(index >= 0)
    which, near = index.ravel()[hit], near.ravel()[hit]
    rows, columns = np.divmod(hit, width * FINE)
    pixel = rows // FINE * width + columns // FINE
    seen = near >= (1 - SUNK) * before.ravel()[pixel]
    rows, columns, which, near, pixel = (
        array[seen] for array in (rows, columns, which, near, pixel)
    )
    fine = np.take(colours.T, which, axis=1)
    lit = which < count
    rays = view.rays((columns[lit] + 0.5) / FINE, (rows[lit] + 0.5) / FINE)
    points = view.at(rays, 1 / near[lit])
    fine[:, lit] = shade(solid, which[lit], points, view, shadows)
    # Of each pixel the finer ones that show the ground have its colour.
    share = np.bincount(pixel, minlength=width * height) / FINE**2
    things = np.stack([np.bincount(pixel, part, minlength=width * height) for part in fine])
    image = floor.reshape(-1, 3).T * (1 - share) + things / FINE**2
    return np.moveaxis(image.reshape(3, height, width), 0, -1)


def shade(
    mesh: Mesh, which: np.ndarray, points: np.ndarray, view: View, shadows: ShadowMap
) -> np.ndarray:
    """Red, green and blue of points on triangles under the light and the sky, shape (3, P)."""
    normals = mesh.outward()
    normals = (normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-15)).T
    facing = np.clip(LIGHT @ normals, 0, 1)
    lit = facing[which]
    # What looks away from the light need not be asked.
    turned = np.flatnonzero(lit)
    start = points[turned].T + 0.0012 * normals[:, which[turned]]
    lit[turned] *= shadows.light(start.T, blur=0.0025, bias=0.0025, taps=6)
    glossy = np.flatnonzero(lit > 0.5)
    half = view.eye[:, None] - points[glossy].T
    half = half / np.sqrt(np.sum(half**2, axis=0)) + LIGHT[:, None]
    cosine = np.sum(half * normals[:, which[glossy]], axis=0) / np.sqrt(np.sum(half**2, axis=0))
    sky = mesh.colours.T * (0.30 + 0.30 * (0.5 + 0.5 * normals[2]))
    found = sky[:, which] + 0.62 * mesh.colours.T[:, which] * lit
    found[:, glossy] += 0.22 * np.clip(cosine, 0, 1) ** 24
    return np.clip(found, 0, 1)
