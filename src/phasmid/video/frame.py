"""A whole frame: the picture with its arrows and words, and the normal forces over time below."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float, UInt8

from phasmid.reporting.camera import View
from phasmid.reporting.drawing import draw_force_arrows
from phasmid.reporting.run import Run, short
from phasmid.reporting.style import (
    FAINT,
    INK,
    MOST_POINTS,
    Figure,
    leg_colour,
    new_figure,
    shrink,
    thin,
)
from phasmid.video.film import square_side

Pixels = UInt8[np.ndarray, "height width 3"]

STRIP = 0.26
"""Share of a frame's height that the forces take."""

DPI = 100

CYCLES, SHORTEST, LONGEST = 5.0, 3.0, 10.0
"""Cycles in the window of the forces, and its least and largest duration [s]."""

PAST = 0.72
"""Share of the window before the cursor, where it does not hold the whole run."""

FUTURE = 0.62
"""Opacity of the veil over the time after the cursor."""

TALLEST = 1.3
"""Largest force that is shown, in weights of the robot."""


def picture_size(run: Run, size: tuple[int, int]) -> tuple[int, int]:
    """Return width and height of the picture within a frame [pixels]."""
    if run.normal_force is None:
        return size
    return size[0], size[1] - round(STRIP * size[1])


class FrameFigure:
    """Draws the frames of a video, one after the other, under `phasmid.reporting.style.styled`.

    Args:
        run: The whole run.
        frames: Its part that the video shows, a sample for each frame.
        size: Width and height of a frame [pixels].
        speed: Recorded seconds per second of the video.
    """

    def __init__(self, run: Run, frames: Run, size: tuple[int, int], speed: float) -> None:
        self._run, self._speed, self._time = run, speed, frames.time
        self._feet, self._force = frames.channel("foot_position"), frames.foot_force
        width, height = size
        self._figure = new_figure(width / DPI, height / DPI, DPI)
        # The figure is laid over the picture, which matplotlib would resample.
        self._figure.set_facecolor("none")
        inner = picture_size(run, size)
        place = (0, 1 - inner[1] / height, 1, inner[1] / height)
        self._picture = self._figure.add_axes(place)
        self._picture.set_axis_off()
        self._picture.set(xlim=(0, inner[0]), ylim=(inner[1], 0))
        self._clock = _write_words(self._figure, run, height, place[1])
        self._arrows: list[Any] = []
        normal = run.normal_force
        self._strip = None if normal is None else _Strip(self._figure, run, normal, size)

    def frame(self, number: int, picture: Pixels, view: View) -> Pixels:
        """Return one frame.

        Args:
            number: Number of the frame.
            picture: The camera's picture.
            view: The camera.
        """
        from PIL import Image

        time = float(self._time[number])
        for patch in self._arrows:
            patch.remove()
        self._arrows = []
        if self._feet is not None and self._force is not None:
            colours = [leg_colour(leg) for leg in range(len(self._run.robot.legs))]
            forces = self._feet[number], self._force[number]
            self._arrows = draw_force_arrows(self._picture, self._run, view, *forces, colours)
        clock = f"t = {time:.2f} s"
        self._clock.set_text(clock if self._speed == 1 else f"{self._speed:g}×   {clock}")
        if self._strip is not None:
            self._strip.show(time)
        canvas: Any = self._figure.canvas
        canvas.draw()
        overlay = Image.fromarray(np.asarray(canvas.buffer_rgba()))
        frame = Image.new("RGB", overlay.size, "white")
        frame.paste(Image.fromarray(picture))
        frame.paste(overlay, mask=overlay)
        return np.asarray(frame)


def _write_words(figure: Figure, run: Run, height: int, bottom: float) -> Any:
    """Write title, drive and legend into the picture; return the text of the clock."""
    line, ending = run.drive_words, run.attribute("ending")
    if ending in ("FELL", "DIVERGED"):
        line += f" · {ending.lower()} at {run.time[-1]:.2f} s"
    legend = f"squares {1000 * square_side(run.scenario):.4g} mm"
    if run.scenario.terrain.kind != "flat":
        legend = f"terrain: {run.scenario.terrain.kind} · {legend}"
    if run.foot_force is not None and run.has("foot_position"):
        legend += f" · arrows: force of the ground on the feet, {run.force_words}"
    large = max(0.030 * height, 13.0) * 72 / DPI
    small = max(0.0205 * height, 10.0) * 72 / DPI
    edge = 0.02 * height
    x, y = edge / figure.bbox.width, edge / height
    drop = 1.45 * large * DPI / 72 / height
    look: dict[str, Any] = {"fontsize": large, "fontweight": "bold", "va": "top"}
    clock = figure.text(1 - x, 1 - y, "0.25×   t = 000.00 s", ha="right", **look)
    room = float(figure.bbox.width) - 3 * edge - clock.get_window_extent().width
    shrink(figure.text(x, 1 - y, short(run.title), **look), room, least=large)
    look = {"fontsize": small, "color": FAINT}
    shrink(figure.text(x, 1 - y - drop, line, va="top", **look), room, least=small)
    width = float(figure.bbox.width) - 2 * edge
    shrink(figure.text(x, bottom + y, legend, **look), width, least=small)
    return clock


