"""Arrows that show the forces on the feet, drawn over a picture so that no leg hides them."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float
from PIL import Image, ImageDraw

from phasmid.reporting.drawing import FORCE_LENGTH
from phasmid.reporting.style import leg_colour
from phasmid.video.camera import Camera
from phasmid.video.film import Film

FINE = 4
"""Each pixel is the mean of this many by as many finer ones."""

LEAST = 0.01
"""Part of the weight below which a force is no arrow."""

WIDTH, HEAD, HEAD_LENGTH, RIM = 0.0046, 0.0135, 0.0165, 0.0013
"""Of an arrow, in widths of the picture."""


def draw_arrows(image: Image.Image, film: Film, camera: Camera, frame: int) -> None:
    """Draw the forces on the feet into a picture, each in its leg's colour.

    Args:
        image: It is changed.
        film: Its feet and forces; without these nothing is drawn.
        camera: Which took the picture.
        frame: Number of the frame.
    """
    if film.feet is None or film.force is None:
        return
    hips = film.source.robot.arrays.p_body_hip[:, :2]
    length = FORCE_LENGTH * float(np.ptp(hips, axis=0).max()) / film.source.weight
    feet, force = film.feet[frame], film.force[frame]
    view = camera.at(frame)
    starts, tips = view.project(feet)[:, :2], view.project(feet + length * force)[:, :2]
    # The nearest comes last, over the others.
    for leg in np.argsort(view.project(feet)[:, 2]):
        if np.linalg.norm(force[leg]) > LEAST * film.source.weight:
            _draw(image, starts[leg], tips[leg], leg_colour(int(leg)), image.width)


def _draw(
    image: Image.Image,
    start: Float[np.ndarray, "2"],
    tip: Float[np.ndarray, "2"],
    colour: str,
    width: int,
) -> None:
    """One arrow with a white rim, and a dot at its foot."""
    rim = max(RIM * width, 1.0)
    outline = _outline(start, tip, width)
    margin = HEAD * width + 2 * rim
    low = np.floor(np.minimum(start, tip) - margin).astype(int)
    high = np.ceil(np.maximum(start, tip) + margin).astype(int)
    low, high = np.maximum(low, 0), np.minimum(high, [image.width, image.height])
    if (low >= high).any():
        return
    box = (int(low[0]), int(low[1]), int(high[0]), int(high[1]))
    part = image.crop(box)
    large = part.resize((part.width * FINE, part.height * FINE), Image.Resampling.NEAREST)
    draw = ImageDraw.Draw(large)
    shape = [((x - low[0]) * FINE, (y - low[1]) * FINE) for x, y in outline]
    centre, radius = (start - low) * FINE, 0.6 * WIDTH * width * FINE * 1.5
    dot = [*(centre - radius), *(centre + radius)]
    wide = [*(centre - radius - rim * FINE), *(centre + radius + rim * FINE)]
    draw.line([*shape, shape[0]], fill="white", width=round(2 * rim * FINE), joint="curve")
    draw.ellipse(wide, fill="white")
    draw.polygon(shape, fill=colour)
    draw.ellipse(dot, fill=colour)
    image.paste(large.resize(part.size, Image.Resampling.BOX), box[:2])


def _outline(
    start: Float[np.ndarray, "2"], tip: Float[np.ndarray, "2"], width: int
) -> list[tuple[float, float]]:
    """Corners of an arrow, in pixels."""
    way = tip - start
    length = max(math.hypot(*way), 1e-6)
    along = way / length
    side = np.array([-along[1], along[0]])
    head = min(HEAD_LENGTH * width, 0.62 * length)
    neck = tip - head * along
    half, wing = WIDTH * width / 2, HEAD * width / 2 * head / (HEAD_LENGTH * width)
    wing = max(wing, half)
    points = [start + half * side, neck + half * side, neck + wing * side, tip]
    points += [neck - wing * side, neck - half * side, start - half * side]
    return [(float(x), float(y)) for x, y in points]
