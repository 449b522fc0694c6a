"""The sheet that all figures of runs are drawn on: a heading, a legend, and panels under them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

from phasmid.errors import plain
from phasmid.recording import Recording
from phasmid.reporting.source import Source, attribute
from phasmid.reporting.style import FAINT, Figure, shrunk, wrapped

if TYPE_CHECKING:
    import matplotlib.axes

Axes: TypeAlias = "matplotlib.axes.Axes"

WIDTH = 7.2
"""Of a sheet [inches]."""

LINE, LEGEND_LINE = 0.154, 0.175
"""Height of a line of the subtitle, and of the legend [inches]."""

LONGEST_NAME = 120
"""Letters of a name that a figure shows."""


@dataclass(frozen=True, eq=False)
class Sheet:
    """A figure with panels in rows and columns.

    Attributes:
        figure: All of it.
        axes: The panels, row by row from above.
        columns: Number of panels in a row.
        legend_top: Upper edge of the place for the legend, in heights of the figure.
        left: Left edge of the panels, in widths of the figure.
    """

    figure: Figure
    axes: list[Axes]
    columns: int
    legend_top: float
    left: float


def sheet(
    title: str,
    notes: Sequence[str],
    rows: Sequence[float],
    *,
    columns: int = 1,
    widths: Sequence[float] | None = None,
    share_x: bool = True,
    share_y: bool = True,
    legend_rows: int = 1,
    left: float = 0.108,
    right: float = 0.98,
    gap: float = 0.34,
    space: float = 0.2,
) -> Sheet:
    """An empty sheet with its heading.

    Args:
        title: What is drawn.
        notes: What the subtitle says, of whom and on which terms; empty ones are left out.
        rows: Height of each row of panels with the gap above it [inches].
        columns: Number of panels in a row.
        widths: Of the columns, relative to each other.
        share_x: Whether all panels have one horizontal axis.
        share_y: Whether all panels have one upright axis.
        legend_rows: Number of lines that the legend takes.
        left: Left edge of the panels, in widths of the figure.
        right: Right edge of the panels, in widths of the figure.
        gap: Between rows, in heights of a panel.
        space: Between columns, in widths of a panel.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as NewFigure

    from phasmid.reporting.axis import Panel

    figure = NewFigure(figsize=(WIDTH, 1.0))
    FigureCanvasAgg(figure)
    place: dict[str, Any] = {"x": left, "va": "top", "ha": "left"}
    subtitle = figure.text(y=0, s="", fontsize=8.5, color=FAINT, linespacing=1.3, **place)
    parts = [note for note in notes if note]
    width = (0.98 - left) * float(figure.bbox.width)
    more = LINE * (wrapped(subtitle, parts, width) - 1)
    below = more + LEGEND_LINE * (legend_rows - 1)
    height = 1.15 + below + sum(rows)
    figure.set_figheight(height)
    subtitle.set_y(1 - 0.33 / height)
    grid = figure.add_gridspec(
        len(rows),
        columns,
        left=left,
        right=right,
        top=1 - (0.88 + below) / height,
        bottom=0.47 / height,
        hspace=gap,
        wspace=space,
        height_ratios=list(rows),
        width_ratios=widths,
    )
    axes: list[Axes] = []
    for row in range(len(rows)):
        for column in range(columns):
            first = axes[0] if axes else None
            shared = {"sharex": first if share_x else None, "sharey": first if share_y else None}
            axes.append(figure.add_subplot(grid[row, column], axes_class=Panel, **shared))
            if share_x and row < len(rows) - 1:
                axes[-1].xaxis.set_tick_params(labelbottom=False)
            if share_y and column > 0:
                axes[-1].yaxis.set_tick_params(labelleft=False)
    figure.text(y=1 - 0.10 / height, s=title, fontsize=11.5, fontweight="bold", **place)
    return Sheet(figure, axes, columns, 1 - (0.43 + more) / height, left)


def name_row(axis: Axes, words: str) -> None:
    """Write what a row of panels is of over the title of its first one."""
    above: dict[str, Any] = {"xytext": (0, 15), "textcoords": "offset points"}
    text = axis.annotate(words, (0, 1), xycoords="axes fraction", fontsize=8.5, **above)
    shrunk(text, (0.98 - axis.get_position().x0) * float(axis.figure.bbox.width), least=6.0)


def caption(recording: Recording, source: Source) -> list[str]:
    """Who was walking, how."""
    names = [short(source.robot.name), f"{short(source.gait.name)} gait"]
    return [*names, drive_words(recording, source)]


def drive_words(recording: Recording, source: Source) -> str:
    """Which servo moved the joints, and how."""
    servo = short(attribute(recording, "servo") or source.robot.servo.name)
    drive = short(attribute(recording, "drive"))
    return f"servo {servo}, {drive} drive" if drive else f"servo {servo}"


def short(name: str) -> str:
    """A name on one line, cut off where it is endless."""
    name = plain(name)
    return name if len(name) <= LONGEST_NAME else f"{name[:LONGEST_NAME].rstrip()}…"


def legend(
    place: Sheet,
    entries: Sequence[tuple[str, str, Any]],
    *,
    columns: int = 0,
    width: float = 1.6,
) -> None:
    """Say under the title what each kind of line is: its label, colour and dash.

    Args:
        place: The sheet.
        entries: From left to right, then from above.
        columns: Entries in a line; all of them by default.
        width: Of the lines [pt].
    """
    columns = columns or len(entries)
    # Matplotlib fills a legend column by column.
    order = [entries[k] for c in range(columns) for k in range(c, len(entries), columns)]
    lines = [(*entry, width) for entry in order]
    x = place.left - 0.008
    figure_legend(place.figure, lines, top=place.legend_top, columns=columns, left=x)


def figure_legend(
    figure: Figure,
    entries: Sequence[tuple[str, str, Any, float]],
    *,
    top: float,
    columns: int,
    left: float = 0.100,
) -> None:
    """Say in a figure what each kind of line is.

    Args:
        figure: The figure.
        entries: Label, colour, dash and width of each kind.
        top: Upper edge, as a share of the figure's height.
        columns: Number of entries side by side.
        left: Left edge, as a share of the figure's width.
    """
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=colour, linestyle=dash, label=label, linewidth=width)
        for label, colour, dash, width in entries
    ]
    figure.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(left, top),
        ncols=columns,
        columnspacing=1.4,
        borderaxespad=0.2,
        labelspacing=0.3 if len(handles) > columns else 0.5,
    )
