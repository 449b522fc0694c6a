"""Connections of HTTP, each with a time limit for its next request, and few at a time."""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

from phasmid.studio.browser import log_mistake

LONGEST_HEAD = 10.0
"""Longest time without a whole request [s]; uvicorn limits only the time without a byte."""

LONGEST_FLUSH = 60.0
"""Longest time in which a browser takes the rest of a response [s]: 10 MB at 170 kB/s."""

MOST_CONNECTIONS = 64
"""Most connections: eight browsers with six each, and some."""


class Connection(H11Protocol):
    """Connection that ends when no whole request comes in time.

    Above `MOST_CONNECTIONS` the one that has waited longest gives way. uvicorn's own
    ``limit_concurrency`` refuses requests, but keeps connections that send none.
    """

    _deadline: asyncio.TimerHandle | None = None
    _since = 0.0

    def connection_made(self, transport: Any) -> None:
        """Begin to wait for a request; end another connection if there are too many."""
        super().connection_made(transport)
        self._wait()
        connections = [c for c in self.connections if not c.transport.is_closing()]
        others = [c for c in connections if isinstance(c, Connection) and c is not self]
        if others and len(connections) > MOST_CONNECTIONS:
            min(others, key=lambda c: (not c._is_idle, c._since)).transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the time limit."""
        self._stop_waiting()
        super().connection_lost(exc)

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Leave the connection to the websocket, which has limits of its own."""
        self._stop_waiting()
        super().handle_websocket_upgrade(event)

    def on_response_complete(self) -> None:
        """Begin to wait for the next request."""
        super().on_response_complete()
        self._wait()

    @property
    def _is_idle(self) -> bool:
        cycle: Any = self.cycle
        return cycle is None or bool(cycle.response_complete)

    def _wait(self) -> None:
        self._stop_waiting()
        self._since = self.loop.time()
        self._deadline = self.loop.call_later(LONGEST_HEAD, self._give_up)

    def _stop_waiting(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()

    def _give_up(self) -> None:
        if self._is_idle:
            # A slow reader still gets what was written.
            self.transport.close()
            self.loop.call_later(LONGEST_FLUSH, self.transport.abort)


def report_loop_error(_: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Log an error of the event loop, unless it is one of a connection or of the system.

    Without open files left, asyncio reports each connection that it cannot accept.
    """
    error = context.get("exception")
    if isinstance(error, Exception) and not isinstance(error, OSError):
        log_mistake(error)
