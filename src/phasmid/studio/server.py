"""The live page's server: one robot, a fixed table of files, and a few browsers."""

from __future__ import annotations

import asyncio
import errno
import functools
import ipaddress
import json
import logging
import re
import secrets
import socket
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from websockets.asyncio.server import ServerConnection, serve

from phasmid.errors import InvalidInput
from phasmid.studio.client import OUR_MISTAKE, Client, log_mistake
from phasmid.studio.door import Door, Reply, refusal
from phasmid.studio.guard import LARGEST, Guard, Head, Refused, read_head
from phasmid.studio.messages import Request

PORT = 8033
"""Where the page is unless it is asked for elsewhere."""

PORTS_TRIED = 10

MOST_BROWSERS = 8

MOST_CONNECTIONS = 64
"""A browser opens up to six to load a page, and one that stays."""

PING, PONG = 5.0, 15.0
"""How often a browser is asked whether it is there, and how long it may take to say so [s]."""

PROTOCOL = 1
"""Of what is said between page and server."""

RUN = re.compile(r"/runs/(r-[0-9a-z]{1,16})/([a-z.]{1,20})")

RUN_FILES = {
    "report.html": "text/html; charset=utf-8",
    "recording.nc": "application/x-netcdf",
    "scenario.toml": "application/toml",
    "robot.toml": "application/toml",
    "summary.json": "application/json",
}

