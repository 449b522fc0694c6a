"""One look for all figures, and files that come out the same each time."""

from __future__ import annotations

import gc
import io
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from jaxtyping import Float

from phasmid.reporting.layout import layout

if TYPE_CHECKING:
    import matplotlib.figure
    import matplotlib.text

Figure: TypeAlias = "matplotlib.figure.Figure"
"""A matplotlib figure; the name is kept as text so that importing it is quick."""

Text: TypeAlias = "matplotlib.text.Text"

JOINT_COLOURS = ("#004488", "#bb5566", "#d9a21b")
"""Coxa, femur and tibia: Paul Tol's high contrast, which also tells them apart in grey."""

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

RUN_DASHES = ("-", (0, (6, 1.6)), (0, (2.2, 1.4)), (0, (6, 1.4, 1.6, 1.4)), (0, (1, 1)), "-")
"""Dashes of those runs, by which print without colour tells them apart."""

RUN_WIDTHS = (2.2, 1.2, 1.1, 1.0, 0.9, 0.8)
"""Widths of those lines [pt]: of runs that are alike the later ones lie on the first."""

INK, FAINT = "#2b2f36", "#6b7079"
"""Colours of text."""

POWER_COLOURS = ("#6b7079", "#004488", "#bb5566", "#d9a21b")
"""Net power, what is given, the sum of sizes, and what servos draw."""

LIMIT_COLOUR = "#b3261e"
"""Colour of what must not be crossed."""

STANCE_COLOUR = "#eef1f5"
"""Shade of the time in which a leg is planned to stand."""

LACKING_COLOUR = "#fbe3df"
"""Shade of the time in which what is drawn does not exist, or is left out."""

MOST_POINTS = 2000
"""Most points drawn of one line: twice as many as a figure has pixels across."""


def leg_colour(leg: int) -> str:
    """Colour of a leg, counted from 0."""
    return LEG_COLOURS[leg % len(LEG_COLOURS)]


def darker(colour: str) -> str:
    """A colour's dark variant, for a second line on top of the first."""
    parts = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return "#" + "".join(f"{round(0.6 * part):02x}" for part in parts)


def paler(colour: str) -> str:
    """A colour's pale variant, for an area behind a line of the first."""
    parts = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return "#" + "".join(f"{round(255 - 0.35 * (255 - part)):02x}" for part in parts)


@contextmanager
def styled() -> Iterator[None]:
    """Draw and save in phasmid's style, whatever the user's own settings are.

    Within another one that nobody disturbed it does nothing, so that what is set in it ends with
    the outer one.
    """
    import matplotlib

    found: Any = matplotlib.rcParams
    # To set one, even to what it is, takes its time.
    settings = _settings(layout().type_scale)
    other = {name: value for name, value in settings.items() if found[name] != value}
    with warnings.catch_warnings():
        # A name in a script that the font lacks is shown as boxes; that is no reason to complain.
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        with matplotlib.rc_context(other) if other else nullcontext():
            yield


def warm() -> None:
    """Import and read all that a first figure needs, before there is one."""
    from matplotlib.figure import Figure as Drawing

    with styled():
        figure = Drawing(figsize=(1.0, 1.0))
        figure.subplots().set_title("a")
    for kind in ("svg", "png"):
        encoded_figure(figure, kind)


@contextmanager
def uncollected() -> Iterator[None]:
    """Look for no garbage meanwhile: of a dozen figures' objects that is a tenth of the time."""
    before = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if before:
            gc.enable()


TYPE_SIZES = (
    "font.size",
    "axes.labelsize",
    "axes.titlesize",
    "xtick.labelsize",
    "ytick.labelsize",
    "legend.fontsize",
)
"""Settings that are sizes of type [pt]."""


@lru_cache(maxsize=8)
def _settings(type_scale: float) -> dict[Any, Any]:
    """All settings of matplotlib: its own, and over them phasmid's, with type of a scale."""
    import matplotlib

    path = Path(__file__).with_name("phasmid.mplstyle")
    settings: dict[Any, Any] = dict(matplotlib.rc_params_from_file(path))
    settings.pop("backend", None)
    return settings | {name: type_scale * settings[name] for name in TYPE_SIZES}


