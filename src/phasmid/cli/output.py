"""Text and tables of the terminal."""

from __future__ import annotations

import os
import re
import shutil
import sys
import textwrap
from collections.abc import Sequence
from typing import TextIO

NARROWEST = 20
"""Least width to which the last column of a table is wrapped [columns]."""


def say(text: str = "", *, indent: int | None = None, file: TextIO | None = None) -> None:
    """Print lines; a terminal gets them broken between words.

    Args:
        text: One line or more.
        indent: Of broken lines; None: 2 more than that of the line [columns].
        file: Destination; None: the standard output.
    """
    file = file or sys.stdout
    if file.isatty():
        text = "\n".join(_broken(line, indent) for line in text.split("\n"))
    print(text, file=file, flush=True)


def _broken(line: str, indent: int | None) -> str:
    width = shutil.get_terminal_size().columns
    if len(line) < width:
        return line
    margin = len(line) - len(line.lstrip())
    # A number keeps its unit.
    joined = re.sub(r"(\d) (%|[A-Za-z°][\w·°²/]{0,3}\b)", "\\1\N{NO-BREAK SPACE}\\2", line.lstrip())
    broken = textwrap.fill(
        joined,
        width - 1,
        initial_indent=margin * " ",
        subsequent_indent=(margin + 2 if indent is None else indent) * " ",
        break_long_words=False,
        break_on_hyphens=False,
    )
    return broken.replace("\N{NO-BREAK SPACE}", " ")


def print_table(rows: Sequence[Sequence[str]], right: Sequence[int] = ()) -> None:
    """Print rows in aligned columns; a terminal gets the last one broken between words.

    Args:
        rows: Cells of each row, the heads first.
        right: Indices of the columns that are aligned to the right.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    indent = sum(widths[:-1]) + 2 * (len(widths) - 1)
    if shutil.get_terminal_size().columns - indent < NARROWEST:
        indent = 2
    for row in rows:
        cells = [
            cell.rjust(width) if k in right else cell.ljust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        say("  ".join(cells).rstrip(), indent=indent)


def has_display() -> bool:
    """Return True if a browser can open a window."""
    own = sys.platform in ("darwin", "win32")
    return own or any(os.environ.get(key) for key in ("DISPLAY", "WAYLAND_DISPLAY"))
