"""One browser: texts and frames out, messages in, each within its limits."""

from __future__ import annotations

import asyncio
import json
import logging
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from phasmid.errors import PhasmidError, plain
from phasmid.studio.messages import Answer, InvalidMessage, Request, read_request

RATE = 200.0
"""Messages per second that a browser may send; as many may come at once."""

PAUSE = 0.05
"""A browser above the rate is not read for as long [s], after each hundredth refusal."""

NOTICE = 1.0
"""Least time between two notices of refused messages [s]."""

MOST_WAITING = 100
"""Most messages of one browser without a reply."""

MOST_UNREAD = 50_000_000
"""Most letters that a browser may leave unread, a hundred scenes; else it is dropped."""

PATIENCE = 15.0
"""Longest time in which a browser must read a message [s]; one that does not is dropped."""

OUR_MISTAKE = "this is a mistake of phasmid, not yours; please report it."

log = logging.getLogger("phasmid.studio")


def log_mistake(error: BaseException) -> None:
    """Log an unforeseen exception in one line; with its traceback at level DEBUG."""
    text = plain(f"{type(error).__name__}: {error}")[:300]
    log.error(
        "a mistake of phasmid: %s",
        text,
        exc_info=error if log.isEnabledFor(logging.DEBUG) else None,
    )


class Browser:
    """Websocket of one browser.

    Args:
        websocket: Accepted websocket.
        submit: Passes a request to the simulation.
    """

    def __init__(self, websocket: WebSocket, submit: Callable[[Request], Future[Answer]]) -> None:
        self._websocket, self._submit = websocket, submit
        self._news = asyncio.Event()
        self._texts: deque[str] = deque()
        self._frame: bytes | None = None
        self._replies: set[asyncio.Task[None]] = set()
        self._tokens, self._filled_at = RATE, time.monotonic()
        self._noticed_at, self._refused = -NOTICE, 0

    def send(self, message: str | bytes) -> None:
        """Queue a text, which is never dropped, or a frame, which replaces an older one."""
        if isinstance(message, bytes):
            self._frame = message
        else:
            self._texts.append(message)
        self._news.set()

    async def serve(self, greeting: list[str]) -> None:
        """Send and receive until the browser leaves, or no longer reads.

        Args:
            greeting: Texts that come before all that was queued meanwhile.
        """
        self._texts.extendleft(reversed(greeting))
        self._news.set()
        both = [asyncio.create_task(part) for part in (self._send(), self._receive())]
        try:
            await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
        finally:
            # What the browser asked for and nobody began is not done.
            for task in (*both, *self._replies):
                task.cancel()
            ends = await asyncio.gather(*both, return_exceptions=True)
        for end in ends:
            gone = (WebSocketDisconnect, TimeoutError, asyncio.CancelledError)
            if isinstance(end, BaseException) and not isinstance(end, gone):
                log_mistake(end)

    async def _send(self) -> None:
        while True:
            if not self._texts and self._frame is None:
                self._news.clear()
                await self._news.wait()
            if sum(map(len, self._texts)) > MOST_UNREAD:
                return
            async with asyncio.timeout(PATIENCE):
                try:
                    if self._texts:
                        await self._websocket.send_text(self._texts.popleft())
                    elif self._frame is not None:
                        frame, self._frame = self._frame, None
                        await self._websocket.send_bytes(frame)
                except RuntimeError:
                    # The server closed it: a message was too large, or no websocket frame.
                    return

    async def _receive(self) -> None:
        while (event := await self._websocket.receive())["type"] == "websocket.receive":
            if self._is_within_rate():
                self._take(event.get("text") or event.get("bytes") or "")
                # Many messages may wait; replies and other browsers have their turn.
                await asyncio.sleep(0)
                continue
            self._refused += 1
            self._notice(f"more than {RATE:.0f} commands a second; the others are left out.")
            if self._refused % 100 == 0:
                await asyncio.sleep(PAUSE)

    def _is_within_rate(self) -> bool:
        now = time.monotonic()
        self._tokens = min(RATE, self._tokens + RATE * (now - self._filled_at))
        self._filled_at = now
        if self._tokens < 1:
            return False
        self._tokens -= 1
        return True

    def _take(self, message: str | bytes) -> None:
        try:
            request = read_request(message)
        except InvalidMessage as error:
            self._reply(error.id, error.status, text=error.what, hint=error.hint)
            return
        if len(self._replies) >= MOST_WAITING:
            full = f"{MOST_WAITING} commands wait for their answers; wait for them."
            if request.id is None:
                self._notice(full)
            else:
                self._reply(request.id, 429, text=full)
            return
        task = asyncio.create_task(self._answer(request))
        self._replies.add(task)
        task.add_done_callback(self._replies.discard)

    async def _answer(self, request: Request) -> None:
        try:
            answer = await asyncio.wrap_future(self._submit(request))
            if request.id is not None:
                self._reply(request.id, 200, answer=answer)
        except PhasmidError as error:
            where = f" ({error.where})" if error.where else ""
            self._reply(request.id, 422, text=f"{error.what}{where}", hint=error.hint)
        except Exception as error:
            log_mistake(error)
            self._reply(request.id, 500, text=OUR_MISTAKE)

    def _notice(self, sentence: str) -> None:
        """Report refused messages, once in a while."""
        now = time.monotonic()
        if now - self._noticed_at >= NOTICE:
            self._noticed_at = now
            self._reply(None, 429, text=sentence)

    def _reply(self, number: int | None, status: int, **parts: Any) -> None:
        # A sentence may repeat what the browser sent.
        parts |= {key: plain(parts[key]) for key in ("text", "hint") if key in parts}
        parts = {key: part for key, part in parts.items() if part != ""}
        self.send(json.dumps({"reply": number, "status": status} | parts, allow_nan=False))
