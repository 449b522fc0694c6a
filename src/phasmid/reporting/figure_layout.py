"""The common layout of the figures: a heading, a legend, and panels under them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from phasmid.errors import InvalidInput, plain
from phasmid.reporting.layout import layout, points
from phasmid.reporting.source import Source, attribute
from phasmid.reporting.steps import intervals
from phasmid.reporting.style import FAINT, Figure, new_figure, shrink, wrap

if TYPE_CHECKING:
    import matplotlib.axes

    from phasmid.recording import Recording

Axes: TypeAlias = "matplotlib.axes.Axes"

Entry: TypeAlias = tuple[str, dict[str, Any]]
"""Label and line properties of a legend's entry."""

LINE, LEGEND_LINE = 0.154, 0.175
"""Height of a line of the subtitle, and of the legend [inches]."""

TITLE_TOP, SUBTITLE_TOP, LEGEND_TOP, PANELS_TOP = 0.10, 0.33, 0.43, 0.88
"""Distances from the upper edge, with one line of subtitle and of legend [inches]."""

FOOT, ABOVE_PANELS = 0.47, 0.20
"""Space for the lowest axis, and the gap above the first row that its height includes [inches]."""

LONGEST_NAME = 80
"""Longest name that a figure shows [characters]."""


@dataclass(eq=False)
class PanelFigure:
    """A figure with panels in rows and columns.

    Attributes:
        figure: The figure.
        axes: The panels, row by row from above.
        columns: Number of panels in a row.
        left: Left edge of the panels [widths of the figure].
        height: Height of all rows [inches].
        subtitle_lines: Number of lines of the subtitle.
    """

    figure: Figure
    axes: list[Axes]
    columns: int
    left: float
    height: float
    subtitle_lines: int

    def rows(self) -> list[list[Axes]]:
        """Return the panels of each row."""
        n = self.columns
        return [self.axes[k : k + n] for k in range(0, len(self.axes), n)]

    def add_legend(self, entries: Sequence[Entry], columns: int = 0, lines_below: int = 0) -> None:
        """Draw the legend, and give the figure the height that it needs.

        Args:
            entries: From left to right, then from above.
            columns: Most entries side by side; by default all of them.
            lines_below: Empty lines between the legend and the panels.
        """
        from matplotlib.lines import Line2D

        columns = columns or len(entries)
        width = (0.99 - self.left) * float(self.figure.bbox.width)
        edge = self.left - 0.008 * layout().margin_scale
        while True:
            # Matplotlib fills a legend column by column.
            order = [k for c in range(columns) for k in range(c, len(entries), columns)]
            handles = [Line2D([], [], label=entries[k][0], **entries[k][1]) for k in order]
            legend = figure_legend(self.figure, handles, columns, left=edge)
            if columns == 1 or legend.get_window_extent().width <= width:
                break
            legend.remove()
            columns -= 1
        top = self._place(-(-len(entries) // columns) + lines_below)
        legend.set_bbox_to_anchor((edge, top))

    def _place(self, legend_rows: int) -> float:
        """Place heading and panels; return the upper edge of the legend [heights of the figure]."""
        scale, titled = layout().type_scale, layout().title
        # Without a title the legend moves to the upper edge.
        heading = scale * (LINE * (self.subtitle_lines - 1) if titled else 0.06 - LEGEND_TOP)
        top = scale * PANELS_TOP + heading + scale * LEGEND_LINE * (legend_rows - 1)
        height = top + scale * FOOT + self.height - scale * ABOVE_PANELS
        self.figure.set_figheight(height)
        self.figure.subplots_adjust(top=1 - top / height, bottom=scale * FOOT / height)
        edges = (TITLE_TOP, SUBTITLE_TOP) if titled else ()
        for text, edge in zip(self.figure.texts, edges, strict=False):
            text.set_y(1 - scale * edge / height)
        return 1 - (scale * LEGEND_TOP + heading) / height


def panel_figure(
    title: str,
    notes: Sequence[str],
    rows: Sequence[float],
    *,
    columns: int = 1,
    share_x: bool = True,
    share_y: bool | Literal["col"] = True,
    left: float = 0.108,
    right: float = 0.98,
    gap: float = 0.34,
    space: float = 0.2,
) -> PanelFigure:
    """Return empty panels under a heading; `PanelFigure.add_legend` completes them.

    Args:
        title: Title of the figure.
        notes: Parts of the subtitle; empty ones are left out.
        rows: Height of each row of panels with the gap above it [inches].
        columns: Number of panels in a row.
        share_x: All panels share one horizontal axis.
        share_y: All panels share one vertical axis; ``"col"``: those of a column.
        left: Left edge of the panels [widths of the figure].
        right: Right edge of the panels [widths of the figure].
        gap: Gap between rows [heights of a panel].
        space: Gap between columns [widths of a panel].
    """
    page = layout()
    figure = new_figure(page.width, 1.0)
    left, right = page.margin_scale * left, 1 - page.margin_scale * (1 - right)
    lines = 1
    if page.title:
        edge: dict[str, Any] = {"x": left, "y": 0, "va": "top", "ha": "left"}
        width = (0.98 - left) * float(figure.bbox.width)
        heading = figure.text(s=title, fontsize=points(11.5), fontweight="bold", **edge)
        shrink(heading, width, least=points(8.5))
        subtitle = figure.text(s="", fontsize=points(8.5), color=FAINT, linespacing=1.3, **edge)
        lines = wrap(subtitle, [note for note in notes if note], width)
    axes = figure.subplots(
        len(rows),
        columns,
        sharex=share_x,
        sharey=share_y,
        squeeze=False,
        height_ratios=list(rows),
        gridspec_kw={
            "left": left,
            "right": right,
            "hspace": gap,
            "wspace": min(page.margin_scale * space, 1.0),
        },
    ).ravel()
    if page.is_narrow:
        # Tick labels keep their width.
        for axis in axes:
            count = max(2, int(axis.get_position().width * page.width / 0.3))
            axis.locator_params(axis="x", nbins=count, steps=[1, 2, 5, 10])
    return PanelFigure(figure, list(axes), columns, left, sum(rows), lines)


def figure_legend(
    figure: Figure, handles: Sequence[Any], columns: int, *, left: float, top: float = 1.0
) -> Any:
    """Add a legend to a figure, and return it.

    Args:
        figure: The figure.
        handles: Labelled lines, column by column.
        columns: Number of entries side by side.
        left: Left edge [widths of the figure].
        top: Upper edge [heights of the figure].
    """
    return figure.legend(
        handles=list(handles),
        loc="upper left",
        bbox_to_anchor=(left, top),
        ncols=columns,
        columnspacing=1.4,
        borderaxespad=0.2,
        labelspacing=0.3 if len(handles) > columns else 0.5,
    )


def name_row(axis: Axes, words: str) -> None:
    """Write words above the title of the first panel of a row."""
    above: dict[str, Any] = {"xytext": (0, 15), "textcoords": "offset points"}
    text = axis.annotate(words, (0, 1), xycoords="axes fraction", fontsize=points(8.5), **above)
    shrink(text, (0.98 - axis.get_position().x0) * float(axis.figure.bbox.width), least=points(6.0))


def name_panel(axis: Axes, words: str, size: float | None = None) -> None:
    """Write a panel's title, small enough for its width.

    Args:
        axis: The panel.
        words: Its title.
        size: Size of type at the normal width [pt]; by default the style's.
    """
    title = axis.set_title(words)
    if size is not None:
        title.set_fontsize(points(size))
    shrink(title, float(axis.bbox.width), least=points(6.5))


def caption(recording: Recording, source: Source) -> list[str]:
    """Return robot, gait and drive, for a subtitle."""
    names = [short(source.robot.name), f"{short(source.gait.name)} gait"]
    return [*names, drive_words(recording, source)]


def drive_words(recording: Recording, source: Source) -> str:
    """Return servo and drive in words."""
    servo = short(attribute(recording, "servo") or source.robot.servo.name)
    drive = short(attribute(recording, "drive"))
    return f"servo {servo}, {drive} drive" if drive else f"servo {servo}"


def model_words(recording: Recording) -> str:
    """Return how the model shares the load among the feet; empty where it is not recorded."""
    forces = short(attribute(recording, "force_model"))
    known = forces and any(str(name).endswith("_model") for name in recording.data_vars)
    return f"model forces: {forces}" if known else ""


def short(name: str) -> str:
    """Return a name on one line, cut off at `LONGEST_NAME`."""
    name = plain(name)
    return name if len(name) <= LONGEST_NAME else f"{name[:LONGEST_NAME].rstrip()}…"


def check_legs(legs: Sequence[int], source: Source) -> None:
    """Raise InvalidInput for leg numbers outside the robot's."""
    count = len(source.robot.legs)
    for leg in legs:
        if not 1 <= leg <= count:
            raise InvalidInput(f"there is no leg {leg}; legs are 1 to {count}.")


def listed_legs(legs: Sequence[int]) -> str:
    """Return legs in words, such as ``legs 1, 2 and 3``."""
    numbers = ", ".join(map(str, legs[:-1])) + (" and " if legs[1:] else "") + str(legs[-1])
    return f"leg{'s' if legs[1:] else ''} {numbers}"


def leg_name(source: Source, leg: int) -> str:
    """Return a leg's number, from 1, and name, such as ``2 right middle``."""
    return f"{leg} {short(source.robot.legs[leg - 1].name).replace('_', ' ')}"


def leg_title(source: Source, leg: int) -> str:
    """Return the title of a leg's panel, such as ``Leg 2, right middle``."""
    number, name = leg_name(source, leg).split(" ", 1)
    return f"Leg {number}, {name}"


def shade(axis: Axes, time: np.ndarray, where: np.ndarray, colour: str) -> None:
    """Shade a panel over its height, behind its lines.

    Args:
        axis: The panel.
        time: Times of the samples [s], shape (N,).
        where: Samples that are shaded, each until the next one, shape (N,).
        colour: Colour of the shade.
    """
    upright = axis.get_xaxis_transform()
    bars = spans(time, where)
    axis.broken_barh(bars, (0, 1), color=colour, linewidth=0, zorder=0, transform=upright)


def spans(time: np.ndarray, where: np.ndarray) -> list[tuple[float, float]]:
    """Return start and length [s] of each run of true samples, each lasting until the next one."""
    last = len(time) - 1
    return [
        (float(time[start]), float(time[min(stop, last)] - time[start]))
        for start, stop in intervals(where)
    ]


def time_axis(axis: Axes, time: np.ndarray, note: str = "") -> None:
    """Label a panel's time axis, and limit it to the samples.

    Args:
        axis: The panel.
        time: Times of the samples [s], shape (N,).
        note: Meaning of a shade; empty without one.
    """
    axis.set_xlabel("time [s]" + (f"   ({note})" if note else ""))
    if len(time) > 1:
        axis.set_xlim(time[0], time[-1])
