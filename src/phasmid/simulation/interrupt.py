"""Ctrl-C during a run: the first is noted, the second ends at once."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def noticed_interrupts() -> Iterator[list[int]]:
    """Note the first Ctrl-C instead of raising it, so that no work is cut in its middle.

    Yields:
        A list that is empty until then. A second Ctrl-C is raised as ever.
    """
    noticed: list[int] = []

    def note(number: int, frame: Any) -> None:
        if noticed:
            signal.default_int_handler(number, frame)
        noticed.append(number)

    try:
        before = signal.signal(signal.SIGINT, note)
    except ValueError:
        # Only the main thread may ask for signals, and only it gets them.
        yield noticed
        return
    try:
        yield noticed
    finally:
        signal.signal(signal.SIGINT, before)