def wrapped(text: Text, parts: Sequence[str], width: float) -> int:
    """Write parts with dots between them, in as many lines as keep them within a width.

    Args:
        text: Of a figure; where that saves a line its letters become a little smaller.
        parts: Kept in one piece where they fit a line.
        width: Pixels of the figure.

    Returns:
        The number of lines.
    """
    whole = " · ".join(parts)
    if not _fits(text, whole, width) and _fits(text, whole, 1.08 * width):
        smaller = 0.99 * width / max(text_width(text, whole), 1.0)
        if smaller > 0.92:
            text.set_fontsize(smaller * float(text.get_fontsize()))
    if _fits(text, whole, width):
        text.set_text(whole)
        return 1
    lines = [""]
    for number, part in enumerate(parts):
        part += " ·" if number < len(parts) - 1 else ""
        for piece in [part] if _fits(text, part, width) else part.split(" "):
            longer = f"{lines[-1]} {piece}".lstrip()
            if _fits(text, longer, width):
                lines[-1] = longer
                continue
            lines.append("")
            # A word that is wider than a line is broken.
            for letter in piece:
                if not _fits(text, lines[-1] + letter, width):
                    lines.append("")
                lines[-1] += letter
    lines = [line.removesuffix(" ·") for line in lines if line]
    text.set_text("\n".join(lines))
    return len(lines)


def shrunk(text: Text, width: float, least: float) -> None:
    """Make a text of a figure smaller, and then shorter, until it keeps within a width.

    Args:
        text: It is changed.
        width: Pixels of its figure.
        least: Size of letters below which words are cut off instead [pt].
    """
    whole = text.get_text()
    if _fits(text, whole, width):
        return
    scale = width / max(text_width(text, whole), 1.0)
    text.set_fontsize(max(0.99 * scale * float(text.get_fontsize()), least))
    kept = len(whole)
    while kept and not _fits(text, text.get_text(), width):
        kept = min(kept - 1, int(0.95 * kept))
        text.set_text(f"{whole[:kept].rstrip()} …")


def _fits(text: Text, words: str, width: float) -> bool:
    """Whether words of a text keep within a width; only where that is in doubt are they set."""
    from matplotlib.font_manager import findfont

    figure: Any = text.figure
    font = text.get_fontproperties()
    letters = _advances(findfont(font))
    size = float(font.get_size_in_points()) * float(figure.dpi) / 72
    about = size * sum(letters[letter] for letter in words)
    if LEAST_SET * about > width:
        return False
    return bool(MOST_SET * about <= width or text_width(text, words) <= width)


LEAST_SET, MOST_SET = 0.6, 1.4
"""Widths of words, in widths of their letters, between which they are whichever letters meet."""


class _Advances(dict[str, float]):
    """From a letter to the next one, in sizes of the font; NaN where it is not set by itself."""

    def __init__(self, file: str) -> None:
        from matplotlib.ft2font import FT2Font

        super().__init__()
        self._face: Any = FT2Font(file)
        self._face.set_size(FACE_SIZE, 72)

    def __missing__(self, letter: str) -> float:
        code = ord(letter)
        # Latin letters, punctuation and the signs of mathematics.
        is_plain = (code < 0x300 or 0x2000 <= code < 0x2300) and letter.isprintable()
        self[letter] = np.nan
        if is_plain and self._face.get_char_index(code):
            pixels = float(self._face.load_char(code).linearHoriAdvance) / 65536
            self[letter] = pixels / FACE_SIZE
        return self[letter]


FACE_SIZE = 64.0
"""At which letters are measured [pt]; their advances grow with the size."""


@lru_cache(maxsize=16)
def _advances(file: str) -> _Advances:
    """Those of a font's file."""
    return _Advances(file)


