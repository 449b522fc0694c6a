"""The files of the live page: a fixed table, read once, and nothing beside it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from phasmid.reporting.webpage import DRAWING, own_text

KINDS = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
}
"""Media types by the ends of names."""

OWN = (
    "studio.html",
    "studio.css",
    "connection.js",
    "frames.js",
    "view.js",
    "strip.js",
    "plots.js",
    "controls.js",
    "hands.js",
    "actions.js",
    "bench.css",
    "bench-drawing.js",
    "bench.js",
    "studio.js",
)

SHARED = ("colours.css", *DRAWING)
"""Files that the report's page holds too."""


@dataclass(frozen=True, slots=True)
class Asset:
    """A file of the page.

    Attributes:
        content: Its bytes.
        kind: Its media type.
    """

    content: bytes = field(repr=False)
    kind: str


def assets() -> dict[str, Asset]:
    """The page's files by their names; ``studio.html`` is the page itself."""
    texts = {name: own_text(name) for name in SHARED}
    folder = Path(__file__).with_name("page")
    texts |= {name: (folder / name).read_text(encoding="utf-8") for name in OWN}
    return {
        name: Asset(text.encode(), KINDS[Path(name).suffix]) for name, text in sorted(texts.items())
    }
