"""A second process that draws some of a recording's pictures while this one draws the others.

It only ever helps: pictures that it does not deliver, for whatever reason, are drawn here.
"""

from __future__ import annotations

import contextlib
import gc
import multiprocessing
import os
import pickle
import queue
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, TypeAlias

from phasmid.cores import cores
from phasmid.reporting.gallery import Files, Gallery
from phasmid.reporting.style import warm
from phasmid.robot import Appearance

SWITCH = "PHASMID_PROCESSES"
"""Environment variable by which ``1`` keeps all drawing in the process that reports."""

FEWEST = 4
"""Pictures of which a second process takes enough to be worth its start."""

FREE = 0.5
"""Cores that must have been free, this process among the busy ones: a second process imports for a
second before it helps, and on a busy machine would only take the time that this one needs."""

LARGEST = 256_000_000
"""Bytes of a recording that is not copied for a second process."""

UNSTARTED = (OSError, RuntimeError, ValueError)
"""What may go wrong where a process is started; then there is none."""

PATIENCE = 60.0
"""Longest time in which nothing comes from the second process before it is given up [s]."""

START = (
    "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN); "
    "from phasmid.reporting.companion import serve; serve()"
)
"""What the second process runs; Ctrl-C is for the first one, which ends the second."""

Told: TypeAlias = list[tuple[Any, type[Warning], str, int]]
"""Warnings: message, kind, file and line."""

All: TypeAlias = dict[str, Files]


@contextmanager
def standby() -> Iterator[None]:
    """Start the second process now, beside other work, so that it is ready for the next gallery."""
    if willing():
        with contextlib.suppress(*UNSTARTED):
            _ready.append(_Process())
    try:
        yield
    finally:
        while waiting := _waiting():
            waiting.end()


@contextmanager
def drawing(gallery: Gallery) -> Iterator[Callable[[], All]]:
    """Start what helps to draw a gallery; the function that is given draws all its pictures.

    Between the two there may be other work, beside which the second process gets ready.

    Args:
        gallery: The pictures.
    """
    companion = _started(gallery)
    if companion is None:
        yield lambda: {name: gallery.drawn(name) for name in gallery.names}
        return
    try:
        yield companion.drawn
    finally:
        companion.end()


def willing() -> bool:
    """Whether there is a second core with little else to do, and Python can be started on it.

    It is not where somebody shares out the cores already: the user by `SWITCH`, or a pool of
    processes of which this is a part.
    """
    # A program that Python is a part of would be started instead of Python.
    python = Path(sys.executable or "").stem.lower().startswith(("python", "pypy"))
    return (
        python
        and not getattr(sys, "frozen", False)
        and cores() > 1
        and free_cores() >= FREE
        and os.environ.get(SWITCH, "") != "1"
        and multiprocessing.parent_process() is None
    )


def helps(gallery: Gallery) -> bool:
    """Whether a second process makes a gallery's pictures sooner ready."""
    enough = len(gallery.names) >= FEWEST and gallery.recording.nbytes <= LARGEST
    return enough and (any(one.is_ours for one in _ready) or willing())


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
    look = gallery.appearance
    order = gallery.recording, None if look is None else (dict(look.parts), look.name)
    with contextlib.suppress(*UNSTARTED):
        return _Companion(gallery, order)
    return None


class _Process:
    """The second process: what it is told, what it answers, and what it says besides."""

    def __init__(self) -> None:
        self._owner = os.getpid()
        self._words = tempfile.TemporaryFile()  # noqa: SIM115, it is read at the end
        places = [
            str(Path(place).absolute()) for place in sys.path if place and isinstance(place, str)
        ]
        try:
            self.program = subprocess.Popen(  # noqa: S603
                # Unbuffered, as it is killed and not ended: what it prints would be lost.
                [sys.executable, "-P", "-u", "-c", START],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._words,
                env=os.environ | {"PYTHONPATH": os.pathsep.join(places)},
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            )
        except BaseException:
            self._words.close()
            raise
        assert self.program.stdin is not None
        assert self.program.stdout is not None
        self.orders, self.answers = self.program.stdin, self.program.stdout

    @property
    def is_ours(self) -> bool:
        """Whether this process started it, and not one that this is a copy of."""
        return self._owner == os.getpid()

    def kill(self) -> None:
        """Let it do no more; whoever waits for an answer gets none."""
        self.program.kill()
        self.program.wait()

    def end(self, *, aloud: bool = False) -> None:
        """End it, and say what it said where that is wanted."""
        self.kill()
        for stream in (self.orders, self.answers):
            with contextlib.suppress(OSError):
                stream.close()
        if aloud and sys.stderr is not None:
            self._words.seek(0)
            # A terminal that is gone must not cost the report.
            with contextlib.suppress(OSError, ValueError):
                sys.stderr.write(self._words.read().decode(errors="replace"))
        self._words.close()


