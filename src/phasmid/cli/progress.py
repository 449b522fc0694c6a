"""Progress of what takes long: a bar on a terminal, nothing where the output is piped."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def progress_bar(
    what: str, total: float | None = None, *, quiet: bool
) -> Iterator[Callable[..., None] | None]:
    """Show a bar on the standard error while the body runs.

    Args:
        what: Name of the work.
        total: Amount of work, in any unit; None where the work itself gives it.
        quiet: Show nothing.

    Yields:
        A function of the amount done, and of the total where that was not given; None without a
        terminal.
    """
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (TextColumn(what), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=total)
        yield lambda done, total=total: bar.update(task, completed=done, total=total)