def text_width(text: Text, words: str) -> float:
    """Pixels that a text takes with some words in it.

    Args:
        text: Of a figure; it is left as it is.
        words: One line.
    """
    figure: Any = text.figure
    return _pixels(words, text.get_fontproperties().copy(), float(figure.dpi))


@lru_cache(maxsize=4096)
def _pixels(words: str, font: Any, dpi: float) -> float:
    """Pixels across of words, of which a run's figures have many in common."""
    ruler = _ruler(dpi)
    ruler.set_fontproperties(font)
    ruler.set_text(words)
    return float(ruler.get_window_extent().width)


@cache
def _ruler(dpi: float) -> Text:
    """A text that is never drawn."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Drawing

    figure = Drawing(dpi=dpi)
    FigureCanvasAgg(figure)
    return figure.text(0, 0, "")


NO_DATES: dict[str, dict[str, Any]] = {
    "svg": {"Date": None},
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
"""Kinds of file, and what is left out of each so that the same figure gives the same file."""


def save_figure(figure: Figure, path: Path, *, dpi: float | None = None) -> None:
    """Write a figure as the kind of file that its name says; the same figure gives the same file.

    Args:
        figure: What to write.
        path: File ending in ``.svg``, ``.png`` or ``.pdf``.
        dpi: Pixels per inch of a ``.png``; the style's by default.
    """
    with path.open("wb") as file:
        file.write(encoded_figure(figure, path.suffix.removeprefix("."), dpi=dpi))


def encoded_figure(figure: Figure, kind: str, *, dpi: float | None = None) -> bytes:
    """A figure as the bytes of a file; the same figure gives the same bytes.

    Args:
        figure: What to write.
        kind: Of file: ``svg``, ``png`` or ``pdf``.
        dpi: Pixels per inch of a ``png``, and of what is a picture in the others; the style's by
            default.
    """
    file = io.BytesIO()
    dpi = float(figure.dpi) if dpi is None else dpi
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            # A label without words needs no place: to find it takes as long as to draw the ticks.
            if not axis.get_label_text():
                axis.set_label_coords(0.5, 0.5)
    with styled():
        if kind != "png":
            figure.savefig(file, format=kind, metadata=NO_DATES[kind], dpi=dpi)
            return file.getvalue()
        figure.savefig(file, format="rgba", dpi=dpi)
    return _png(file.getvalue(), int(figure.get_figwidth() * dpi), dpi)


def _png(pixels: bytes, width: int, dpi: float) -> bytes:
    """Pixels as a file without transparency: it is smaller, and written in half the time."""
    from PIL import Image

    file = io.BytesIO()
    size = (width, len(pixels) // (4 * width))
    Image.frombuffer("RGBA", size, pixels).convert("RGB").save(
        file, "png", dpi=(dpi, dpi), compress_level=4
    )
    return file.getvalue()


def thin(
    time: Float[np.ndarray, " time"], values: Float[np.ndarray, " time"], most: int = MOST_POINTS
) -> tuple[Float[np.ndarray, " points"], Float[np.ndarray, " points"]]:
    """Leave out points that no one would see: of each short span the extremes are kept.

    Args:
        time: Time of the samples [s].
        values: The line.
        most: Most points that are left; 4 or more.

    Returns:
        Times and values of what is left, at their own places.
    """
    count = len(values)
    if count <= most:
        return time, values
    span = -(-count // ((most - 2) // 2))
    whole = count // span * span
    rows = np.where(np.isnan(values[:whole]), -np.inf, values[:whole]).reshape(-1, span)
    starts = np.arange(0, whole, span)
    tail = np.arange(whole, count)
    ends = [tail[np.argmin(values[tail])], tail[np.argmax(values[tail])]] if len(tail) else []
    kept = np.concatenate(
        [[0], starts + rows.argmin(axis=1), starts + rows.argmax(axis=1), ends, [count - 1]]
    )
    kept = np.unique(kept.astype(int))
    return time[kept], values[kept]
