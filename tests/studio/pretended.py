"""A robot that only says what it was asked, behind the real server on a real socket."""

import asyncio
import json
import queue
import socket
import threading
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass, field

from websockets.sync.client import connect

from phasmid.studio.server import Server, listen

TOKEN = "right-token"


@dataclass
class Asset:
    content: bytes
    kind: str


ASSETS = {
    "studio.html": Asset(b"<!doctype html><title>studio</title>", "text/html; charset=utf-8"),
    "studio.js": Asset(b"'use strict';", "text/javascript; charset=utf-8"),
}


@dataclass
class PretendedStage:
    """Notes what happens to it; answers at once unless it is told what to answer."""

    folders: dict = field(default_factory=dict)
    answer: object = None
    asked: queue.Queue = field(default_factory=queue.Queue)
    looking: queue.Queue = field(default_factory=queue.Queue)

    def ask(self, request):
        self.asked.put(request)
        if isinstance(self.answer, Future):
            return self.answer
        future = Future()
        if isinstance(self.answer, Exception):
            future.set_exception(self.answer)
        else:
            future.set_result(self.answer or {})
        return future

    def hello(self):
        return ['{"catalogue": {}}', '{"state": {}}']

    def viewers(self, count):
        self.looking.put(count)

    def folder(self, run):
        return self.folders.get(run)


class Running:
    """A server in a thread of its own."""

    def __init__(self, server, stage, listening):
        self.server, self.stage = server, stage
        self.bound = listening.getsockname()
        self.port = self.bound[1]
        self.host = f"127.0.0.1:{self.port}"
        self.origin = f"http://{self.host}"
        self.cookie = f"phasmid-{self.port}={TOKEN}"

    def raw(self, data, *, timeout=20, to="127.0.0.1"):
        """Send bytes and read until the other side closes."""
        with socket.create_connection((to, self.port), timeout) as end:
            end.sendall(data)
            return everything(end)

    def get(self, path, *, method="GET", cookie=None, host=None, **headers):
        """Ask for a page with the right host and cookie, or with others."""
        told = {"Host": self.host if host is None else host}
        told["Cookie"] = self.cookie if cookie is None else cookie
        told |= {key.replace("_", "-"): value for key, value in headers.items()}
        lines = [f"{method} {path} HTTP/1.1", *(f"{k}: {v}" for k, v in told.items() if v)]
        return Answer(self.raw("\r\n".join([*lines, "", ""]).encode("latin-1")))

    @contextmanager
    def connect(self, **options):
        """A browser's websocket, past its greeting."""
        with self.open(**options) as page:
            for _ in range(3):
                page.recv(timeout=20)
            yield page

    def open(self, *, origin=None, cookie=None, **options):
        given = self.cookie if cookie is None else cookie
        return connect(
            f"ws://{self.host}/live",
            origin=self.origin if origin is None else origin or None,
            additional_headers={"Cookie": given} if given else {},
            compression=None,
            max_size=None,
            proxy=None,
            **options,
        )


class Answer:
    """A reply of HTTP, taken apart."""

    def __init__(self, data):
        head, _, self.body = data.partition(b"\r\n\r\n")
        first, *lines = head.decode("latin-1").split("\r\n")
        self.status = int(first.split(" ")[1])
        self.headers = {
            name.lower(): value for name, _, value in (line.partition(": ") for line in lines)
        }
        self.text = self.body.decode("utf-8", errors="replace").strip()


def everything(end):
    """What a socket tells until it ends."""
    parts = []
    while part := end.recv(65536):
        parts.append(part)
    return b"".join(parts)


def say(page, **message):
    """Send a message and read its reply."""
    page.send(json.dumps(message))
    return reply(page)


def reply(page):
    """The next reply, past frames and what all are told."""
    while True:
        message = page.recv(timeout=20)
        if isinstance(message, str) and "reply" in (told := json.loads(message)):
            return told


@contextmanager
def running(stage=None, listening=None, assets=None, **options):
    """A server with a pretended robot, until the block ends."""
    stage = stage or PretendedStage()
    listening = listening or listen("127.0.0.1", 0)
    server = Server(listening, assets or ASSETS, token=TOKEN, **options)
    opened = threading.Event()
    serving = threading.Thread(target=lambda: asyncio.run(server.serve(stage, opened.set)))
    serving.start()
    try:
        assert opened.wait(20)
        yield Running(server, stage, listening)
    finally:
        server.stop()
        serving.join(20)
        assert not serving.is_alive()
