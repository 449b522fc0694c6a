"""What the figures share: a panel per leg, its stance shaded, and who walked under which terms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from phasmid.errors import InvalidInput, plain
from phasmid.recording import Recording
from phasmid.reporting.source import Source, attribute, channel, read_source
from phasmid.reporting.steps import intervals
from phasmid.reporting.style import FAINT, Figure, shrunk, wrapped

if TYPE_CHECKING:
    import matplotlib.axes

Axes: TypeAlias = "matplotlib.axes.Axes"

STANCE_COLOUR = "#eef1f5"

LONGEST_NAME = 120
"""Letters of a name that a figure shows."""

MOST_CYCLES, LAST_CYCLES = 6, 5
"""Of a walk of more cycles than the first, only so many of the last are drawn: more make a comb."""


@dataclass(frozen=True, eq=False)
class Panels:
    """A figure with one panel per leg.

    Attributes:
        figure: All of it.
        axes: The panels, from above.
        legend_top: Upper edge of the place for the legend, in heights of the figure.
    """

    figure: Figure
    axes: list[Axes]
    legend_top: float


def shown_part(recording: Recording) -> tuple[Recording, str]:
    """The part of a recording that figures over time show, and what to say of it.

    All of a walk of at most `MOST_CYCLES` cycles, and then nothing is said; else the last ones.
    """
    time = np.asarray(recording["time"].values)
    period = read_source(recording).scenario.stride.period
    cycles = float(time[-1] - time[0]) / period
    if cycles <= MOST_CYCLES + 1e-6:
        return recording, ""
    first = int(np.searchsorted(time, time[-1] - LAST_CYCLES * period - 1e-9))
    return recording.isel(time=slice(first, None)), f"last {LAST_CYCLES} of {cycles:.4g} cycles"


def panels(
    recording: Recording, legs: tuple[int, ...], what: str, unit: str, notes: Sequence[str] = ()
) -> Panels:
    """A figure with one panel per leg, its stance shaded.

    Args:
        recording: Of which all is shown.
        legs: Their numbers, from 1.
        what: What is drawn, for the title.
        unit: Label of the panels' upright axis.
        notes: What the subtitle says besides who walked how; empty ones are left out.

    Raises:
        InvalidInput: There is no such leg.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as NewFigure

    source = read_source(recording)
    count = len(source.robot.legs)
    for leg in legs:
        if not 1 <= leg <= count:
            raise InvalidInput(f"there is no leg {leg}; legs are 1 to {count}.")
    figure = NewFigure(figsize=(7.2, 1.0))
    FigureCanvasAgg(figure)
    place: dict[str, Any] = {"x": 0.108, "va": "top", "ha": "left"}
    parts = [*_caption(recording, source), *(note for note in notes if note)]
    subtitle = figure.text(y=0, s="", fontsize=8.5, color=FAINT, linespacing=1.3, **place)
    # Height of the subtitle's lines after the first.
    more = 0.154 * (wrapped(subtitle, parts, 0.872 * float(figure.bbox.width)) - 1)
    height = 1.15 + more + 1.65 * len(legs)
    figure.set_figheight(height)
    subtitle.set_y(1 - 0.33 / height)
    grid = figure.subplots(len(legs), 1, sharex=True, sharey=True, squeeze=False)
    figure.subplots_adjust(
        left=0.108, right=0.98, top=1 - (0.88 + more) / height, bottom=0.47 / height, hspace=0.34
    )
    axes: list[Axes] = list(grid[:, 0])
    listed = ", ".join(map(str, legs[:-1])) + (" and " if legs[1:] else "") + str(legs[-1])
    title = f"{what} of leg{'s' if legs[1:] else ''} {listed}"
    figure.text(y=1 - 0.10 / height, s=title, fontsize=11.5, fontweight="bold", **place)

    time = np.asarray(recording["time"].values)
    stance = channel(recording, "stance")
    for axis, leg in zip(axes, legs, strict=True):
        name = short(source.robot.legs[leg - 1].name).replace("_", " ")
        shrunk(axis.set_title(f"Leg {leg}, {name}"), axis.bbox.width, least=7.0)
        axis.set_ylabel(unit)
        for start, stop in [] if stance is None else intervals(stance[:, leg - 1]):
            until = time[min(stop, len(time) - 1)]
            axis.axvspan(time[start], until, color=STANCE_COLOUR, linewidth=0, zorder=0)
    axes[-1].set_xlabel("time [s]" + ("" if stance is None else "   (shaded: stance)"))
    if len(time) > 1:
        axes[-1].set_xlim(time[0], time[-1])
    figure.align_ylabels(axes)
    return Panels(figure, axes, 1 - (0.43 + more) / height)


def _caption(recording: Recording, source: Source) -> list[str]:
    """What was walking, how."""
    names = [short(source.robot.name), f"{short(source.gait.name)} gait"]
    return [*names, drive_words(recording, source)]


def model_words(recording: Recording) -> str:
    """How the model shares the load among the feet, if the recording says so."""
    forces = short(attribute(recording, "force_model"))
    known = forces and any(str(name).endswith("_model") for name in recording.data_vars)
    return f"model forces: {forces}" if known else ""


def short(name: str) -> str:
    """A name on one line, cut off where it is endless."""
    name = plain(name)
    return name if len(name) <= LONGEST_NAME else f"{name[:LONGEST_NAME].rstrip()}…"


def drive_words(recording: Recording, source: Source) -> str:
    """Which servo moved the joints, and how."""
    servo = short(attribute(recording, "servo") or source.robot.servo.name)
    drive = short(attribute(recording, "drive"))
    return f"servo {servo}, {drive} drive" if drive else f"servo {servo}"


def legend(panel: Panels, entries: list[tuple[str, str, Any]]) -> None:
    """Say under the title what each kind of line is: its label, colour and dash."""
    lines = [(*entry, 1.6) for entry in entries]
    figure_legend(panel.figure, lines, top=panel.legend_top, columns=len(lines))


def figure_legend(
    figure: Figure, entries: list[tuple[str, str, Any, float]], *, top: float, columns: int
) -> None:
    """Say in a figure what each kind of line is.

    Args:
        figure: The figure.
        entries: Label, colour, dash and width of each kind.
        top: Upper edge, as a share of the figure's height.
        columns: Number of entries side by side.
    """
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=colour, linestyle=dash, label=label, linewidth=width)
        for label, colour, dash, width in entries
    ]
    figure.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(0.100, top),
        ncols=columns,
        columnspacing=1.4,
        borderaxespad=0.2,
    )
