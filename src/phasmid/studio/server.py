"""Server of the live page: a Starlette application that uvicorn runs.

A robot, the page's files and saved runs go in; up to eight browsers watch and drive. The command
``phasmid studio`` runs it.
"""

from __future__ import annotations

import asyncio
import errno
import json
import logging
import secrets
import socket
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import uvicorn
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import Request as HTTPRequest
from starlette.responses import FileResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from phasmid.errors import InvalidInput
from phasmid.reporting.webpage import DRAWING, own_text
from phasmid.studio.browser import OUR_MISTAKE, Browser, log_mistake
from phasmid.studio.connection import MOST_CONNECTIONS, Connection, report_loop_error
from phasmid.studio.guard import Guard, address_of, names_of, refusal
from phasmid.studio.messages import LARGEST

if TYPE_CHECKING:
    from phasmid.studio.live_simulation import LiveSimulation

PORT, PORTS_TRIED = 8033, 10
"""Default port, and how many are tried from it on."""

MOST_BROWSERS = 8

PING, PONG = 5.0, 15.0
"""Interval of the pings to a browser, and the time in which it must answer [s]."""

SENT_AHEAD = 32_768
"""Bytes that the system may hold for a slow reader; frames there are out of date."""

MEDIA_TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}

RUN_FILES = ("report.html", "recording.nc", "scenario.toml", "robot.toml", "summary.json")

