"""Changes of the live robot, made ready beside the loop in which it walks."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, InvalidStateError
from contextlib import suppress
from typing import NamedTuple

from phasmid.errors import InvalidInput
from phasmid.studio.live import LiveRobot
from phasmid.studio.messages import Answer, Request
from phasmid.studio.scene import Scene
from phasmid.studio.setting import Setting

LONGEST_REST = 0.5
"""Longest rest after a request [s]; after a large height map nobody waits for long."""


class Ready(NamedTuple):
    """What a request makes of a setting.

    Attributes:
        before: Setting from which it was made.
        setting: The new one.
        live: Robot of the new setting; None if the present one can follow it.
        scene: Drawing of that robot.
    """

    before: Setting
    setting: Setting
    live: LiveRobot | None = None
    scene: Scene | None = None


class Job(NamedTuple):
    """Request in work."""

    request: Request
    answer: Future[Answer]
    ready: Future[Ready]
    begin: float


class Builder:
    """Carries out one request at a time in a thread, and of each kind only the newest.

    After each it rests for as long as that took, so that usual changes of all browsers together
    take at most half of the time.

    Args:
        make: Called in the thread with a request.
        notify: Called in the thread when a request is ready.
    """

    def __init__(self, make: Callable[[Request], Ready], notify: Callable[[], None]) -> None:
        self._make, self._notify = make, notify
        self._waiting: dict[str, tuple[Request, Future[Answer]]] = {}
        self._job: Job | None = None
        self._thread: threading.Thread | None = None
        self._rest_until = 0.0

    def put(self, kind: str, request: Request, answer: Future[Answer]) -> None:
        """Queue a request; one of the same kind that waits is refused."""
        if answer.cancelled():
            return
        older = self._waiting.get(kind)
        if older is not None:
            refuse(older[1], InvalidInput(f"a newer {kind} replaced this one."))
        # In its place: what is renewed often waits no longer.
        self._waiting[kind] = request, answer

    def take(self) -> Job | None:
        """Return the request that is ready; begin the next one, unless a browser took it back."""
        now, done = time.monotonic(), None
        if self._job is not None and self._job.ready.done():
            done, self._job = self._job, None
            self._rest_until = now + min(now - done.begin, LONGEST_REST)
        # A job that was dropped may still be in work.
        is_busy = self._thread is not None and self._thread.is_alive()
        while not is_busy and self._job is None and self._waiting and now >= self._rest_until:
            request, answer = self._waiting.pop(next(iter(self._waiting)))
            if answer.set_running_or_notify_cancel():
                self._begin(request, answer, now)
        return done

    def _begin(self, request: Request, answer: Future[Answer], now: float) -> None:
        ready: Future[Ready] = Future()

        def work() -> None:
            try:
                ready.set_result(self._make(request))
            except Exception as error:
                ready.set_exception(error)
            self._notify()

        thread = threading.Thread(target=work, name="builder", daemon=True)
        self._job, self._thread = Job(request, answer, ready, now), thread
        thread.start()

    def drop(self, error: Exception) -> None:
        """Refuse the request in work, whose result is not used."""
        if self._job is not None:
            refuse(self._job.answer, error)
            self._job = None

    def close(self, longest: float) -> None:
        """Refuse all requests, and wait for the thread [s]."""
        closed = InvalidInput("the studio is closed.")
        self.drop(closed)
        for _, answer in self._waiting.values():
            refuse(answer, closed)
        if self._thread is not None:
            self._thread.join(longest)


def refuse(answer: Future[Answer], error: BaseException) -> None:
    """Set the error of an answer."""
    # The browser may have gone.
    with suppress(InvalidStateError):
        answer.set_exception(error)
