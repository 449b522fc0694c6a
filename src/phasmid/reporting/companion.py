"""A second process that draws some of a recording's pictures while this one draws the others.

It only ever helps: pictures that it does not deliver, for whatever reason, are drawn here.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import queue
import signal
import sys
import threading
import warnings
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from multiprocessing.connection import Connection
from typing import Any, TypeAlias

from phasmid.cores import cores
from phasmid.reporting.gallery import File, Gallery
from phasmid.reporting.style import warm

SWITCH = "PHASMID_PROCESSES"
"""Environment variable by which ``1`` keeps all drawing in the process that reports."""

FEWEST = 4
"""Pictures of which a second process takes enough to be worth its start."""

FREE = 0.5
"""Cores that must have been free, this process among the busy ones: on a busy machine a second
process would only take the time that this one needs."""

PATIENCE = 60.0
"""Longest time in which nothing comes from the second process before it is given up [s]."""

Told: TypeAlias = list[tuple[Any, type[Warning], str, int]]
"""Warnings: message, kind, file and line."""

Files: TypeAlias = dict[File, bytes]
"""Contents of files by picture and ending."""

Draw: TypeAlias = Callable[[Sequence[File]], Files]
"""Draws those files of a gallery that are named."""


@contextmanager
def drawing(gallery: Gallery) -> Iterator[Draw]:
    """Start what helps to draw a gallery; the function that is given draws files of it.

    Before it is called there may be other work, beside which the second process draws.

    Args:
        gallery: The pictures.
    """
    companion = _started(gallery)
    if companion is None:
        yield lambda files: {file: gallery.drawn(file) for file in files}
        return
    try:
        yield companion.drawn
    finally:
        companion.end()


def helps(gallery: Gallery) -> bool:
    """Whether a second process makes a gallery's pictures sooner ready.

    It is a copy of this one, with all that was imported and read. That is cheap and safe on Linux,
    as long as no other thread is at work, whose locks would be copied with it. The cores may be
    shared out already: by the user with `SWITCH`, or to a pool of processes of which this is one.
    """
    return (
        sys.platform == "linux"
        and len(gallery.of_page) >= FEWEST
        and cores() > 1
        and free_cores() >= FREE
        and os.environ.get(SWITCH, "") != "1"
        and multiprocessing.parent_process() is None
        and threading.active_count() == 1
    )


def free_cores() -> float:
    """How many cores the machine had left in the last minute; all where it does not tell."""
    count = float(os.cpu_count() or 1)
    with contextlib.suppress(AttributeError, OSError):
        return count - os.getloadavg()[0]
    return count


def _started(gallery: Gallery) -> _Companion | None:
    """The second process; None where it would not help, or cannot be started."""
    if not helps(gallery):
        return None
    # Imported once, and not by both.
    warm()
    with contextlib.suppress(OSError, RuntimeError):
        return _Companion(gallery)
    return None


class _Companion:
    """The second process as the first one sees it, by way of a thread that talks with it."""

    def __init__(self, gallery: Gallery) -> None:
        self._gallery = gallery
        # The picture of the robot takes longest; the second process begins at that end.
        self._left = [deque(gallery.of_page), deque(gallery.of_folder)]
        self._found: Files = {}
        self._answers: queue.SimpleQueue[tuple[File, bytes, Told] | None] = queue.SimpleQueue()
        copying = multiprocessing.get_context("fork")
        self._link, other = copying.Pipe()
        self._process = copying.Process(
            target=_serve, args=(gallery, other, self._link), daemon=True
        )
        self._talk = threading.Thread(target=self._converse, daemon=True)
        try:
            with warnings.catch_warnings(), _undisturbed():
                # The threads that Python finds are numpy's, which knows how to be copied.
                warnings.filterwarnings("ignore", ".*fork", DeprecationWarning)
                self._process.start()
            # Only what the second process holds may keep the link open.
            other.close()
            self._talk.start()
        except BaseException:
            self.end()
            raise
        finally:
            other.close()

    def _converse(self) -> None:
        """Hand over pictures to draw, one at a time, until none is left."""
        # Whatever goes wrong there, what is not answered is drawn here.
        with contextlib.suppress(Exception):
            while file := self._last():
                self._link.send(file)
                answer = self._link.recv()
                if answer is not None:
                    self._answers.put((file, *answer))
        self._answers.put(None)

    def _last(self) -> File | None:
        """The next file for the second process; None where none is left."""
        for left in self._left:
            with contextlib.suppress(IndexError):
                return left.pop()
        return None

    def _is_ours(self, file: File) -> bool:
        """Whether a file is drawn here, as the second process did not take it."""
        for left in self._left:
            with contextlib.suppress(ValueError):
                left.remove(file)
                return True
        return False

    def drawn(self, files: Sequence[File]) -> Files:
        """Files of the gallery; those that the second process takes are not drawn here."""
        for file in files:
            if self._is_ours(file):
                self._found[file] = self._gallery.drawn(file)
        told: Told = []
        while any(file not in self._found for file in files):
            answer = self._answer()
            if answer is None:
                break
            file, self._found[file], complaints = answer
            told += complaints
        registry: dict[Any, Any] = {}
        for complaint in told:
            warnings.warn_explicit(*complaint, registry=registry)
        for file in files:
            if file not in self._found:
                self._found[file] = self._gallery.drawn(file)
        return {file: self._found[file] for file in files}

    def _answer(self) -> tuple[File, bytes, Told] | None:
        """The next file of the second process; None where no more comes."""
        with contextlib.suppress(queue.Empty):
            answer = self._answers.get(timeout=PATIENCE)
            if answer is None:
                # Whoever asks once more need not wait.
                self._answers.put(None)
            return answer
        return None

    def end(self) -> None:
        """End the second process, whatever it does."""
        if self._process.pid is not None:
            self._process.kill()
            self._process.join()
        if self._talk.ident is not None:
            self._talk.join(PATIENCE)
        self._link.close()


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Let Ctrl-C wait; a process that is started meanwhile never hears it, and ends with ours."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _serve(gallery: Gallery, link: Connection, other: Connection) -> None:
    """Be the second process: draw what is asked for until the first one ends."""
    # Its end would be kept open here, and never be seen to close.
    other.close()
    with contextlib.suppress(Exception):
        while True:
            link.send(_answer(gallery, link.recv()))


def _answer(gallery: Gallery, file: File) -> tuple[bytes, Told] | None:
    """A file and the warnings that came of it; None where it could not be drawn."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            content = gallery.drawn(file)
        except Exception:
            # The process that asks draws it once more, and there the error is at its place.
            return None
    return content, [(w.message, w.category, w.filename, w.lineno) for w in caught]
