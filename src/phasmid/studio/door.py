"""One connection of a browser: its request is judged, then answered or let in as a websocket."""

from __future__ import annotations

import asyncio
import email.utils
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from http import HTTPStatus
from pathlib import Path
from socket import SO_SNDBUF, SOL_SOCKET
from typing import Any

from websockets.asyncio.server import ServerConnection

from phasmid.studio.guard import LARGEST_HEAD, Refused

PATIENCE = 5.0
"""How long a browser may take to say what it wants [s]."""

LONGEST_REPLY = 600.0
"""How long a browser may take to read a file [s]."""

FAREWELL = 5.0
"""How long a browser that has been answered may take to go [s]."""

KEPT = 32_768
"""Bytes that the system may keep for a slow reader; what it keeps of frames is out of date."""

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


@dataclass(frozen=True, slots=True)
class Reply:
    """What is answered to a request.

    Attributes:
        status: Of HTTP.
        content: The body.
        kind: Its media type.
        headers: Beyond those that all have.
        policy: What a page may do.
        file: Sent instead of the content.
        bare: Whether the body is only told of.
    """

    status: int
    content: bytes = field(default=b"", repr=False)
    kind: str = "text/plain; charset=utf-8"
    headers: tuple[tuple[str, str], ...] = ()
    policy: str = POLICY
    file: Path | None = None
    bare: bool = False

    def head(self, size: int) -> bytes:
        """The line and the headers."""
        lines = [
            f"HTTP/1.1 {self.status} {HTTPStatus(self.status).phrase}",
            f"Date: {email.utils.formatdate(usegmt=True)}",
            f"Content-Type: {self.kind}",
            f"Content-Length: {size}",
            "Connection: close",
            "Cache-Control: no-store",
            f"Content-Security-Policy: {self.policy}",
            "Cross-Origin-Resource-Policy: same-origin",
            "Referrer-Policy: no-referrer",
            "X-Content-Type-Options: nosniff",
            *(f"{name}: {value}" for name, value in self.headers),
        ]
        return "".join(f"{line}\r\n" for line in [*lines, ""]).encode("latin-1")


def refusal(refused: Refused) -> Reply:
    """The reply that says no."""
    headers = {405: (("Allow", "GET, HEAD"),), 426: (("Upgrade", "websocket"),)}
    text = f"{refused.text}\n".encode()
    return Reply(refused.status, text, headers=headers.get(refused.status, ()))


class Door(ServerConnection):
    """A connection that is HTTP until it is let in.

    The library's own reading of requests would answer to no other method than GET, hold a file
    in memory, and cut off who reads one for long.

    Args:
        arguments: Of a connection of the library.
        answer: Returns the reply to a head and the address at which it arrived; None lets a
            websocket in.
        doors: All open connections, the oldest first; this one adds itself.
        most: How many there may be; then the oldest that waits for nothing is closed.
    """

    def __init__(
        self,
        *arguments: Any,
        answer: Callable[[bytes, tuple[Any, ...]], Reply | None],
        doors: dict[Door, None],
        most: int,
        **options: Any,
    ) -> None:
        super().__init__(*arguments, **options)
        self._answer, self._doors, self._most = answer, doors, most
        self._head = bytearray()
        self._is_inside = self._is_answered = self._has_ended = False
        self._replying: asyncio.Task[None] | None = None
        self._patience: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin to wait for the request."""
        super().connection_made(transport)
        transport.get_extra_info("socket").setsockopt(SOL_SOCKET, SO_SNDBUF, KEPT)
        self._doors[self] = None
        if not self.server.is_serving():
            self.transport.abort()
            return
        self._patience = self.loop.call_later(PATIENCE, self._lose_patience)
        if len(self._doors) > self._most and not self._close_oldest():
            self._reply(refusal(Refused(503, "too many connections; close some pages.")))

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        self._doors.pop(self, None)
        self._be_patient()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Gather the head; whoever is inside speaks as a websocket does."""
        if self._is_inside:
            super().data_received(data)
            return
        if self._replying is not None:
            # What comes after a request that has been answered is of no interest.
            return
        self._head += data
        end = self._head.find(b"\r\n\r\n")
        if end > LARGEST_HEAD or (end < 0 and len(self._head) > LARGEST_HEAD):
            said = f"the head of a request is longer than {LARGEST_HEAD} bytes."
            self._reply(refusal(Refused(431, said)))
        elif end >= 0:
            reply = self._answer(bytes(self._head[: end + 4]), self.local_address)
            if reply is not None:
                self._reply(reply)
                return
            self._be_patient()
            self._is_inside = True
            super().data_received(bytes(self._head))
            self._head.clear()

    def eof_received(self) -> bool:  # type: ignore[override]
        """Finish the answer to who will say no more."""
        if self._replying is None:
            super().eof_received()
            return False
        self._has_ended = True
        return not self._is_answered

    def _close_oldest(self) -> bool:
        """Close the oldest connection without a request, or with its answer; False: none is."""
        for other in self._doors:
            done = other._replying is None or other._is_answered
            if other is not self and done and not other._is_inside:
                del self._doors[other]
                other.transport.abort()
                return True
        return False

    def leave(self) -> None:
        """Close at once, unless a websocket is to be closed as websockets are."""
        if not self._is_inside:
            self.transport.abort()

    def _be_patient(self) -> None:
        if self._patience is not None:
            self._patience.cancel()

    def _lose_patience(self) -> None:
        self._reply(refusal(Refused(408, "the request took too long.")))

    def _reply(self, reply: Reply) -> None:
        self._be_patient()
        self._head.clear()
        if self._replying is None:
            self._replying = self.loop.create_task(self._send_reply(reply))

    async def _send_reply(self, reply: Reply) -> None:
        try:
            async with asyncio.timeout(LONGEST_REPLY):
                await self._send_body(reply)
            self._is_answered = True
            if self._has_ended:
                self.transport.close()
            else:
                # To close while bytes still come in would take the answer away from who sends.
                self.transport.write_eof()
            async with asyncio.timeout(FAREWELL):
                await asyncio.shield(self.connection_lost_waiter)
        except (OSError, RuntimeError):
            # Whoever asked has gone, or does not read.
            pass
        finally:
            self.transport.abort()

    async def _send_body(self, reply: Reply) -> None:
        if reply.file is None:
            body = b"" if reply.bare else reply.content
            self.transport.write(reply.head(len(reply.content)) + body)
            await self.drain()
            return
        # It is not read into memory: recordings are large.
        with reply.file.open("rb") as file:
            size = reply.file.stat().st_size
            self.transport.write(reply.head(size))
            if not reply.bare and size:
                with suppress(ConnectionError):
                    await self.loop.sendfile(self.transport, file, 0, size)