# A report may hold names from foreign files. Its sandbox gives it an origin of its own, so that
# it cannot reach the robot.
RUN_POLICY = (
    "sandbox allow-scripts allow-downloads; default-src 'none'; script-src 'unsafe-inline'; "
    "style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)


def listen(host: str, port: int | None) -> socket.socket:
    """Open a listening socket.

    Args:
        host: Name or number of this machine; 127.0.0.1 is reached from nowhere else.
        port: None takes the first free one of ten; 0 any.

    Raises:
        InvalidInput: The port is taken, or the host is not of this machine.
    """
    family, address = address_of(host)
    for number in range(PORT, PORT + PORTS_TRIED) if port is None else (port,):
        try:
            return socket.create_server((address, number), family=family)
        except OSError as error:
            if error.errno == errno.EADDRINUSE:
                continue
            reason = (error.strerror or str(error)).lower()
            raise InvalidInput(f"cannot listen at {host}, port {number}: {reason}.") from None
    if port is None:
        what = f"ports {PORT} to {PORT + PORTS_TRIED - 1} are taken; a free one must be given."
        raise InvalidInput(what, hint="--port 0, which finds one")
    raise InvalidInput(
        f"port {port} is taken; another must be given.", hint="--port 0, which finds one"
    )


def page_files() -> dict[str, str]:
    """Return the texts of the page's files by their names; ``studio.html`` is the page."""
    own = {path.name: path.read_text("utf-8") for path in Path(__file__).parent.glob("page/*.*")}
    return own | {name: own_text(name) for name in ("colours.css", "plotting.js", *DRAWING)}


async def _report_mistake(_: HTTPRequest, error: Exception) -> Response:
    log_mistake(error)
    return refusal(500, OUR_MISTAKE)


class Server:
    """Server of one live robot.

    Args:
        listening: Listening socket.
        host: Host of the printed address.
        token: Secret of the printed address; random by default.
    """

    def __init__(
        self, listening: socket.socket, *, host: str = "127.0.0.1", token: str = ""
    ) -> None:
        # Accepted connections inherit it.
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SENT_AHEAD)
        self._socket = listening
        port = listening.getsockname()[1]
        self._names = names_of(host, port)
        self._token = token or secrets.token_urlsafe(32)
        guard = Middleware(
            Guard, hosts=frozenset(self._names), token=self._token, cookie=f"phasmid-{port}"
        )
        self._files = page_files()
        self._browsers: set[Browser] = set()
        self._loop: asyncio.AbstractEventLoop | None = None
        app = Starlette(
            lifespan=self._lifespan,
            exception_handlers={Exception: _report_mistake},
            routes=[
                Route("/", self._file),
                Route("/assets/{name}", self._file),
                Route("/runs/{run}/{name}", self._run_file),
                WebSocketRoute("/live", self._talk),
            ],
            middleware=[guard],
        )
        app.router.redirect_slashes = False
        self._server = uvicorn.Server(
            uvicorn.Config(
                app,
                loop="asyncio",
                lifespan="on",
                proxy_headers=False,
                http=Connection,
                # As many are accepted at a time, before the first is counted.
                backlog=MOST_CONNECTIONS,
                ws="websockets-sansio",
                ws_ping_interval=PING,
                ws_ping_timeout=PONG,
                # Above the limit of a message, so that it is refused in a sentence.
                ws_max_size=LARGEST + LARGEST // 5,
                ws_per_message_deflate=False,
                timeout_graceful_shutdown=1,
                server_header=False,
                access_log=False,
                log_config=None,
                log_level=logging.CRITICAL,
            )
        )

    @property
    def address(self) -> str:
        """Address to open in a browser, with the token that allows to drive."""
        return f"http://{self._names[0]}/?token={self._token}"

    def run(self, live: LiveSimulation, opened: Callable[[], None] = lambda: None) -> None:
        """Serve until `stop`, or until a signal ends the main thread.

        Args:
            live: Robot.
            opened: Called once the page can be opened.
        """
        self._live, self._opened = live, opened
        self._server.run(sockets=[self._socket])

    @asynccontextmanager
    async def _lifespan(self, _: Starlette) -> AsyncIterator[None]:
        self._loop = asyncio.get_running_loop()
        self._loop.set_exception_handler(report_loop_error)
        # The socket listens already: requests wait until the server accepts them.
        self._opened()
        yield

    def stop(self) -> None:
        """End :meth:`run`, from any thread."""
        self._server.should_exit = True

    def publish(self, message: str | bytes) -> None:
        """Send a text or a frame to all browsers, from any thread."""
        if self._loop is not None:
            # The loop may have closed.
            with suppress(RuntimeError):
                self._loop.call_soon_threadsafe(self._publish, message)

    def _publish(self, message: str | bytes) -> None:
        for browser in self._browsers:
            browser.send(message)

    async def _file(self, request: HTTPRequest) -> Response:
        name = request.path_params.get("name", "studio.html")
        if name not in self._files:
            return refusal(404, "there is no such page.")
        return Response(self._files[name], media_type=MEDIA_TYPES[Path(name).suffix])

    async def _run_file(self, request: HTTPRequest) -> Response:
        run, name = request.path_params["run"], request.path_params["name"]
        folder = self._live.folder(run)
        if folder is None:
            return refusal(404, f"no recording {run}.")
        if name not in RUN_FILES or not (folder / name).is_file():
            return refusal(404, f"recording {run} has no such file.")
        if name == "report.html":
            return FileResponse(folder / name, headers={"Content-Security-Policy": RUN_POLICY})
        return FileResponse(folder / name, filename=f"{folder.name}-{name}")

    async def _talk(self, websocket: WebSocket) -> None:
        if len(self._browsers) >= MOST_BROWSERS:
            full = f"{MOST_BROWSERS} browsers look already; close one of them."
            await websocket.send_denial_response(refusal(429, full))
            return
        browser = Browser(websocket, self._live.submit)
        # Texts from here on come after the greeting.
        self._browsers.add(browser)
        try:
            await websocket.accept()
            self._live.viewers(len(self._browsers))
            hello = json.dumps({"hello": {"version": version("phasmid")}})
            await browser.serve([hello, *self._live.hello()])
        except OSError:
            # The browser left during the handshake.
            return
        finally:
            self._browsers.discard(browser)
            self._live.viewers(len(self._browsers))
