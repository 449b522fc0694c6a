"""What the figures share: a panel per leg, its stance shaded, and who walked under which terms."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.recording import Recording
from phasmid.reporting.source import Source, attribute, channel, plain, read_source
from phasmid.reporting.steps import intervals
from phasmid.reporting.style import FAINT, Figure, leg_colour

if TYPE_CHECKING:
    import matplotlib.axes

Axes: TypeAlias = "matplotlib.axes.Axes"

STANCE_COLOUR = "#eef1f5"

WIDEST_CAPTION = 106
"""Letters that fit on the line under a title."""


def panels(
    recording: Recording, legs: tuple[int, ...], what: str, unit: str, note: str = ""
) -> tuple[Figure, list[Axes], np.ndarray]:
    """A figure with one panel per leg, its stance shaded."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as NewFigure

    source = read_source(recording)
    count = len(source.robot.legs)
    for leg in legs:
        if not 1 <= leg <= count:
            raise InvalidInput(f"there is no leg {leg}; legs are 1 to {count}.")
    height = 1.15 + 1.65 * len(legs)
    figure = NewFigure(figsize=(7.2, height))
    FigureCanvasAgg(figure)
    grid = figure.subplots(len(legs), 1, sharex=True, sharey=True, squeeze=False)
    figure.subplots_adjust(
        left=0.108, right=0.98, top=1 - 0.88 / height, bottom=0.47 / height, hspace=0.34
    )
    axes: list[Axes] = list(grid[:, 0])
    listed = ", ".join(map(str, legs[:-1])) + (" and " if legs[1:] else "") + str(legs[-1])
    title = f"{what} of leg{'s' if legs[1:] else ''} {listed}"
    place: dict[str, Any] = {"x": 0.108, "va": "top", "ha": "left"}
    figure.text(y=1 - 0.10 / height, s=title, fontsize=11.5, fontweight="bold", **place)
    about = textwrap.shorten(caption(recording, source) + note, WIDEST_CAPTION, placeholder=" …")
    figure.text(y=1 - 0.33 / height, s=about, fontsize=8.5, color=FAINT, **place)

    time = np.asarray(recording["time"].values)
    stance = channel(recording, "stance")
    for axis, leg in zip(axes, legs, strict=True):
        name = plain(source.robot.legs[leg - 1].name).replace("_", " ")
        axis.set_title(f"Leg {leg}, {name}", color=leg_colour(leg - 1))
        axis.set_ylabel(unit)
        for start, stop in [] if stance is None else intervals(stance[:, leg - 1]):
            until = time[min(stop, len(time) - 1)]
            axis.axvspan(time[start], until, color=STANCE_COLOUR, linewidth=0, zorder=0)
    axes[-1].set_xlabel("time [s]" + ("" if stance is None else "   (shaded: stance)"))
    if len(time) > 1:
        axes[-1].set_xlim(time[0], time[-1])
    figure.align_ylabels(axes)
    return figure, axes, time


def caption(recording: Recording, source: Source) -> str:
    """What was walking, and under which assumptions, on one line."""
    parts = [plain(source.robot.name), f"{plain(source.gait.name)} gait"]
    parts.append(drive_words(recording, source))
    forces = attribute(recording, "force_model")
    if forces and any(str(name).endswith("_model") for name in recording.data_vars):
        parts.append(f"model forces: {forces}")
    return " · ".join(parts)


def drive_words(recording: Recording, source: Source) -> str:
    """Which servo moved the joints, and how."""
    servo = attribute(recording, "servo") or plain(source.robot.servo.name)
    drive = attribute(recording, "drive")
    return f"servo {servo}, {drive} drive" if drive else f"servo {servo}"


def legend(figure: Figure, entries: list[tuple[str, str, Any]]) -> None:
    """Say under the title what each kind of line is: its label, colour and dash."""
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=colour, linestyle=dash, label=label, linewidth=1.6)
        for label, colour, dash in entries
    ]
    top = 1 - 0.43 / float(figure.get_figheight())
    figure.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(0.100, top),
        ncols=len(handles),
        columnspacing=1.4,
        borderaxespad=0.2,
    )
