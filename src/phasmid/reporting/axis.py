"""Panels whose axes are drawn in a few strokes."""

from __future__ import annotations

from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import allow_rasterization
from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis, YAxis
from matplotlib.lines import Line2D
from matplotlib.markers import TICKDOWN, TICKLEFT
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.ticker import NullLocator
from matplotlib.transforms import Bbox

from phasmid.reporting.style import text_width

SIMPLE, ABSENT = {"gridOn", "tick1On", "label1On"}, {"tick2On", "label2On"}
"""What may be chosen of ticks that are drawn in a few strokes, and what they have not."""

USUAL = ("outward", 0.0)
"""Where a spine is of which nobody has said anything."""

MOST_WORDS = 4096
"""Of one look, whose layouts are kept."""


LAYOUTS: dict[Any, dict[Any, Any]] = {}
"""How words are laid out, by how they look, then by what they are and where they are drawn."""


class _Word(Text):
    """What is written at ticks, of which many say the same: each word is laid out once."""

    def __init__(self, layouts: dict[Any, Any], **settings: Any) -> None:
        super().__init__(**settings)
        self._layouts = layouts

    def _get_layout(self, renderer: Any) -> Any:
        # What draws both lines and pixels measures like that of the two that it uses.
        kind = type(getattr(renderer, "_renderer", renderer))
        key = (self.get_text(), kind, renderer.points_to_pixels(1.0))
        if key not in self._layouts:
            if len(self._layouts) >= MOST_WORDS:
                self._layouts.clear()
            parent: Any = super()
            self._layouts[key] = parent._get_layout(renderer)
        return self._layouts[key]


