"""Signals that end a command: noted, beside the KeyboardInterrupt that they raise.

Python swallows an exception that a signal raises inside the callback of a weak reference, a
finaliser or a callback from C, and a library may catch it. So each signal is also noted in a list,
which long work and the end of the command look at.
"""

from __future__ import annotations

import _thread
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import Any

STOP_SIGNALS = "SIGINT", "SIGTERM", "SIGHUP"
"""Signals that end a command: Ctrl-C, `kill`, a closed terminal; Windows has no SIGHUP."""

REPEAT_TIME = 1.0
"""Time after a signal in which others are only noted [s].

A closed terminal and many service managers send several, and only the first one may raise: the
others would interrupt the cleaning up.
"""

RAISE_AGAIN_TIME = 0.02
"""Time after which an exception that Python swallowed is raised again [s]."""


@contextmanager
def handled_signals(
    handler: Callable[[int, FrameType | None], None], names: Sequence[str] = STOP_SIGNALS
) -> Iterator[None]:
    """Call a function at each signal in the body; a thread receives none.

    Args:
        handler: Receives the number of the signal and the frame that it interrupts.
        names: Names of the signals; those that the system does not know are left out.
    """
    before: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():
        for name in names:
            number = getattr(signal, name, None)
            # A program that nohup started outlives its terminal.
            if number is None or (name == "SIGHUP" and signal.getsignal(number) is signal.SIG_IGN):
                continue
            before[number] = signal.signal(number, handler) or signal.SIG_DFL
    try:
        yield
    finally:
        for number, earlier in before.items():
            signal.signal(number, earlier)


class StopSignals:
    """Handler of the signals that end a command.

    As a context manager it handles them in its body.

    Attributes:
        noticed: Numbers of the signals received.
        held: Number of `held_signals` that are open: the first signal is noted only.
        error: What ended the command. It is kept until the process ends: a library that was
            interrupted, such as llvmlite, may crash when what it left half-made is freed.
    """

    def __init__(self, names: Sequence[str] = STOP_SIGNALS) -> None:
        self._names = names
        self.noticed: list[int] = []
        self.held = 0
        self.error: BaseException | None = None
        self._raised_at = -REPEAT_TIME
        self._raises_again = False
        self._again: threading.Timer | None = None

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Note a signal, and raise KeyboardInterrupt unless it is held or follows another one."""
        del frame
        if self._raises_again:
            self._raises_again = False
            if self.held:
                # The end of `held_signals` raises.
                return
            raise KeyboardInterrupt
        now, is_first = time.monotonic(), not self.noticed
        self.noticed.append(number)
        if now - self._raised_at < REPEAT_TIME:
            return
        self._raised_at = now
        if not (self.held and is_first):
            raise KeyboardInterrupt

    def __enter__(self) -> StopSignals:
        self._handled = handled_signals(self, self._names)
        self._handled.__enter__()
        self._hook_before, sys.unraisablehook = sys.unraisablehook, self._on_swallowed
        return self

    def __exit__(self, *error: Any) -> None:
        self._handled.__exit__(*error)
        sys.unraisablehook = self._hook_before
        if self._again is not None:
            self._again.cancel()

    def _on_swallowed(self, unraisable: Any) -> None:
        """Raise a KeyboardInterrupt again that Python swallowed, in place of printing it."""
        if not self.noticed:
            self._hook_before(unraisable)
        elif issubclass(unraisable.exc_type, KeyboardInterrupt):
            self._raises_again = True
            self._again = threading.Timer(RAISE_AGAIN_TIME, _thread.interrupt_main)
            self._again.daemon = True
            self._again.start()


@contextmanager
def held_signals() -> Iterator[list[int]]:
    """Note the first signal in the body, and raise KeyboardInterrupt when the body has ended.

    A second signal, `REPEAT_TIME` later, is raised at once. In a command these are all its signals,
    also one whose exception was swallowed before; elsewhere it is Ctrl-C.

    Yields:
        The signals; empty as long as the body should go on. In a thread, which receives no signals,
        it stays empty.

    Raises:
        KeyboardInterrupt: There was a signal.
    """
    handler = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(handler):
        yield []
    elif isinstance(handler, StopSignals):
        handler.held += 1
        try:
            yield handler.noticed
        finally:
            handler.held -= 1
        if handler.noticed and not handler.held:
            raise KeyboardInterrupt
    else:
        own = StopSignals(("SIGINT",))
        with own, held_signals() as noticed:
            yield noticed
