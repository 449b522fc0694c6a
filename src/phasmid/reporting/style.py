"""One look for all figures, their width, and files that come out the same each time."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput

if TYPE_CHECKING:
    import matplotlib.figure

Figure: TypeAlias = "matplotlib.figure.Figure"
"""A matplotlib figure; the name is kept as text so that importing it is quick."""

JOINT_COLOURS = ("#004488", "#bb5566", "#d9a21b")
"""Coxa, femur and tibia: Paul Tol's high contrast, distinct in grey too."""

LEG_COLOURS = (
    "#cc6677",
    "#4a6fc4",
    "#c9a227",
    "#117733",
    "#aa4499",
    "#5ab4dc",
    "#882255",
    "#44aa99",
    "#999933",
)
"""Colours of the legs, in order, in all pictures: near to Paul Tol's muted ones, all dark enough
for text and light enough for a dashed line on top."""

RUN_COLOURS = ("#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377")
"""Colours of runs that are compared, in order: Paul Tol's bright ones."""

RUN_LINES: tuple[dict[str, Any], ...] = tuple(
    {"color": colour, "linestyle": dash, "linewidth": width}
    for colour, dash, width in zip(
        RUN_COLOURS,
        ("-", (0, (6, 1.6)), (0, (2.2, 1.4)), (0, (6, 1.4, 1.6, 1.4)), (0, (1, 1)), "-"),
        (2.2, 1.2, 1.1, 1.0, 0.9, 0.8),
        strict=True,
    )
)
"""Lines of those runs; dashes are distinct in print, widths where lines overlap."""

INK, FAINT = "#2b2f36", "#6b7079"
"""Colours of text."""

LIMIT_COLOUR = "#b3261e"
"""Colour of limits."""

STANCE_COLOUR = "#eef1f5"
"""Shade of the time in which a leg is planned to stand."""

LACKING_COLOUR = "#fbe3df"
"""Shade of the time in which a quantity does not exist, or is left out."""

NORMAL_WIDTH, NARROWEST, WIDEST = 0.18288, 0.06, 0.5
"""Default width of a figure, and its bounds [m]."""

FONT_SIZE = 9.0
"""Size of type at the default width [pt]."""

SMALLEST_TYPE = 0.78
"""Smallest scale of type: 7 pt, which is legible in print."""


@dataclass(frozen=True)
class Layout:
    """Layout of a figure.

    Attributes:
        width: Width of the figure [m].
        title: Draw a title and a subtitle.
        note: Last part of the subtitle.

    Raises:
        InvalidInput: The width is out of range.
    """

    width: float = NORMAL_WIDTH
    title: bool = True
    note: str = ""

    def __post_init__(self) -> None:
        if not NARROWEST <= self.width <= WIDEST:
            raise InvalidInput(
                f"width is {self.width:g} m; it must be from {NARROWEST:g} to {WIDEST:g} m.",
                hint="0.085, a column of a paper",
            )

    @property
    def inches(self) -> float:
        """Width of the figure [inches]."""
        return self.width / 0.0254

    @property
    def type_scale(self) -> float:
        """Size of all type, relative to that at the default width."""
        return min(1.0, max((self.width / NORMAL_WIDTH) ** 0.5, SMALLEST_TYPE))

    @property
    def is_narrow(self) -> bool:
        """True where panels side by side have no space for long words."""
        return self.width < 0.7 * NORMAL_WIDTH


DEFAULT_LAYOUT = Layout()


def leg_colour(leg: int) -> str:
    """Return the colour of a leg, counted from 0."""
    return LEG_COLOURS[leg % len(LEG_COLOURS)]


def rgb(colour: str) -> Float[np.ndarray, "3"]:
    """Return a colour such as ``#4a6fc4`` as red, green and blue from 0 to 1."""
    return np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])


def _hex(colour: Float[np.ndarray, "3"]) -> str:
    return "#" + "".join(f"{round(255 * part):02x}" for part in colour)


def darker(colour: str) -> str:
    """Return a dark variant of a colour, for a second line on top of the first."""
    return _hex(0.6 * rgb(colour))


def paler(colour: str) -> str:
    """Return a pale variant of a colour, for an area behind a line of the first."""
    return _hex(1 - 0.35 * (1 - rgb(colour)))


@contextmanager
def styled(type_scale: float = 1.0) -> Iterator[None]:
    """Draw and save in phasmid's style, regardless of the user's matplotlib settings."""
    import matplotlib

    settings = {**_settings(), "font.size": FONT_SIZE * type_scale}
    with warnings.catch_warnings():
        # Letters that the font lacks are shown as boxes.
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        with matplotlib.rc_context(settings):
            yield


@cache
def _settings() -> dict[Any, Any]:
    """Return matplotlib's defaults, overridden by phasmid.mplstyle."""
    import matplotlib

    path = Path(__file__).with_name("phasmid.mplstyle")
    settings: dict[Any, Any] = dict(matplotlib.rc_params_from_file(path))
    settings.pop("backend", None)
    return settings


def new_figure(width: float, height: float, dpi: float | None = None) -> Figure:
    """Return an empty figure [inches] outside pyplot's registry."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as NewFigure

    figure = NewFigure(figsize=(width, height), dpi=dpi)
    FigureCanvasAgg(figure)
    return figure


NO_DATES: dict[str, dict[str, Any]] = {
    "svg": {"Date": None},
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
"""Metadata left out of each kind of file, so that the same figure gives the same file."""


def save_figure(figure: Figure, path: Path, *, dpi: float | None = None) -> None:
    """Write a figure; the same figure gives the same file.

    Args:
        figure: The figure.
        path: File ending in ``.svg``, ``.png`` or ``.pdf``.
        dpi: Pixels per inch of a ``.png``; the figure's by default.
    """
    path.write_bytes(encoded_figure(figure, path.suffix.removeprefix("."), dpi=dpi))


def encoded_figure(figure: Figure, kind: str, *, dpi: float | None = None) -> bytes:
    """Return a figure as the bytes of a file; the same figure gives the same bytes.

    Args:
        figure: The figure.
        kind: ``svg``, ``png`` or ``pdf``.
        dpi: Pixels per inch of a ``png``, and of images in the others; the figure's by default.
    """
    file = io.BytesIO()
    with styled():
        figure.savefig(file, format=kind, metadata=NO_DATES[kind], dpi=dpi or figure.dpi)
    return file.getvalue()