# A report may hold names that others wrote. It brings its own script, which its own policy knows
# by its hash, and is shown as a page from nowhere, so that it can ask nothing of the robot.
RUN_POLICY = (
    "sandbox allow-scripts allow-downloads; default-src 'none'; script-src 'unsafe-inline'; "
    "style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)

log = logging.getLogger("phasmid.studio")


@runtime_checkable
class Live(Protocol):
    """What the server needs of a live robot."""

    def ask(self, request: Request) -> Future[dict[str, Any]]:
        """Hand over a request; it is done between two updates."""

    def hello(self) -> list[str]:
        """JSON that brings a new browser up to date."""

    def viewers(self, count: int) -> None:
        """Tell how many browsers look."""

    def folder(self, run: str) -> Path | None:
        """The folder of a saved run."""


@runtime_checkable
class Asset(Protocol):
    """A file of the page."""

    @property
    def content(self) -> bytes:
        """Its bytes."""

    @property
    def kind(self) -> str:
        """Its media type."""


def listen(host: str, port: int | None) -> socket.socket:
    """A socket that listens.

    Args:
        host: Name or number of this machine; 127.0.0.1 is reached from nowhere else.
        port: None takes the first that is free of ten; 0 any.

    Raises:
        InvalidInput: The port is taken, or there is no such host here.
    """
    family, first = _address(host)
    wanted = range(PORT, PORT + PORTS_TRIED) if port is None else (port,)
    for number in wanted:
        try:
            return socket.create_server((first, number), family=family, backlog=MOST_CONNECTIONS)
        except OSError as error:
            if error.errno == errno.EADDRINUSE:
                continue
            reason = (error.strerror or str(error)).lower()
            raise InvalidInput(f"cannot listen at {host}, port {number}: {reason}.") from None
    if port is None:
        what = f"ports {PORT} to {PORT + PORTS_TRIED - 1} are taken; a free one must be given."
        raise InvalidInput(what, hint="--port 0, which finds one")
    raise InvalidInput(f"port {port} is taken; another must be given.", hint=f"--port {port + 1}")


def _address(host: str) -> tuple[socket.AddressFamily, str]:
    try:
        found = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    except (OSError, UnicodeError):
        what = f'--host is "{host}"; it must be a name or a number of this machine.'
        raise InvalidInput(what, hint="--host 127.0.0.1") from None
    family, _, _, _, address = found[0]
    return family, str(address[0])


def names_of(host: str, port: int) -> tuple[str, ...]:
    """Return values of the header Host that are accepted on every connection; ours is the first.

    Args:
        host: Name or number at which the server listens.
        port: Its port.
    """
    names = [host]
    if is_loopback(host):
        names += ["localhost"]
    elif _number_of(host) is not None and ipaddress.ip_address(host).is_unspecified:
        names = ["127.0.0.1", "localhost", socket.gethostname().lower()]
    return tuple(host_header(name, port) for name in names)


def host_header(host: str, port: int) -> str:
    """Return the header Host that a browser sends for a name or number and a port."""
    shown = f"[{host}]" if ":" in host else host
    return shown if port == 80 else f"{shown}:{port}"


def is_loopback(host: str) -> bool:
    """Whether nothing beyond this machine reaches a host."""
    number = _number_of(_address(host)[1])
    return number is not None and number.is_loopback


def _number_of(host: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        return ipaddress.ip_address(host)
    except ValueError:
        return None


class Server:
    """Shows one live robot to a few browsers.

    Args:
        listening: A socket that listens.
        assets: The page's files, by their names; ``studio.html`` is the page.
        host: As it is called by whoever opens the page.
        token: Asked of each browser; a random one where it is not given.
    """

    def __init__(
        self,
        listening: socket.socket,
        assets: Mapping[str, Asset],
        *,
        host: str = "127.0.0.1",
        token: str = "",
    ) -> None:
        self._socket = listening
        port = listening.getsockname()[1]
        self._names = names_of(host, port)
        self._token = token or secrets.token_urlsafe(32)
        self._guard = Guard(frozenset(self._names), self._token, f"phasmid-{port}")
        self._pages = {
            f"/assets/{name}": Reply(200, asset.content, asset.kind)
            for name, asset in assets.items()
        }
        self._page = self._pages.pop("/assets/studio.html")
        self._clients: set[Client] = set()
        self._doors: dict[Door, None] = {}
        self._loop: asyncio.AbstractEventLoop | None = None
        self._stopped = False
        self._stop: asyncio.Event | None = None

    @property
    def address(self) -> str:
        """What is opened in a browser; whoever knows it may drive."""
        return f"http://{self._names[0]}/?token={self._token}"

    def publish(self, message: str | bytes) -> None:
        """Tell all browsers, from any thread.

        Args:
            message: JSON, or a frame.
        """
        if self._loop is not None:
            # Nobody is told once the loop has ended.
            with suppress(RuntimeError):
                self._loop.call_soon_threadsafe(self._publish, message)

    def stop(self) -> None:
        """End :meth:`serve`, from any thread or a signal's handler."""
        self._stopped = True
        if self._loop is not None:
            with suppress(RuntimeError):
                self._loop.call_soon_threadsafe(self._end)

    async def serve(self, live: Live, opened: Callable[[], None] = lambda: None) -> None:
        """Serve until it is stopped.

        Args:
            live: The robot.
            opened: Called once the page can be opened.
        """
        self._live = live
        self._stop = asyncio.Event()
        self._loop = asyncio.get_running_loop()
        if self._stopped:
            self._stop.set()
        # The library's words are for those who write servers.
        quiet = logging.getLogger("phasmid.studio.websockets")
        quiet.setLevel(logging.CRITICAL)
        door: Any = functools.partial(
            Door, answer=self._answer, doors=self._doors, most=MOST_CONNECTIONS
        )
        async with serve(
            self._talk,
            sock=self._socket,
            create_connection=door,
            # The door has its own patience, which ends with the request's head.
            open_timeout=None,
            close_timeout=0.3,
            ping_interval=PING,
            ping_timeout=PONG,
            # A little above the limit, so that who passes it is told in a sentence.
            max_size=LARGEST + LARGEST // 5,
            max_queue=8,
            # What waits here is out of date when it is read.
            write_limit=8192,
            compression=None,
            server_header=None,
            logger=quiet,
        ) as serving:
            opened()
            await self._stop.wait()
            serving.close()
            # The library's closing is a task, which begins only now.
            await asyncio.sleep(0)
            for door in list(self._doors):
                door.leave()

    def _end(self) -> None:
        if self._stop is not None:
            self._stop.set()

    def _publish(self, message: str | bytes) -> None:
        for client in self._clients:
            if isinstance(message, str):
                client.tell(message)
            else:
                client.show(message)

    def _answer(self, raw: bytes, arrived: tuple[Any, ...]) -> Reply | None:
        """Return the reply to a request that arrived at an address; None accepts its websocket."""
        try:
            head = read_head(raw)
            # A name that somebody else points at this machine is never this number.
            self._guard.check(head, host_header(str(arrived[0]), int(arrived[1])))
            reply = self._route(head)
            return reply and replace(reply, bare=head.method == "HEAD")
        except Refused as refused:
            if refused.reason:
                log.warning("refused %s.", refused.reason)
            return refusal(refused)
        except Exception as error:
            log_mistake(error)
            return Reply(500, f"{OUR_MISTAKE}\n".encode())

    def _route(self, head: Head) -> Reply | None:
        if head.path == "/" and head.query:
            self._guard.check_query(head)
            crumb = f"{self._guard.cookie}={self._token}; Path=/; HttpOnly; SameSite=Strict"
            return Reply(303, headers=(("Location", "/"), ("Set-Cookie", crumb)))
        run = RUN.fullmatch(head.path)
        known = head.path in ("/", "/live") or head.path in self._pages or run
        if not known or head.query:
            raise Refused(404, "there is no such page.")
        if head.path == "/live":
            self._guard.check_page(head)
        self._guard.check_known(head)
        if run:
            return self._file(run[1], run[2])
        if head.path == "/live":
            self._check_room(head)
            return None
        return self._page if head.path == "/" else self._pages[head.path]

    def _file(self, run: str, name: str) -> Reply:
        folder = self._live.folder(run)
        if folder is None:
            raise Refused(404, f"no recording {run}.")
        if name not in RUN_FILES or not (folder / name).is_file():
            raise Refused(404, f"recording {run} has no such file.")
        if name == "report.html":
            return Reply(200, kind=RUN_FILES[name], policy=RUN_POLICY, file=folder / name)
        own = (("Content-Disposition", f'attachment; filename="{folder.name}-{name}"'),)
        return Reply(200, kind=RUN_FILES[name], headers=own, file=folder / name)

    def _check_room(self, head: Head) -> None:
        upgrades = [value.lower() for value in head.values("upgrade")]
        if head.method != "GET" or upgrades != ["websocket"]:
            raise Refused(426, "this is for websockets only.")
        if len(self._clients) >= MOST_BROWSERS:
            raise Refused(429, f"{MOST_BROWSERS} browsers look already; close one of them.")

    async def _talk(self, connection: ServerConnection) -> None:
        client = Client(connection, self._live.ask)
        if len(self._clients) >= MOST_BROWSERS:
            # Several came in at once.
            await connection.close(1013, "too many browsers")
            return
        # From here on it is told what happens; what it is greeted with comes first all the same.
        self._clients.add(client)
        try:
            self._live.viewers(len(self._clients))
            texts = await asyncio.to_thread(self._live.hello)
            await client.serve([_hello(), *texts])
        except Exception as error:
            log_mistake(error)
        finally:
            self._clients.discard(client)
            self._live.viewers(len(self._clients))


def _hello() -> str:
    return json.dumps({"hello": {"version": version("phasmid"), "protocol": PROTOCOL}})
