"""A whole frame: the picture with its arrows and words, and the normal forces over time below."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import UInt8

from phasmid.reporting.camera import View
from phasmid.reporting.drawing import draw_force_arrows
from phasmid.reporting.film.film import square_side
from phasmid.reporting.run import Run, short
from phasmid.reporting.style import FAINT, INK, leg_colour, new_figure

Pixels = UInt8[np.ndarray, "height width 3"]

STRIP = 0.26
"""Share of a frame's height that the forces take."""

DPI = 100

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
        bottom = 1 - inner[1] / height
        self._picture = self._figure.add_axes((0, bottom, 1, 1 - bottom))
        self._picture.set_axis_off()
        self._picture.set(xlim=(0, inner[0]), ylim=(inner[1], 0))
        self._letters = max(0.0205 * height, 10.0) * 72 / DPI
        self._clock = self._write_words(bottom)
        self._arrows: list[Any] = []
        self.strip = None
        if run.normal_force is not None:
            place = (0.075, 0.16 * bottom, 0.785, 0.78 * bottom)
            self.strip = _Strip(self._figure.add_axes(place), run, self._letters)

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
        if self.strip is not None:
            self.strip.show(time)
        canvas: Any = self._figure.canvas
        canvas.draw()
        overlay = Image.fromarray(np.asarray(canvas.buffer_rgba()))
        frame = Image.new("RGB", overlay.size, "white")
        frame.paste(Image.fromarray(picture))
        frame.paste(overlay, mask=overlay)
        return np.asarray(frame)

    def _write_words(self, bottom: float) -> Any:
        """Write title, drive and legend into the picture; return the text of the clock."""
        run = self._run
        line = " · ".join(filter(None, (run.drive_words, run.ending_words)))
        legend = f"squares {1000 * square_side(run.experiment.course.stride.step_length):.4g} mm"
        if run.experiment.world.kind != "flat":
            legend = f"terrain: {run.experiment.world.kind} · {legend}"
        if run.foot_force is not None and run.has("foot_position"):
            legend += f" · arrows: force of the ground on the feet, {run.force_words}"
        write, edge = self._figure.text, 0.015
        large: dict[str, Any] = {"fontsize": 1.45 * self._letters, "fontweight": "bold"}
        small: dict[str, Any] = {"fontsize": self._letters, "color": FAINT}
        write(edge, 1 - 2 * edge, short(run.title), va="top", **large)
        write(edge, 0.925, line, va="top", **small)
        write(edge, bottom + 1.5 * edge, legend, **small)
        return write(1 - edge, 1 - 2 * edge, "", va="top", ha="right", **large)


class _Strip:
    """Normal forces of all legs over time, with a cursor.

    Args:
        axis: Its axes.
        run: The whole run.
        letters: Size of type [pt].
    """

    def __init__(self, axis: Any, run: Run, letters: float) -> None:
        normal = run.normal_force
        assert normal is not None
        self.axis, self._normal, self._time = axis, normal, run.time
        most = min(float(normal.max()), TALLEST * run.weight)
        least = max(min(float(normal.min()), 0.0), -0.5 * run.weight)
        axis.set_ylim(least, max(1.06 * most, 0.05 * run.weight))
        axis.set_xlim(run.time[0], max(run.time[-1], run.time[0] + 1e-3))
        axis.locator_params(axis="y", nbins=4)
        axis.set_ylabel("normal force [N]", fontsize=letters)
        axis.tick_params(labelsize=letters, length=3, pad=2)
        axis.xaxis.set_major_formatter("{x:g} s")
        colours = [leg_colour(leg) for leg in range(normal.shape[1])]
        for force, colour in zip(normal.T, colours, strict=True):
            axis.plot(self._time, force, color=colour, linewidth=1.4)
        rows = np.linspace(0.96, 0.04, len(colours) + 1)
        row: dict[str, Any] = {"transform": axis.transAxes, "va": "center", "fontweight": "bold"}
        row["fontsize"] = min(1.0, 8 / len(rows)) * letters
        self._values = [
            axis.text(1.02, y, "", color=colour, **row)
            for y, colour in zip(rows, [*colours, INK], strict=True)
        ]
        self._cursor = axis.axvline(run.time[0], color=INK, linewidth=1.6, zorder=4)

    def show(self, time: float) -> None:
        """Move the cursor and the numbers to a time [s]."""
        self._cursor.set_xdata([time, time])
        now = np.array([np.interp(time, self._time, leg) for leg in self._normal.T])
        names = [*(f"leg {leg + 1}" for leg in range(len(now))), "sum  "]
        for text, name, force in zip(self._values, names, [*now, now.sum()], strict=True):
            text.set_text(f"{name} {newtons(force)}")


def newtons(force: float) -> str:
    """Return a force with its unit, to tenths, without a negative zero and of even width."""
    return f"{round(float(force), 1) + 0.0:.1f} N".rjust(7, "\N{FIGURE SPACE}")