_ready: list[_Process] = []
"""Processes that were started before there was anything to draw."""


def _waiting() -> _Process | None:
    """One of them, which waits no longer; None where there is none of this process's own."""
    for one in _ready:
        if one.is_ours:
            _ready.remove(one)
            return one
    return None


class _Companion:
    """The second process as the first one sees it, by way of a thread that talks with it."""

    def __init__(self, gallery: Gallery, order: object) -> None:
        self._gallery = gallery
        # The picture of the robot takes longest; the second process begins at that end.
        self._left = deque(gallery.names)
        self._answers: queue.SimpleQueue[tuple[str, Files, Told] | None] = queue.SimpleQueue()
        self._well = False
        self._process = _waiting() or _Process()
        self._talk = threading.Thread(target=self._converse, args=(order,), daemon=True)
        try:
            self._talk.start()
        except BaseException:
            self.end()
            raise

    def _converse(self, order: object) -> None:
        """Hand over pictures to draw, one at a time, until none is left."""
        to, back = self._process.orders, self._process.answers
        # Whatever goes wrong there, what is not answered is drawn here.
        with contextlib.suppress(Exception):
            _send(order, to)
            pickle.load(back)  # noqa: S301, our own process says that it is ready
            while name := self._last():
                _send(name, to)
                answer = pickle.load(back)  # noqa: S301, our own process
                if answer is not None:
                    self._answers.put((name, *answer))
            self._well = True
        self._answers.put(None)

    def _first(self) -> str:
        """The next picture that is drawn here; nothing where none is left."""
        try:
            return self._left.popleft()
        except IndexError:
            return ""

    def _last(self) -> str:
        """The next picture for the second process; nothing where none is left."""
        try:
            return self._left.pop()
        except IndexError:
            return ""

    def drawn(self) -> All:
        """All pictures; those that the second process takes are not drawn here."""
        found: All = {}
        told: Told = []
        while name := self._first():
            found[name] = self._gallery.drawn(name)
        while len(found) < len(self._gallery.names):
            answer = self._answer()
            if answer is None:
                break
            name, found[name], complaints = answer
            told += complaints
        registry: dict[Any, Any] = {}
        for complaint in told:
            warnings.warn_explicit(*complaint, registry=registry)
        for name in self._gallery.names:
            if name not in found:
                found[name] = self._gallery.drawn(name)
        return found

    def _answer(self) -> tuple[str, Files, Told] | None:
        """The next picture of the second process; None where no more comes."""
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until:
            # In short spans, between which Windows lets Ctrl-C through.
            with contextlib.suppress(queue.Empty):
                return self._answers.get(timeout=0.2)
        return None

    def end(self) -> None:
        """End the second process; what it said is said here, unless it died over it."""
        self._process.kill()
        if self._talk.ident is not None:
            self._talk.join(PATIENCE)
        self._process.end(aloud=self._well)


def _send(thing: object, stream: IO[bytes]) -> None:
    pickle.dump(thing, stream, protocol=5)
    stream.flush()


def serve() -> None:
    """Be the second process: draw what standard input names until it ends."""
    # Nothing that a library prints may come between the answers.
    with os.fdopen(os.dup(1), "wb") as answers:
        os.dup2(2, 1)
        orders = sys.stdin.buffer
        gc.disable()
        warm()
        recording, look = pickle.load(orders)  # noqa: S301, of the process that started this one
        gallery = Gallery(recording, None if look is None else Appearance.of(*look))
        _send(True, answers)
        with contextlib.suppress(EOFError):
            while True:
                name = pickle.load(orders)  # noqa: S301, the same
                _send(_answer(gallery, name), answers)


def _answer(gallery: Gallery, name: str) -> tuple[Files, Told] | None:
    """A picture and the warnings that came of it; None where it could not be drawn."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            files = gallery.drawn(name)
        except Exception:
            # The process that asks draws it once more, and there the error is at its place.
            return None
    return files, [(w.message, w.category, w.filename, w.lineno) for w in caught]
