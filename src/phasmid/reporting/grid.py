"""Grid and ticks of a panel's axis that has no words, in two strokes."""

from __future__ import annotations

from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.markers import TICKDOWN, TICKLEFT
from matplotlib.patches import PathPatch
from matplotlib.path import Path


class Grid(Artist):
    """What an axis draws but for its words, for as long as the axis itself is hidden.

    Of panels that share an axis only the outer ones have words. Matplotlib makes five artists of
    every tick of every panel, half a figure's time, where a path and a row of markers do.

    Args:
        axes: The panel.
        name: Of its axis, ``x`` or ``y``, which is hidden.
    """

    def __init__(self, axes: Axes, name: str) -> None:
        super().__init__()
        self.axes = axes
        self._upright = name == "x"
        self._axis: Any = axes.xaxis if self._upright else axes.yaxis
        self._axis.set_visible(False)
        self.set_zorder(self._axis.get_zorder())
        settings: Any = matplotlib.rcParams
        across = axes.get_xaxis_transform if self._upright else axes.get_yaxis_transform
        self._lines = PathPatch(
            Path(np.zeros((0, 2))),
            transform=across("grid"),
            fill=False,
            edgecolor=settings["grid.color"],
            linewidth=settings["grid.linewidth"],
            capstyle=settings["lines.solid_capstyle"],
        )
        mark: Any = TICKDOWN if self._upright else TICKLEFT
        self._ticks = Line2D(
            [],
            [],
            transform=across("tick1"),
            linestyle="none",
            marker=mark,
            color=settings[f"{name}tick.color"],
            markersize=settings[f"{name}tick.major.size"],
            markeredgewidth=settings[f"{name}tick.major.width"],
        )
        axes.add_artist(self)
        for artist in (self._lines, self._ticks):
            artist.set_figure(axes.figure)
            artist.axes = axes
        self._lines.set_clip_path(axes.patch)

    def draw(self, renderer: Any) -> None:
        """Draw where the axis has ticks now."""
        if self._axis.get_visible() or not self.get_visible():
            return
        low, high = sorted(self._axis.get_view_interval())
        slack = 1e-9 * (high - low)
        places = np.asarray(self._axis.get_majorticklocs(), dtype=float)
        places = places[(places >= low - slack) & (places <= high + slack)]
        ends = np.column_stack([np.repeat(places, 2), np.tile([0.0, 1.0], len(places))])
        codes = np.tile(np.array([Path.MOVETO, Path.LINETO]), len(places))
        feet = np.zeros_like(places)
        self._lines.set_path(Path(ends if self._upright else ends[:, ::-1], codes))
        self._ticks.set_data(*((places, feet) if self._upright else (feet, places)))
        self._lines.draw(renderer)
        self._ticks.draw(renderer)
        self.stale = False
