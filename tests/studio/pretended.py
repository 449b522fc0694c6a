"""A robot that only records what it was asked, behind the real server on a real socket."""

import json
import queue
import threading
from concurrent.futures import Future
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from http.client import HTTPConnection

from websockets.sync.client import connect

from phasmid.studio.server import Server, listen

TOKEN = "right-token"


@dataclass
class PretendedStage:
    """Records what happens to it; gives `answer` at once."""

    folders: dict = field(default_factory=dict)
    answer: object = None
    asked: queue.Queue = field(default_factory=queue.Queue)
    looking: queue.Queue = field(default_factory=queue.Queue)

    def submit(self, request):
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

    def get(self, path, *, method="GET", cookie=None, host=None, to="127.0.0.1", **headers):
        """Request a page with the right host and cookie, or with others."""
        with closing(HTTPConnection(to, self.port, timeout=20)) as end:
            end.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
            for value in [host or self.host] if isinstance(host, str | None) else host:
                end.putheader("Host", value)
            if cookie != "":
                end.putheader("Cookie", cookie or self.cookie)
            for key, value in headers.items():
                end.putheader(key.replace("_", "-"), value)
            end.endheaders()
            return Answer(end.getresponse())

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
    """A response of HTTP."""

    def __init__(self, response):
        self.status, self.body = response.status, response.read()
        self.headers = {name.lower(): value for name, value in response.getheaders()}
        self.text = self.body.decode("utf-8", errors="replace").strip()


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
def running(stage=None, listening=None, **options):
    """A server with a pretended robot, until the block ends."""
    stage = stage or PretendedStage()
    listening = listening or listen("127.0.0.1", 0)
    with listening:
        server = Server(listening, token=TOKEN, **options)
        opened = threading.Event()
        serving = threading.Thread(target=server.run, args=(stage, opened.set))
        serving.start()
        try:
            assert opened.wait(20)
            yield Running(server, stage, listening)
        finally:
            server.stop()
            serving.join(20)
            assert not serving.is_alive()
