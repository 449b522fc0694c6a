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
    solid = _front(solid, view)
    count = len(solid.corners)
    corners = np.concatenate([solid.corners, flat.corners])
    colours = np.concatenate([solid.colours, flat.colours])
    places = view.project(corners)
    places[..., :2] *= FINE
    index, near = rasterise(places, width * FINE, height * FINE)
    rows, columns = np.nonzero(index >= 0)
    which, near = index[rows, columns], near[rows, columns]
    pixel = rows // FINE * width + columns // FINE
    seen = near >= (1 - SUNK) * before.ravel()[pixel]
    rows, columns, which, near, pixel = (
        array[seen] for array in (rows, columns, which, near, pixel)
    )
    fine = colours[which]
    lit = which < count
    rays = view.rays((columns[lit] + 0.5) / FINE, (rows[lit] + 0.5) / FINE)
    points = view.eye + rays / near[lit][:, None]
    fine[lit] = shade(solid, which[lit], points, view, shadows)
    # Of each pixel the finer ones that show the ground have its colour.
    share = np.bincount(pixel, minlength=width * height)[:, None] / FINE**2
    things = [np.bincount(pixel, fine[:, k], minlength=width * height) for k in range(3)]
    image = floor.reshape(-1, 3) * (1 - share) + np.stack(things, axis=-1) / FINE**2
    return image.reshape(height, width, 3)


def _front(solid: Mesh, view: View) -> Mesh:
    """The faces that look at the camera; the others are hidden by them."""
    edges = solid.corners[:, 1:] - solid.corners[:, :1]
    outward = np.cross(edges[:, 0], edges[:, 1])
    towards = np.sum(outward * (view.eye - solid.corners[:, 0]), axis=1) > 0
    return Mesh(solid.corners[towards], solid.colours[towards])


def shade(
    mesh: Mesh, which: np.ndarray, points: np.ndarray, view: View, shadows: ShadowMap
) -> np.ndarray:
    """Colours of points on triangles under the light and the sky, shape (P, 3)."""
    edges = mesh.corners[:, 1:] - mesh.corners[:, :1]
    normals = np.cross(edges[:, 0], edges[:, 1])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-15)
    n = normals[which]
    facing = np.clip(n @ LIGHT, 0, 1)
    lit = shadows.light(points + 0.0012 * n, blur=0.0025, bias=0.0025, taps=6) * facing
    sky = 0.5 + 0.5 * n[:, 2]
    to_eye = view.eye - points
    to_eye /= np.linalg.norm(to_eye, axis=1, keepdims=True)
    half = to_eye + LIGHT
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    gloss = 0.22 * np.clip(np.sum(half * n, axis=1), 0, 1) ** 24 * (lit > 0.5)
    brightness = 0.30 + 0.30 * sky + 0.62 * lit
    return np.clip(mesh.colours[which] * brightness[:, None] + gloss[:, None], 0, 1)
