"""Compile the controller before the first drive on a machine, with its progress."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from phasmid.cli.progress import progress_bar

if TYPE_CHECKING:
    from phasmid.scenario import Scenario

NOTICE = "compiling the controller, once for this machine: less than a minute"

TRIAL = 0.05
"""Duration of the drive that compiles all that a drive needs [s]."""

POLL = 0.5
"""Time between two looks at which loops are compiled [s]."""


def announce_compilation() -> None:
    """Print a line where the controller is not compiled yet."""
    from phasmid.control.compilation import are_compiled

    if not are_compiled():
        print(f"phasmid: {NOTICE}", file=sys.stderr, flush=True)


def compile_controller(scenario: Scenario, *, rate: float, quiet: bool) -> None:
    """Compile the controller and the simulation by a short drive, with its progress.

    Args:
        scenario: A short drive of it runs.
        rate: Updates a second [1/s].
        quiet: Leave it to the drive itself.
    """
    from phasmid.control.compilation import FUNCTIONS, are_compiled

    if quiet or are_compiled():
        return
    from phasmid.control import Command
    from phasmid.simulation import new_drive

    trial = scenario.replace(duration=TRIAL)
    with (
        progress_bar("compiling", len(FUNCTIONS), quiet=quiet, notice=NOTICE) as progress,
        _polled(progress),
    ):
        new_drive(trial, None, Command(velocity=(0.02, 0.0, 0.0)), rate=rate).advance()


@contextmanager
def _polled(progress: Callable[..., None] | None) -> Iterator[None]:
    """Report the number of compiled loops while the body runs."""
    from phasmid.compiled import is_compiled
    from phasmid.control.compilation import FUNCTIONS

    done = threading.Event()

    def poll() -> None:
        while progress is not None and not done.wait(POLL):
            progress(sum(map(is_compiled, FUNCTIONS)))

    thread = threading.Thread(target=poll, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
