"""The sheet that all figures of runs are drawn on: a heading, a legend, and panels under them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

from phasmid.errors import plain
from phasmid.recording import Recording
from phasmid.reporting.layout import layout, points
from phasmid.reporting.source import Source, attribute
from phasmid.reporting.style import FAINT, Figure, shrunk, text_width, wrapped

if TYPE_CHECKING:
    import matplotlib.axes

Axes: TypeAlias = "matplotlib.axes.Axes"

LINE, LEGEND_LINE = 0.154, 0.175
"""Height of a line of the subtitle, and of the legend [inches]."""

TITLE_TOP, SUBTITLE_TOP, LEGEND_TOP, PANELS_TOP = 0.10, 0.33, 0.43, 0.88
"""Upper edges below that of the sheet, with one line of subtitle and legend [inches]."""

FOOT, ABOVE_PANELS = 0.47, 0.20
"""Room for the lowest axis, and the gap above the uppermost row that its height counts [inches]."""

LONGEST_NAME = 120
"""Letters of a name that a figure shows."""


@dataclass(eq=False)
class Sheet:
    """A figure with panels in rows and columns under a heading.

    Attributes:
        figure: All of it.
        axes: The panels, row by row from above.
        columns: Number of panels in a row.
        left: Left edge of the panels, in widths of the figure.
        panels: Height of all rows [inches].
        subtitle_lines: Number of lines of the subtitle.
        legend_rows: Number of lines of the legend.
    """

    figure: Figure
    axes: list[Axes]
    columns: int
    left: float
    panels: float
    subtitle_lines: int
    legend_rows: int

    def place(self) -> float:
        """Put heading and panels at their heights; returns the upper edge of the legend.

        The edge is a share of the figure's height.
        """
        scale, titled = layout().type_scale, layout().title
        # Without words the legend comes to the upper edge.
        heading = scale * (LINE * (self.subtitle_lines - 1) if titled else 0.06 - LEGEND_TOP)
        top = scale * PANELS_TOP + heading + scale * LEGEND_LINE * (self.legend_rows - 1)
        bottom = scale * FOOT
        height = top + bottom + self.panels - scale * ABOVE_PANELS
        self.figure.set_figheight(height)
        self.figure.subplots_adjust(top=1 - top / height, bottom=bottom / height)
        edges = (TITLE_TOP, SUBTITLE_TOP) if titled else ()
        for text, edge in zip(self.figure.texts, edges, strict=False):
            text.set_y(1 - scale * edge / height)
        return 1 - (scale * LEGEND_TOP + heading) / height


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

    page = layout()
    figure = NewFigure(figsize=(page.width, 1.0))
    FigureCanvasAgg(figure)
    left, right = page.margin_scale * left, 1 - page.margin_scale * (1 - right)
    lines = 1
    if page.title:
        edge: dict[str, Any] = {"x": left, "y": 0, "va": "top", "ha": "left"}
        width = (0.98 - left) * float(figure.bbox.width)
        heading = figure.text(s=title, fontsize=points(11.5), fontweight="bold", **edge)
        shrunk(heading, width, least=points(8.5))
        subtitle = figure.text(s="", fontsize=points(8.5), color=FAINT, linespacing=1.3, **edge)
        lines = wrapped(subtitle, [note for note in notes if note], width)
    figure.subplots_adjust(
        left=left, right=right, hspace=gap, wspace=min(page.margin_scale * space, 1.0)
    )
    grid = figure.add_gridspec(len(rows), columns, height_ratios=list(rows), width_ratios=widths)
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
    drawing = Sheet(figure, axes, columns, left, sum(rows), lines, legend_rows)
    drawing.place()
    if page.is_narrow:
        # Labels of ticks are as wide as ever.
        for axis in axes:
            count = max(2, int(axis.get_position().width * page.width / 0.3))
            axis.locator_params(axis="x", nbins=count, steps=[1, 2, 5, 10])
    return drawing


def name_row(axis: Axes, words: str) -> None:
    """Write what a row of panels is of over the title of its first one."""
    above: dict[str, Any] = {"xytext": (0, 15), "textcoords": "offset points"}
    text = axis.annotate(words, (0, 1), xycoords="axes fraction", fontsize=points(8.5), **above)
    shrunk(text, (0.98 - axis.get_position().x0) * float(axis.figure.bbox.width), least=points(6.0))


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
    widths: Sequence[float] = (),
) -> None:
    """Say under the title what each kind of line is: its label, colour and dash.

    Args:
        place: The sheet.
        entries: From left to right, then from above.
        columns: Entries in a line; all of them by default.
        width: Of the lines [pt].
        widths: Of each line, where they differ [pt].
    """
    columns = _fitting_columns(place, entries, columns or len(entries))
    place.legend_rows = max(place.legend_rows, -(-len(entries) // columns))
    # Matplotlib fills a legend column by column.
    order = [k for c in range(columns) for k in range(c, len(entries), columns)]
    lines = [(*entries[k], widths[k] if widths else width) for k in order]
    x = place.left - 0.008 * layout().margin_scale
    figure_legend(place.figure, lines, top=place.place(), columns=columns, left=x)


def _fitting_columns(place: Sheet, entries: Sequence[tuple[str, str, Any]], columns: int) -> int:
    """Return how many entries fit side by side, at most some number of columns."""
    import matplotlib

    size = float(matplotlib.rcParams["legend.fontsize"])
    ruler = place.figure.text(0, 0, "", fontsize=size)
    pixel = size * float(place.figure.dpi) / 72
    # Handle, its gap and the gap between columns, in sizes of the type.
    widths = [text_width(ruler, name) + (2.2 + 0.8 + 1.4) * pixel for name, _, _ in entries]
    ruler.remove()
    # No gap follows the last column.
    room = (0.99 - place.left) * float(place.figure.bbox.width) + 1.4 * pixel
    while columns > 1:
        widest = [max(widths[k::columns], default=0.0) for k in range(columns)]
        if sum(widest) <= room:
            break
        columns -= 1
    return columns


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
