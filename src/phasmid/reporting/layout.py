"""Width of the figures, and the size of their type at that width."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

from phasmid.errors import InvalidInput

NORMAL_WIDTH = 7.2
"""Default width of a figure [inches]."""

NARROWEST, WIDEST = 0.06, 0.5
"""Bounds of the width of a figure [m]."""

METRES_PER_INCH = 0.0254

SMALLEST_TYPE = 0.78
"""Smallest scale of type: 7 pt for axis labels, which are legible in print."""


@dataclass(frozen=True)
class Layout:
    """Layout of the figures.

    Attributes:
        width: Width of the figures [inches].
        title: Draw a title and a subtitle.
    """

    width: float = NORMAL_WIDTH
    title: bool = True

    @property
    def type_scale(self) -> float:
        """Size of all type, relative to that at the normal width."""
        return min(1.0, max((self.width / NORMAL_WIDTH) ** 0.5, SMALLEST_TYPE))

    @property
    def is_narrow(self) -> bool:
        """True where panels side by side have no space for long words."""
        return self.width < 0.7 * NORMAL_WIDTH

    @property
    def margin_scale(self) -> float:
        """Margins that hold type, as shares of the width, relative to the normal ones."""
        return self.type_scale * NORMAL_WIDTH / self.width


_LAYOUT: ContextVar[Layout] = ContextVar("layout", default=Layout())  # noqa: B039


def layout() -> Layout:
    """Return the present layout."""
    return _LAYOUT.get()


@contextmanager
def laid_out(layout: Layout) -> Iterator[None]:
    """Draw and save figures in a layout."""
    token = _LAYOUT.set(layout)
    try:
        yield
    finally:
        _LAYOUT.reset(token)


def page_layout(width: float | None, *, title: bool = True) -> Layout:
    """Return the layout for a width [m]; None selects the default.

    Raises:
        InvalidInput: The width is out of range.
    """
    if width is None:
        return Layout(title=title)
    if not NARROWEST <= width <= WIDEST:
        raise InvalidInput(
            f"width is {width:g} m; it must be from {NARROWEST:g} to {WIDEST:g} m.",
            hint="0.085, a column of a paper",
        )
    return Layout(width / METRES_PER_INCH, title)


def points(size: float) -> float:
    """Return a size of type at the present width [pt]."""
    return size * layout().type_scale
