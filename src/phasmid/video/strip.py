"""The strip under a video: the normal forces of all legs over time, and how they are now."""

from __future__ import annotations

import io
import math
from collections import OrderedDict
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from phasmid.reporting.style import FAINT, INK, Figure, leg_colour, styled, thin
from phasmid.video.film import Film, between
from phasmid.video.lettering import font

CYCLES, SHORTEST, LONGEST = 5.0, 3.0, 10.0
"""The strip shows so many cycles, but no less and no more seconds than these."""

PAST = 0.72
"""Part of the strip behind the cursor, where not all of the run fits."""

FUTURE = 0.62
"""How much of what is still to come is hidden."""

TALLEST = 1.3
"""Highest force that is shown, in weights of the robot."""

DPI = 100


class Strip:
    """Normal forces over time, with a cursor; where a run is long, they pass by.

    Attributes:
        size: Width and height, in pixels.
        window: Time that is shown at once [s].
    """

    def __init__(self, film: Film, size: tuple[int, int]) -> None:
        assert film.normal is not None
        self.size = size
        self._film = film
        width, height = size
        self.letters = max(round(0.078 * height), 10)
        self._left, self._right = round(4.1 * self.letters), round(9.6 * self.letters)
        self._top, self._bottom = round(0.5 * self.letters), round(1.75 * self.letters)
        self._plot = width - self._left - self._right
        begin, end = float(film.normal_time[0]), float(film.normal_time[-1])
        self._begin, self._length = begin, max(end - begin, 1e-3)
        cycles = CYCLES * film.source.scenario.stride.period
        self.window = min(self._length, float(np.clip(cycles, SHORTEST, LONGEST)))
        most = min(float(film.normal.max()), TALLEST * film.source.weight)
        least = max(min(float(film.normal.min()), 0.0), -0.5 * film.source.weight)
        self._limits = (least, max(1.06 * most, 0.05 * film.source.weight))
        self._tiles: OrderedDict[int, Image.Image] = OrderedDict()
        self._base = self._axis()

    def cursor(self, time: float) -> tuple[float, float]:
        """What is shown at a time: the strip's first moment [s], and the cursor's pixel."""
        since = time - self._begin
        first = float(np.clip(since - PAST * self.window, 0.0, self._length - self.window))
        return self._begin + first, self._left + (since - first) / self.window * self._plot

    def height_of(self, force: float) -> float:
        """Pixel from above at which a force [N] is drawn."""
        low, high = self._limits
        tall = self.size[1] - self._top - self._bottom
        return self._top + tall * (1 - (force - low) / (high - low))

    def at(self, time: float) -> Image.Image:
        """The strip at a time [s]."""
        film = self._film
        assert film.normal is not None
        image = self._base.copy()
        first, across = self.cursor(time)
        image.paste(self._curves(first), (self._left, 0))
        x = round(across)
        end, low = self._left + self._plot, self.size[1] - self._bottom
        if x + 1 < end:
            ahead = (x + 1, 0, end, low)
            part = image.crop(ahead)
            image.paste(Image.blend(part, Image.new("RGB", part.size, "white"), FUTURE), ahead[:2])
        draw = ImageDraw.Draw(image)
        wide = max(round(self.letters / 9), 1)
        draw.line([(x, self._top), (x, low)], fill=INK, width=wide)
        now = between(film.normal_time, film.normal, np.array([time]))[0]
        for leg, force in enumerate(now):
            self._dot(image, across, float(np.clip(force, *self._limits)), leg_colour(leg))
        self._legend(draw, now)
        return image

    def _dot(self, image: Image.Image, across: float, force: float, colour: str) -> None:
        fine, radius = 4, self.letters * 0.24
        size = math.ceil(2 * radius) + 4
        left, top = round(across - size / 2), round(self.height_of(force) - size / 2)
        part = image.crop((left, top, left + size, top + size)).resize((size * fine, size * fine))
        draw, middle = ImageDraw.Draw(part), size * fine / 2
        for r, fill in ((radius + 1, "white"), (radius, colour)):
            edge = [middle - r * fine, middle - r * fine, middle + r * fine, middle + r * fine]
            draw.ellipse(edge, fill=fill)
        image.paste(part.resize((size, size), Image.Resampling.BOX), (left, top))

    def _legend(self, draw: ImageDraw.ImageDraw, now: np.ndarray) -> None:
        """Names of the legs in their colours, and their forces now."""
        rows = len(now) + 1
        step = min((self.size[1] - 2 * self._top) / rows, 1.6 * self.letters)
        size = min(self.letters, max(int(step) - 1, 6))
        letters, bold = font(size), font(size, bold=True)
        left = self.size[0] - self._right + 1.1 * self.letters
        right = self.size[0] - 0.9 * self.letters
        y = self._top + step / 2
        for leg, force in enumerate(now):
            colour = leg_colour(leg)
            draw.text((left, y), f"leg {leg + 1}", colour, font=bold, anchor="lm")
            draw.text((right, y), newtons(float(force)), INK, font=letters, anchor="rm")
            y += step
        draw.text((left, y), "sum", FAINT, font=letters, anchor="lm")
        draw.text((right, y), newtons(float(now.sum())), FAINT, font=letters, anchor="rm")

    def _curves(self, first: float) -> Image.Image:
        """The part of the curves that begins at a time."""
        offset = round((first - self._begin) / self.window * self._plot)
        number, within = divmod(offset, self._plot)
        image = Image.new("RGB", (self._plot, self.size[1]), "white")
        image.paste(self._tile(number), (-within, 0))
        if within:
            image.paste(self._tile(number + 1), (self._plot - within, 0))
        return image

    def _tile(self, number: int) -> Image.Image:
        """The curves over one window of time; the last few that were asked for are kept."""
        if number not in self._tiles:
            self._tiles[number] = self._drawn_tile(number)
            if len(self._tiles) > 3:
                self._tiles.popitem(last=False)
        return self._tiles[number]

    def _drawn_tile(self, number: int) -> Image.Image:
        film = self._film
        assert film.normal is not None
        begin = self._begin + number * self.window
        end = begin + self.window
        margin = 0.02 * self.window
        inside = (film.normal_time >= begin - margin) & (film.normal_time <= end + margin)
        with styled():
            figure, axis = self._figure(self._plot, 0.0, 1.0)
            for leg in range(film.normal.shape[1]):
                if inside.any():
                    line = thin(film.normal_time[inside], film.normal[inside, leg])
                    axis.plot(*line, color=leg_colour(leg), linewidth=0.085 * self.letters * 1.25)
            axis.set_xlim(begin, end)
            axis.set_xticks(*self._marks(begin, end))
            axis.tick_params(axis="y", length=0, labelleft=False)
            axis.tick_params(axis="x", length=3, pad=2)
            axis.spines["left"].set_visible(False)
            return _image(figure)

    def _marks(self, begin: float, end: float) -> tuple[list[float], list[str]]:
        """Places of the marks of time and their labels; none hangs over an end of the run."""
        from matplotlib.ticker import MaxNLocator

        wide = 3.2 * self.letters / self._plot * self.window / 2
        last = self._begin + self._length
        count = max(3, round(self._plot / (7 * self.letters)))
        ticks = MaxNLocator(count, steps=[1, 2, 5, 10]).tick_values(begin, end)
        places = [float(t) for t in ticks if begin - wide <= t <= end + wide]
        told = [self._begin + wide <= t <= last - wide for t in places]
        return places, [
            f"{t:g} s" if t_told else "" for t, t_told in zip(places, told, strict=True)
        ]

    def _axis(self) -> Image.Image:
        """The empty strip with the scale of forces."""
        image = Image.new("RGB", self.size, "white")
        with styled():
            # A line at the right edge carries the marks.
            figure, axis = self._figure(self._left, 0.999, 0.001)
            axis.set_xlim(0, 1)
            axis.set_xticks([])
            axis.tick_params(axis="y", length=3, pad=2)
            room = self.size[1] - self._top - self._bottom
            words = "normal force [N]" if room > 8.5 * self.letters else "force [N]"
            axis.set_ylabel(words, labelpad=3)
            image.paste(_image(figure), (0, 0))
        return image

    def _figure(self, width: int, left: float, wide: float) -> tuple[Figure, Any]:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure as NewFigure

        height = self.size[1]
        figure = NewFigure(figsize=(width / DPI, height / DPI), dpi=DPI)
        FigureCanvasAgg(figure)
        tall = height - self._top - self._bottom
        axis = figure.add_axes((left, self._bottom / height, wide, tall / height))
        axis.set_ylim(*self._limits)
        axis.locator_params(axis="y", nbins=4)
        points = self.letters * 72 / DPI
        axis.tick_params(labelsize=0.92 * points)
        axis.yaxis.label.set_fontsize(0.92 * points)
        return figure, axis


def newtons(force: float) -> str:
    """A force with its unit, to tenths; what rounds to nothing is 0."""
    return f"{force + 0.0 if abs(force) >= 0.05 else 0.0:.1f} N"


def _image(figure: Figure) -> Image.Image:
    """A figure as a picture, pixel by pixel."""
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=DPI, metadata={"Software": None})
    file.seek(0)
    return Image.open(file).convert("RGB")
