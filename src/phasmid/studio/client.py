"""One browser: what it is told, what it asks, and how much of either it may."""

from __future__ import annotations

import asyncio
import json
import logging
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from phasmid.errors import PhasmidError, plain
from phasmid.studio.errors import TooMany
from phasmid.studio.guard import LARGEST, too_large
from phasmid.studio.messages import Request
from phasmid.studio.parsing import read_request
from phasmid.studio.strict import Misunderstood

RATE = 200.0
"""Commands a second that a browser may give; as many may come at once."""

MOST_WAITING = 100
"""Commands of one browser that may wait for their answers."""

MOST_BEHIND = 50_000_000
"""Characters that may wait to be read before a browser is given up."""

REST, AFTER = 0.05, 100
"""A browser that gives too many commands is not read from for so long [s], after so many."""

TELL = 1.0
"""How often a browser is told that it asks too much [s]."""

OUR_MISTAKE = "this is a mistake of phasmid, not yours; please report it."

log = logging.getLogger("phasmid.studio")


class Client:
    """A browser whose websocket is open.

    Args:
        connection: Its websocket.
        ask: Hands a request to the robot.
    """

    def __init__(
        self, connection: ServerConnection, ask: Callable[[Request], Future[dict[str, Any]]]
    ) -> None:
        self._connection = connection
        self._ask = ask
        self._loop = asyncio.get_running_loop()
        self._news = asyncio.Event()
        self._texts: deque[str] = deque()
        self._behind = 0
        self._frame: bytes | None = None
        self._waiting = 0
        self._share = RATE
        self._since = self._told = time.monotonic()
        self._told -= TELL
        self._refused = 0

    def tell(self, text: str) -> None:
        """Send a text; nothing that was told is left out."""
        self._behind += len(text)
        if self._behind > MOST_BEHIND:
            # It may come again, and is then brought up to date.
            self._connection.transport.abort()
            return
        self._texts.append(text)
        self._news.set()

    def show(self, frame: bytes) -> None:
        """Send a frame, unless a newer one comes before the last was read."""
        self._frame = frame
        self._news.set()

    async def serve(self, greeting: list[str]) -> None:
        """Talk with the browser until it goes.

        Args:
            greeting: What it is told before all that has happened meanwhile.
        """
        self._texts.extendleft(reversed(greeting))
        self._behind += sum(map(len, greeting))
        self._news.set()
        sending = self._loop.create_task(self._send())
        try:
            await self._receive()
        finally:
            sending.cancel()
            with suppress(asyncio.CancelledError, ConnectionClosed):
                await sending

    async def _send(self) -> None:
        while True:
            await self._news.wait()
            self._news.clear()
            while self._texts or self._frame is not None:
                if self._texts:
                    text = self._texts.popleft()
                    await self._connection.send(text)
                    self._behind -= len(text)
                elif self._frame is not None:
                    frame, self._frame = self._frame, None
                    await self._connection.send(frame)

    async def _receive(self) -> None:
        with suppress(ConnectionClosed):
            async for message in self._connection:
                if self._may_ask():
                    self._take(message)
                    # Many messages may lie ready; answers and the other browsers have their turn.
                    await asyncio.sleep(0)
                    continue
                self._refused += 1
                self._too_much(f"more than {RATE:.0f} commands a second; the others are left out.")
                if self._refused % AFTER == 0:
                    # Reading costs time too, which the robot and the other browsers need.
                    await asyncio.sleep(REST)

    def _may_ask(self) -> bool:
        now = time.monotonic()
        self._share = min(RATE, self._share + RATE * (now - self._since))
        self._since = now
        if self._share < 1:
            return False
        self._share -= 1
        return True

    def _take(self, message: str | bytes) -> None:
        size = len(message) if isinstance(message, bytes) else len(message.encode())
        if size > LARGEST:
            self._reply(None, 413, text=too_large("message", size))
            return
        try:
            number, request = read_request(message)
        except Misunderstood as error:
            self._reply(error.id, error.status, text=error.what, hint=error.hint)
            return
        if self._waiting >= MOST_WAITING:
            sentence = f"{MOST_WAITING} commands wait for their answers; wait for them."
            if number is None:
                self._too_much(sentence)
            else:
                self._reply(number, 429, text=sentence)
            return
        try:
            future = self._ask(request)
        except Exception as error:
            self._fail(number, error)
            return
        self._waiting += 1
        future.add_done_callback(lambda done: self._hand_over(number, done))

    def _hand_over(self, number: int | None, done: Future[dict[str, Any]]) -> None:
        """Bring an answer from the robot's thread to ours."""
        # The loop may have ended meanwhile, and nobody waits any more.
        with suppress(RuntimeError):
            self._loop.call_soon_threadsafe(self._answered, number, done)

    def _answered(self, number: int | None, done: Future[dict[str, Any]]) -> None:
        self._waiting -= 1
        if done.cancelled():
            self._reply(number, 500, text="the robot has been put away.")
            return
        error = done.exception()
        if error is not None:
            self._fail(number, error)
        elif number is not None:
            self._reply(number, 200, answer=done.result())

    def _fail(self, number: int | None, error: BaseException) -> None:
        if isinstance(error, PhasmidError):
            where = f" ({error.where})" if error.where else ""
            status = 429 if isinstance(error, TooMany) else 422
            self._reply(number, status, text=f"{error.what}{where}", hint=error.hint)
            return
        log_mistake(error)
        self._reply(number, 500, text=OUR_MISTAKE)

    def _too_much(self, sentence: str) -> None:
        """Say once in a while that some commands are left out."""
        now = time.monotonic()
        if now - self._told >= TELL:
            self._told = now
            self._reply(None, 429, text=sentence)

    def _reply(self, number: int | None, status: int, **parts: Any) -> None:
        parts = {key: part for key, part in parts.items() if part != "" and part is not None}
        told = {"reply": number, "status": status} | parts
        try:
            text = json.dumps(told, allow_nan=False)
        except (TypeError, ValueError) as error:
            log_mistake(error)
            text = json.dumps({"reply": number, "status": 500, "text": OUR_MISTAKE})
        self.tell(text)


def log_mistake(error: BaseException) -> None:
    """Tell the log of an exception of ours, in one line unless it is asked for more."""
    said = plain(f"{type(error).__name__}: {error}")[:300]
    trace = error if log.isEnabledFor(logging.DEBUG) else None
    log.error("a mistake of phasmid: %s", said, exc_info=trace)
