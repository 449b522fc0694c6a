"""Solids on the ground, as a picture."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

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
    which, near, pixel, part = _patches(index, near, before)
    colour = np.take(colours.T, which, axis=1)
    lit = which < count
    down, across = np.divmod(pixel[lit], width)
    points = view.at(view.rays(across + 0.5, down + 0.5), 1 / near[lit])
    colour[:, lit] = shade(solid, which[lit], points, view, shadows)
    # What is left of a pixel shows the ground.
    share = np.bincount(pixel, part, minlength=width * height)
    things = np.stack([np.bincount(pixel, part * one, minlength=width * height) for one in colour])
    image = floor.reshape(-1, 3).T * (1 - share) + things
    return np.moveaxis(image.reshape(3, height, width), 0, -1)


def _patches(
    index: Int[np.ndarray, "down across"],
    near: Float[np.ndarray, "down across"],
    before: Float[np.ndarray, "height width"],
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What is shaded once: a triangle in a pixel, in however many of the finer ones it is seen.

    Args:
        index: The nearest triangle of each finer pixel, -1 where there is none.
        near: Its nearness.
        before: Nearness of the ground.

    Returns:
        Triangle, nearness, pixel, and part of the pixel, of each patch.
    """
    width = before.shape[1]
    rows, columns = np.divmod(np.flatnonzero(index >= 0), width * FINE)
    is_hit = np.zeros(before.size, dtype=bool)
    is_hit[rows // FINE * width + columns // FINE] = True
    pixels = np.flatnonzero(is_hit)
    rows, columns = np.divmod(pixels, width)
    finer = [
        (FINE * rows + down) * width * FINE + FINE * columns + across
        for down in range(FINE)
        for across in range(FINE)
    ]
    index, near = index.ravel()[finer], near.ravel()[finer]
    index = np.where(near >= (1 - SUNK) * before.ravel()[pixels], index, -1)
    patches = []
    for k, own in enumerate(index):
        is_new = own >= 0
        for earlier in index[:k]:
            is_new &= earlier != own
        at = np.flatnonzero(is_new)
        same = index[k:, at] == own[at]
        count = same.sum(axis=0)
        mean = np.sum(near[k:, at], axis=0, where=same) / count
        patches.append((own[at], mean, pixels[at], count / FINE**2))
    which, near, pixel, part = (np.concatenate(parts) for parts in zip(*patches, strict=True))
    return which, near, pixel, part


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
