"""The common layout of the figures: a heading, a legend, and panels under them."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from phasmid.reporting.steps import intervals
from phasmid.reporting.style import FAINT, FONT_SIZE, Figure, Layout, new_figure

if TYPE_CHECKING:
    import matplotlib.axes

Axes: TypeAlias = "matplotlib.axes.Axes"

Entry: TypeAlias = tuple[str, dict[str, Any]]
"""Label and line properties of a legend's entry."""

EDGE, TITLE, LINE, FOOT = 0.1, 0.24, 0.17, 0.5
"""Margin at the edges; height of the title, of a line under it, and of the lowest axis [inches]."""

ABOVE, BELOW, BESIDE, WITH_TICKS = 0.28, 0.42, 0.22, 0.6
"""Height of a panel's title and of its axis; gaps between columns that share their vertical axis,
and that do not [inches]."""

LETTER = 0.07
"""Mean width of a letter [inches]."""

NO_BREAK = "\N{NO-BREAK SPACE}"


class Panels:
    """A figure with empty panels; `complete` writes heading and legend above them.

    Margins and gaps are in inches, so that type fits them at any width of the figure.

    Args:
        layout: Width and heading.
        heights: Height of each row of panels, with their titles [inches].
        columns: Number of panels in a row.
        share_x: All panels share one horizontal axis.
        share_y: All panels share one vertical axis; ``"col"``, ``"row"``: those of each one.
        left: Width of the labels on the left [inches].

    Attributes:
        figure: The figure.
        axes: The panels, row by row from above.
        rows: The panels of each row.
    """

    def __init__(
        self,
        layout: Layout,
        heights: Sequence[float],
        *,
        columns: int = 1,
        share_x: bool = True,
        share_y: bool | Literal["col", "row"] = True,
        left: float = 0.8,
    ) -> None:
        self._layout, self._heights, self._left = layout, heights, left
        self._below = 0.0 if share_x else BELOW
        self._beside = BESIDE if share_y in (True, "row") else WITH_TICKS
        self.figure: Figure = new_figure(layout.inches, sum(heights))
        grid = self.figure.subplots(
            len(heights),
            columns,
            sharex=share_x,
            sharey=share_y,
            squeeze=False,
            height_ratios=list(heights),
        )
        self.rows: list[list[Axes]] = grid.tolist()
        self.axes: list[Axes] = grid.ravel().tolist()
        for axis in self.axes:
            axis.locator_params(axis="x", steps=[1, 2, 5, 10])
            # Ticks that are made when the figure is saved have this size too.
            axis.tick_params(labelsize=FONT_SIZE * layout.type_scale)

    def complete(
        self,
        title: str,
        notes: Sequence[str],
        entries: Sequence[Entry],
        columns: int = 0,
    ) -> Figure:
        """Write heading and legend, and return the figure in the height that it needs.

        Args:
            title: Title of the figure.
            notes: Parts of the subtitle; empty ones are left out.
            entries: Entries of the legend, from left to right, then from above.
            columns: Most entries side by side; by default all of them.
        """
        figure, scale, width = self.figure, self._layout.type_scale, self._layout.inches
        down, texts = EDGE, []
        if self._layout.title:
            # Lines break between notes.
            notes = [note.replace(" ", NO_BREAK) for note in [*notes, self._layout.note] if note]
            words = f"{NO_BREAK}· ".join(notes)
            lines = textwrap.wrap(words, int((width - 2 * EDGE) / (LETTER * scale)))
            heading = figure.text(0, 0, title, fontsize="large", fontweight="bold")
            subtitle = figure.text(0, 0, "\n".join(lines), color=FAINT, linespacing=1.15)
            subtitle.set_text(subtitle.get_text().replace(NO_BREAK, " "))
            texts = [(heading, down), (subtitle, down + scale * TITLE)]
            down += scale * (TITLE + LINE * len(lines)) + 0.03
        # No label is wider than the panels.
        letters = int((width - 2 * EDGE - scale * self._left) / (1.15 * LETTER * scale))
        entries = [(textwrap.shorten(w, letters, placeholder=" …"), look) for w, look in entries]
        legend, rows = _fitting_legend(figure, entries, columns or len(entries))
        top = down + scale * (LINE * rows + ABOVE)
        height = top + sum(self._heights) + scale * (FOOT - ABOVE)
        figure.set_figheight(height)
        for text, place in texts:
            text.set(x=EDGE / width, y=1 - place / height, verticalalignment="top")
        legend.set_bbox_to_anchor((EDGE / width, 1 - down / height))
        self._place(top, height)
        figure.align_ylabels(self.axes)
        return figure

    def _place(self, top: float, height: float) -> None:
        """Place the panels below a distance from the upper edge of the figure [inches]."""
        scale, width = self._layout.type_scale, self._layout.inches
        rows, columns = len(self.rows), len(self.rows[0])
        above, beside = scale * (ABOVE + self._below), scale * self._beside
        left, right = scale * self._left, width - 2 * EDGE
        self.figure.subplots_adjust(
            left=left / width,
            right=right / width,
            bottom=scale * FOOT / height,
            top=1 - top / height,
            hspace=above * rows / (sum(self._heights) - rows * above),
            wspace=beside * columns / (right - left - (columns - 1) * beside),
        )


def _fitting_legend(figure: Figure, entries: Sequence[Entry], columns: int) -> tuple[Any, int]:
    """Return a legend of at most so many columns that fits the figure, and its number of rows."""
    from matplotlib.lines import Line2D

    # Matplotlib fills a legend column by column.
    order = [k for c in range(columns) for k in range(c, len(entries), columns)]
    legend = figure.legend(
        handles=[Line2D([], [], label=entries[k][0], **entries[k][1]) for k in order],
        ncols=columns,
        loc="upper left",
        columnspacing=1.4,
        labelspacing=0.35,
        borderaxespad=0,
        borderpad=0,
    )
    if columns > 1 and legend.get_window_extent().width > figure.bbox.width - 2 * EDGE * figure.dpi:
        legend.remove()
        return _fitting_legend(figure, entries, columns - 1)
    return legend, -(-len(entries) // columns)


def listed_legs(legs: Sequence[int]) -> str:
    """Return legs in words, such as ``legs 1, 2 and 3`` or ``legs 1 to 6``."""
    if len(legs) > 3 and list(legs) == list(range(legs[0], legs[-1] + 1)):
        return f"legs {legs[0]} to {legs[-1]}"
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