class _Strokes(Axis):
    """An axis that looks as matplotlib's own does.

    Matplotlib makes five artists of every tick, a third of a figure's time, where a path for the
    grid, a row of markers and one text that is drawn at each place do. Where somebody asks for the
    ticks themselves, or for more than `SIMPLE`, all is done by matplotlib.
    """

    majorTicks: list[Any]
    minorTicks: list[Any]
    axis_name: str
    # Matplotlib's own, of which its types do not tell.
    _major_tick_kw: dict[str, Any]
    _update_label_position: Any
    _update_offset_text_position: Any

    def __init__(self, axes: Axes, **settings: Any) -> None:
        super().__init__(axes, **settings)
        self.reset_ticks()
        self._is_x = self.axis_name == "x"
        style: Any = matplotlib.rcParams
        name = f"{self.axis_name}tick"
        across = axes.get_xaxis_transform if self._is_x else axes.get_yaxis_transform
        self._lines = PathPatch(
            Path(np.zeros((0, 2))),
            transform=across("grid"),
            fill=False,
            edgecolor=style["grid.color"],
            linewidth=style["grid.linewidth"],
            capstyle=style["lines.solid_capstyle"],
        )
        size, pad = style[f"{name}.major.size"], style[f"{name}.major.pad"]
        mark: Any = TICKDOWN if self._is_x else TICKLEFT
        self._marks = Line2D(
            [],
            [],
            transform=across("tick1"),
            linestyle="none",
            marker=mark,
            color=style[f"{name}.color"],
            markersize=size,
            markeredgewidth=style[f"{name}.major.width"],
        )
        beside = axes.get_xaxis_text1_transform if self._is_x else axes.get_yaxis_text1_transform
        transform, upright, level = beside(size + pad)
        look = (upright, level, style[f"{name}.labelsize"], *style["font.sans-serif"])
        self._word = _Word(
            LAYOUTS.setdefault(look, {}),
            transform=transform,
            verticalalignment=upright,
            horizontalalignment=level,
            fontsize=style[f"{name}.labelsize"],
            color=style[f"{name}.labelcolor"],
        )
        for artist in (self._lines, self._marks, self._word):
            artist.set_figure(axes.figure)
            artist.axes = axes

    def reset_ticks(self) -> None:
        """Have no ticks; matplotlib has one at once."""
        self.majorTicks, self.minorTicks = [], []

    def set_clip_path(self, path: Any, transform: Any = None) -> None:
        """Keep the grid within a patch."""
        super().set_clip_path(path, transform)
        self._lines.set_clip_path(path, transform)

    def _get_tick(self, major: bool) -> Any:
        parent: Any = super()
        tick = parent._get_tick(major)
        tick.set_clip_path(self.axes.patch)
        return tick

    def get_major_ticks(self, numticks: int | None = None) -> list[Any]:
        """Make the ticks that somebody asks for, at their places."""
        is_new = not self.majorTicks
        ticks = super().get_major_ticks(numticks)
        if is_new and ticks:
            self._update_ticks()
        return ticks

    def _is_simple(self) -> bool:
        """Whether a few strokes show all that is to be seen."""
        return (
            not self.majorTicks
            and not self.minorTicks
            and isinstance(self.get_minor_locator(), NullLocator)
            and SIMPLE <= self._major_tick_kw.keys() <= SIMPLE | ABSENT
            and not any(self._major_tick_kw.get(name) for name in ABSENT)
            and self.axes.spines["bottom" if self._is_x else "left"].get_position() == USUAL
        )

    def _get_ticks_position(self) -> Any:
        if not self._is_simple():
            parent: Any = super()
            return parent._get_ticks_position()
        return (
            1 if self._major_tick_kw["tick1On"] and self._major_tick_kw["label1On"] else "unknown"
        )

    def _shown(self) -> tuple[np.ndarray, list[str]]:
        """Where there are ticks within the panel, and what is written at them."""
        places = np.asarray(self.get_majorticklocs(), dtype=float)
        words = [""] * len(places)
        if self._major_tick_kw["label1On"]:
            words = self.get_major_formatter().format_ticks(list(places))
        scale = self.get_transform()
        low, high = sorted(scale.transform(self.get_view_interval()))
        slack = 1e-10 * (high - low)
        at = scale.transform(places)
        inside = (at >= low - slack) & (at <= high + slack)
        return places[inside], [word for word, is_in in zip(words, inside, strict=True) if is_in]

    def _write(self, place: float, word: str) -> Text:
        """The text for all ticks, at one of them."""
        self._word.set_position((place, 0.0) if self._is_x else (0.0, place))
        self._word.set_text(word)
        return self._word

    def _update_ticks(self) -> list[Any]:
        parent: Any = super()
        return [] if self._is_simple() else list(parent._update_ticks())

    def _get_ticklabel_bboxes(
        self, ticks: list[Any], renderer: Any
    ) -> tuple[list[Bbox], list[Bbox]]:
        if not self._is_simple():
            parent: Any = super()
            first, second = parent._get_ticklabel_bboxes(ticks, renderer)
            return first, second
        places, words = self._shown()
        some = [k for k, word in enumerate(words) if word]
        if some and not any("\n" in word for word in words):
            # Of lines the first, the last and the widest reach as far as all do.
            widest = max(some, key=lambda k: text_width(self._word, words[k]))
            some = sorted({some[0], some[-1], widest})
        boxes = [self._write(places[k], words[k]).get_window_extent(renderer) for k in some]
        if len(places) and self._major_tick_kw["tick1On"]:
            # Without words labels keep clear of the marks; matplotlib gives them to the spine.
            boxes.append(self._reach())
        return boxes, []

    def _reach(self) -> Bbox:
        """How far the marks reach out of the panel."""
        panel = self.axes.bbox
        size = self._marks.get_markersize() * self.figure.dpi / 72
        if self._is_x:
            return Bbox([[panel.x0, panel.y0 - size], [panel.x1, panel.y0]])
        return Bbox([[panel.x0 - size, panel.y0], [panel.x0, panel.y1]])

    @allow_rasterization  # type: ignore[untyped-decorator]
    def draw(self, renderer: Any) -> None:
        """Draw grid, ticks, and what is written at them."""
        if not self._is_simple():
            super().draw(renderer)
            return
        if not self.get_visible():
            return
        renderer.open_group(__name__, gid=self.get_gid())
        places, words = self._shown()
        if self._major_tick_kw["gridOn"]:
            ends = np.column_stack([np.repeat(places, 2), np.tile([0.0, 1.0], len(places))])
            codes = np.tile(np.array([Path.MOVETO, Path.LINETO]), len(places))
            self._lines.set_path(Path(ends if self._is_x else ends[:, ::-1], codes))
            self._lines.draw(renderer)
        if self._major_tick_kw["tick1On"]:
            feet = np.zeros_like(places)
            self._marks.set_data(*((places, feet) if self._is_x else (feet, places)))
            self._marks.draw(renderer)
        for place, word in zip(places, words, strict=True):
            if word:
                self._write(place, word).draw(renderer)
        if self.label.get_text():
            self._update_label_position(renderer)
            self.label.draw(renderer)
        power = self.get_major_formatter().get_offset()
        self.offsetText.set_text(power)
        if power:
            self._update_offset_text_position(*self._get_ticklabel_bboxes([], renderer))
            self.offsetText.draw(renderer)
        renderer.close_group(__name__)
        self.stale = False


class _LevelAxis(_Strokes, XAxis):
    """The axis under a panel."""


class _UprightAxis(_Strokes, YAxis):
    """The axis on a panel's left."""


class Panel(Axes):
    """Matplotlib's axes with both axes drawn in a few strokes."""

    def _init_axis(self) -> None:
        self.xaxis, self.yaxis = _LevelAxis(self, clear=False), _UprightAxis(self, clear=False)
        for name, spine in self.spines.items():
            spine.register_axis(self.xaxis if name in ("bottom", "top") else self.yaxis)

    def clear(self) -> None:
        """Be empty, with all spines at their places, where matplotlib waits for a tick to ask."""
        super().clear()
        for spine in self.spines.values():
            spine.get_spine_transform()
