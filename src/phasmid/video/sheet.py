"""A whole frame: the picture with its arrows and words, and the strip under it."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw

from phasmid.recording import Recording
from phasmid.reporting.sheet import drive_words, short
from phasmid.reporting.source import attribute, run_title
from phasmid.reporting.style import FAINT, INK
from phasmid.video.arrows import draw_arrows
from phasmid.video.camera import Camera
from phasmid.video.film import Film
from phasmid.video.floor import square_side
from phasmid.video.lettering import fitted, font
from phasmid.video.painter import Pixels
from phasmid.video.strip import Strip

PART = 0.26
"""Part of a frame's height that the strip takes."""

LINE = "#d9dce1"
"""Colour of the line between picture and strip."""


def picture_size(film: Film, size: tuple[int, int]) -> tuple[int, int]:
    """Width and height that the strip leaves for the picture, in pixels."""
    if film.normal is None:
        return size
    return size[0], size[1] - round(PART * size[1])


class Sheet:
    """Puts frames together."""

    def __init__(
        self,
        recording: Recording,
        film: Film,
        camera: Camera,
        size: tuple[int, int],
        speed: float,
    ) -> None:
        self._film, self._camera, self._size, self._speed = film, camera, size, speed
        self._picture = picture_size(film, size)
        width, height = size
        self._strip = None
        if film.normal is not None:
            self._strip = Strip(film, (width, height - self._picture[1]))
        self._large = font(max(round(0.030 * height), 13), bold=True)
        self._small = font(max(round(0.0205 * height), 10))
        self._lines = words(recording, film)

    def frame(self, number: int, picture: Pixels) -> Image.Image:
        """One frame.

        Args:
            number: Of the frame.
            picture: What the camera sees.
        """
        film, time = self._film, float(self._film.time[number])
        image = Image.fromarray(np.asarray(picture))
        draw_arrows(image, film, self._camera, number)
        self._write(image, time)
        if self._strip is None:
            return image
        whole = Image.new("RGB", self._size, "white")
        whole.paste(image, (0, 0))
        whole.paste(self._strip.at(time), (0, self._picture[1]))
        ImageDraw.Draw(whole).line(
            [(0, self._picture[1]), (self._size[0], self._picture[1])], fill=LINE
        )
        return whole

    def _write(self, image: Image.Image, time: float) -> None:
        """The run in the upper left corner, the time in the right one, what is shown below."""
        draw = ImageDraw.Draw(image)
        edge = round(0.5 * self._large.size) + 4
        clock = f"t = {time:.2f} s"
        if self._speed != 1:
            clock = f"{self._speed:g}×   {clock}"
        room = image.width - 3 * edge - self._large.getlength(clock)
        title, line, told = self._lines
        draw.text((edge, edge), fitted(title, self._large, room), INK, font=self._large)
        draw.text((image.width - edge, edge), clock, INK, font=self._large, anchor="ra")
        below = edge + 1.45 * self._large.size
        draw.text((edge, below), fitted(line, self._small, room), FAINT, font=self._small)
        low, wide = image.height - round(0.7 * edge), image.width - 2 * edge
        draw.text((edge, low), fitted(told, self._small, wide), FAINT, self._small, anchor="ls")


def words(recording: Recording, film: Film) -> list[str]:
    """The run's name and machine; what moves it; what is shown."""
    source = film.source
    scenario = source.scenario
    lines = [short(run_title(source))]
    lines.append(drive_words(recording, source))
    ending = attribute(recording, "ending")
    if ending in ("FELL", "DIVERGED"):
        lines[-1] += f" · {ending.lower()} at {film.normal_time[-1]:.2f} s"
    told = f"squares {1000 * square_side(scenario):.4g} mm"
    if scenario.terrain.kind != "flat":
        told = f"terrain: {scenario.terrain.kind} · {told}"
    if film.force is not None:
        told += f" · arrows: force of the ground on the feet, {film.whose}"
    lines.append(told)
    return lines