class _Strip:
    """Normal forces of all legs over time, with a cursor; those of a long run scroll."""

    def __init__(
        self,
        figure: Figure,
        run: Run,
        normal: Float[np.ndarray, "time legs"],
        size: tuple[int, int],
    ) -> None:
        from matplotlib.patches import Rectangle

        self._normal, self._time = normal, run.time
        self._begin, end = float(self._time[0]), float(self._time[-1])
        self._length = max(end - self._begin, 1e-3)
        cycles = CYCLES * run.scenario.stride.period
        self.window = min(self._length, float(np.clip(cycles, SHORTEST, LONGEST)))
        width, height = size
        tall = round(STRIP * height)
        letters = max(0.078 * tall, 10.0)
        edges = (4.1 * letters / width, 1.75 * letters / height)
        extent = (1 - 13.7 * letters / width, (tall - 2.25 * letters) / height)
        self.axis = figure.add_axes((*edges, *extent))
        type_size = 0.92 * letters * 72 / DPI
        weight = run.weight
        most = min(float(normal.max()), TALLEST * weight)
        least = max(min(float(normal.min()), 0.0), -0.5 * weight)
        self.axis.set_ylim(least, max(1.06 * most, 0.05 * weight))
        self.axis.locator_params(axis="y", nbins=4)
        room = "normal force [N]" if tall > 10.75 * letters else "force [N]"
        self.axis.set_ylabel(room, fontsize=type_size)
        self.axis.tick_params(labelsize=type_size, length=3, pad=2)
        self.axis.xaxis.set_major_formatter("{x:g} s")
        points = round(MOST_POINTS * self._length / self.window)
        step = min(0.9 / (normal.shape[1] + 1), 1.6 * letters / (extent[1] * height))
        size_of_row = min(type_size, step * extent[1] * height * 72 / DPI * 0.8)
        self._values = []
        for leg in range(normal.shape[1] + 1):
            row: dict[str, Any] = {"transform": self.axis.transAxes, "va": "center"}
            row |= {"fontsize": size_of_row, "color": FAINT}
            y, name = 1 - (leg + 0.5) * step, "sum"
            if leg < normal.shape[1]:
                self.axis.plot(
                    *thin(self._time, normal[:, leg], points), color=leg_colour(leg), linewidth=1.4
                )
                name = f"leg {leg + 1}"
                row |= {"color": leg_colour(leg), "fontweight": "bold"}
            pad = letters / (extent[0] * width)
            self.axis.text(1 + 1.1 * pad, y, name, **row)
            row |= {"color": INK, "fontweight": "normal", "ha": "right"}
            self._values.append(self.axis.text(1 + 8.7 * pad, y, "", **row))
        veil: dict[str, Any] = {"color": "white", "alpha": FUTURE, "linewidth": 0, "zorder": 3}
        veil["transform"] = self.axis.get_xaxis_transform()
        self._veil = Rectangle((0, 0), 1, 1, **veil)
        self.axis.add_patch(self._veil)
        self._cursor = self.axis.axvline(0.0, color=INK, linewidth=1.0, zorder=4)
        colours = [leg_colour(leg) for leg in range(normal.shape[1])]
        dots: dict[str, Any] = {"s": 30, "edgecolors": "white", "linewidths": 1, "zorder": 5}
        zeros = np.zeros(normal.shape[1])
        self._dots = self.axis.scatter(zeros, zeros, c=colours, clip_on=False, **dots)

    def show(self, time: float) -> None:
        """Move cursor, window and numbers to a time [s]."""
        first = self._begin + float(
            np.clip(time - self._begin - PAST * self.window, 0.0, self._length - self.window)
        )
        self.axis.set_xlim(first, first + self.window)
        self._cursor.set_xdata([time, time])
        self._veil.set_x(time)
        self._veil.set_width(first + self.window - time)
        now = np.array([np.interp(time, self._time, leg) for leg in self._normal.T])
        shown = np.clip(now, *self.axis.get_ylim())
        self._dots.set_offsets(np.column_stack([np.full(len(now), time), shown]))
        for text, force in zip(self._values, [*now, now.sum()], strict=True):
            text.set_text(newtons(float(force)))


def newtons(force: float) -> str:
    """Return a force with its unit, to tenths and without a negative zero."""
    return f"{round(force, 1) + 0.0:.1f} N"
