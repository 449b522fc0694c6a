"""Progress of long work: a bar in a terminal, at most one line in a pipe."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from phasmid.cli.output import say


@contextmanager
def progress_bar(
    what: str, total: float | None = None, *, quiet: bool, notice: str = ""
) -> Iterator[Callable[..., None] | None]:
    """Show a bar on the standard error while the body runs.

    Args:
        what: Name of the work.
        total: Amount of work, in any unit; None: the caller passes it to the yielded function.
        quiet: Show nothing.
        notice: Line that is printed once where the standard error is not a terminal.

    Yields:
        ``update(done, total, note)``, which moves the bar; the note follows the name of the work.
        None where no bar is shown.
    """
    if quiet or not sys.stderr.isatty():
        if notice and not quiet:
            say(f"phasmid: {notice}", file=sys.stderr)
        yield None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=total)

        def update(done: float, total: float | None = total, note: str = "") -> None:
            bar.update(task, completed=done, total=total, description=f"{what}{note}")

        yield update


def announce_compilation(*, quiet: bool = False) -> None:
    """Print a line where the controller is not compiled yet: the first drive on a machine waits."""
    from phasmid.control.compilation import are_compiled

    if not quiet and not are_compiled():
        notice = "compiling the controller, once for this machine: one to three minutes"
        say(f"phasmid: {notice}", file=sys.stderr)
