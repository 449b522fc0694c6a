"""The common layout of the figures: a heading, a legend, and panels under them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from phasmid.reporting.steps import intervals
from phasmid.reporting.style import FAINT, Figure, layout, new_figure, points, shrink, wrap

if TYPE_CHECKING:
    import matplotlib.axes

Axes: TypeAlias = "matplotlib.axes.Axes"

Entry: TypeAlias = tuple[str, dict[str, Any]]
"""Label and line properties of a legend's entry."""

LINE, LEGEND_LINE = 0.154, 0.175
"""Height of a line of the subtitle, and of the legend [inches]."""

TITLE_TOP, SUBTITLE_TOP, LEGEND_TOP, PANELS_TOP = 0.10, 0.33, 0.43, 0.88
"""Distances from the upper edge, with one line of subtitle and of legend [inches]."""

FOOT, ABOVE_PANELS = 0.47, 0.20
"""Space for the lowest axis, and the gap above the first row that its height includes [inches]."""


class Panels:
    """A figure with empty panels under a heading; `add_legend` completes it.

    Args:
        title: Title of the figure.
        notes: Parts of the subtitle; empty ones are left out.
        heights: Height of each row of panels with the gap above it [inches].
        columns: Number of panels in a row.
        share_x: All panels share one horizontal axis.
        share_y: All panels share one vertical axis; ``"col"``: those of a column.
        left: Left edge of the panels [widths of the figure].
        right: Right edge of the panels [widths of the figure].
        gap: Gap between rows [heights of a panel].
        space: Gap between columns [widths of a panel].

    Attributes:
        figure: The figure.
        axes: The panels, row by row from above.
        rows: The panels of each row.
    """

    def __init__(
        self,
        title: str,
        notes: Sequence[str],
        heights: Sequence[float],
        *,
        columns: int = 1,
        share_x: bool = True,
        share_y: bool | Literal["col"] = True,
        left: float = 0.108,
        right: float = 0.98,
        gap: float = 0.34,
        space: float = 0.2,
    ) -> None:
        page = layout()
        self.figure: Figure = new_figure(page.width, 1.0)
        left, right = page.margin_scale * left, 1 - page.margin_scale * (1 - right)
        self._left, self._height, self._lines = left, sum(heights), 1
        if page.title:
            edge: dict[str, Any] = {"x": left, "y": 0, "va": "top", "ha": "left"}
            width = (0.98 - left) * float(self.figure.bbox.width)
            heading = self.figure.text(s=title, fontsize=points(11.5), fontweight="bold", **edge)
            shrink(heading, width, least=points(8.5))
            look = edge | {"fontsize": points(8.5), "color": FAINT, "linespacing": 1.3}
            subtitle = self.figure.text(s="", **look)
            self._lines = wrap(subtitle, [note for note in notes if note], width)
        gaps = {"hspace": gap, "wspace": min(page.margin_scale * space, 1.0)}
        grid = self.figure.subplots(
            len(heights),
            columns,
            sharex=share_x,
            sharey=share_y,
            squeeze=False,
            height_ratios=list(heights),
            gridspec_kw={"left": left, "right": right, **gaps},
        )
        self.rows: list[list[Axes]] = grid.tolist()
        self.axes: list[Axes] = grid.ravel().tolist()
        if page.is_narrow:
            # Tick labels keep their width.
            for axis in self.axes:
                count = max(2, int(axis.get_position().width * page.width / 0.3))
                axis.locator_params(axis="x", nbins=count, steps=[1, 2, 5, 10])

    def add_legend(
        self, entries: Sequence[Entry], columns: int = 0, lines_below: int = 0
    ) -> Figure:
        """Draw the legend, and return the figure in the height that it needs.

        Args:
            entries: From left to right, then from above.
            columns: Most entries side by side; by default all of them.
            lines_below: Empty lines between the legend and the panels.
        """
        from matplotlib.lines import Line2D

        columns = columns or len(entries)
        width = (0.99 - self._left) * float(self.figure.bbox.width)
        edge = self._left - 0.008 * layout().margin_scale
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
        return self.figure

    def _place(self, legend_rows: int) -> float:
        """Place heading and panels; return the upper edge of the legend [heights of the figure]."""
        scale, titled = layout().type_scale, layout().title
        # Without a title the legend moves to the upper edge.
        heading = scale * (LINE * (self._lines - 1) if titled else 0.06 - LEGEND_TOP)
        top = scale * PANELS_TOP + heading + scale * LEGEND_LINE * (legend_rows - 1)
        height = top + scale * FOOT + self._height - scale * ABOVE_PANELS
        self.figure.set_figheight(height)
        self.figure.subplots_adjust(top=1 - top / height, bottom=scale * FOOT / height)
        for text, edge in zip(self.figure.texts, (TITLE_TOP, SUBTITLE_TOP), strict=False):
            text.set_y(1 - scale * edge / height)
        return 1 - (scale * LEGEND_TOP + heading) / height


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


def name_panel(axis: Axes, words: str, size: float = 9.5) -> None:
    """Write a panel's title, at most of a size [pt] and small enough for its width."""
    title = axis.set_title(words, fontsize=points(size))
    shrink(title, float(axis.bbox.width), least=points(6.5))


def listed_legs(legs: Sequence[int]) -> str:
    """Return legs in words, such as ``legs 1, 2 and 3``."""
    numbers = ", ".join(map(str, legs[:-1])) + (" and " if legs[1:] else "") + str(legs[-1])
    return f"leg{'s' if legs[1:] else ''} {numbers}"


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
    """Label a panel's time axis, limit it to the samples, and note the meaning of a shade."""
    axis.set_xlabel("time [s]" + (f"   ({note})" if note else ""))
    if len(time) > 1:
        axis.set_xlim(time[0], time[-1])
