"""The floor of a picture: a faint grid that fades into the distance, and shadows on it."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.reporting.camera import View
from phasmid.reporting.light import ShadowMap
from phasmid.reporting.shapes import Mesh, rgb

GRID = 0.1
"""Distance of the lines [m]."""

FLOOR, LINE, SHADE = rgb("#f3f5f8"), rgb("#d5dae2"), rgb("#596579")

MAP = 360
"""Pixels across the map of what hangs over the ground."""


def ground(view: View, shadows: ShadowMap, solid: Mesh) -> Float[np.ndarray, "height width 3"]:
    """Colours of the level ground as the camera sees it, white where there is none.

    Args:
        view: The camera.
        shadows: What the light sees.
        solid: What stands on the ground and dims it.
    """
    width, height = view.size
    image = np.ones((height, width, 3))
    across, down = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    rays = view.rays(across, down)
    below = rays[..., 2] < -1e-3
    reach = np.where(below, -view.eye[2] / np.where(below, rays[..., 2], -1.0), 0.0)
    # The floor fades away from the robot and towards the picture's edges.
    middle = solid.corners.mean(axis=(0, 1))
    size = float(np.ptp(solid.corners[..., :2], axis=(0, 1)).max())
    away = np.hypot(*(view.eye[k] + rays[..., k] * reach - middle[k] for k in range(2))) / size
    edge = np.minimum(np.minimum(across, width - across) / width, (height - down) / height)
    fade = np.clip((1.4 - away) / 0.9, 0, 1) ** 1.5 * np.clip(edge / 0.07, 0, 1) * below
    rows, columns = np.nonzero(fade > 0.004)
    reach, fade = reach[rows, columns], fade[rows, columns]
    points = view.eye + rays[rows, columns] * reach[:, None]

    # The ground under one pixel, so that a line keeps its width on paper.
    pixel = reach / view.focal
    off = np.abs((points[:, :2] / GRID + 0.5) % 1.0 - 0.5).min(axis=1) * GRID
    grid = np.clip(1.4 - off / np.maximum(pixel, 1e-6), 0, 1)
    colour = FLOOR + grid[:, None] * (LINE - FLOOR)
    lit = shadows.light(points, blur=0.010, bias=0.0005, taps=16)
    dim = np.minimum(0.34 * (1 - lit) + 0.34 * _overhang(points, solid), 0.62)
    colour = colour + dim[:, None] * (SHADE - colour)
    image[rows, columns] = 1.0 + fade[:, None] * (colour - 1.0)
    return image


def _overhang(points: np.ndarray, solid: Mesh) -> np.ndarray:
    """How much of the sky over ground points is hidden, roughly: what is above, blurred."""
    from PIL import Image, ImageDraw, ImageFilter

    low = solid.corners[..., :2].min(axis=(0, 1)) - 0.1
    span = float((solid.corners[..., :2].max(axis=(0, 1)) + 0.1 - low).max())
    scale = MAP / span
    hidden = np.zeros((MAP, MAP))
    heights = solid.corners[..., 2].min(axis=1)
    # What is near the ground dims little of it, but sharply; what is high dims much, softly.
    for under, blur, strength in ((0.03, 0.006, 0.8), (np.inf, 0.030, 0.75)):
        layer = Image.new("L", (MAP, MAP))
        draw = ImageDraw.Draw(layer)
        for triangle in (solid.corners[heights < under][..., :2] - low) * scale:
            draw.polygon([(float(x), float(y)) for x, y in triangle], fill=255)
        soft = layer.filter(ImageFilter.GaussianBlur(blur * scale))
        hidden = np.maximum(hidden, strength * np.asarray(soft) / 255)
    place = np.clip((points[..., :2] - low) * scale, 0, MAP - 1).astype(int)
    return np.asarray(hidden[place[..., 1], place[..., 0]])
