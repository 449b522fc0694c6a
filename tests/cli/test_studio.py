"""``phasmid studio`` opens the page of a live robot, and ends when it is told to."""

import os
import signal
import socket
import threading
import urllib.request
import webbrowser

import pytest

from phasmid.cli import main, studio
from phasmid.interrupts import STOP_SIGNALS
from phasmid.studio import server
from phasmid.studio.guard import names_of
from phasmid.studio.server import listen
from studio.pretended import PretendedStage


class Stage(PretendedStage):
    """A pretended robot that can be started and put away."""

    made: list = []

    def __init__(self, scenario, *, out, publish):
        super().__init__()
        self.scenario, self.out, self.publish = scenario, out, publish
        self.lives = None
        self.made.append(self)

    def start(self):
        self.lives = True

    def close(self, longest):
        self.lives = False
        return True


@pytest.fixture
def stage(monkeypatch):
    # A first start compiles the controller, which is no matter of the command.
    monkeypatch.setattr("phasmid.studio.live_simulation.LiveSimulation", Stage)
    monkeypatch.setattr("phasmid.control.compilation.are_compiled", lambda: True)
    monkeypatch.setenv("DISPLAY", ":0")
    Stage.made.clear()
    return Stage


def opened(monkeypatch, then):
    """What a browser would do with the address, in its own thread as the command starts it."""
    seen = []

    def look(address):
        try:
            with urllib.request.build_opener(
                urllib.request.ProxyHandler({}), urllib.request.HTTPCookieProcessor()
            ).open(address, timeout=20) as page:
                seen.append((address, page.status, page.url, page.read()))
        finally:
            then()

    monkeypatch.setattr(webbrowser, "open", look)
    return seen


def interrupt(number=signal.SIGINT):
    os.kill(os.getpid(), number)


NUMBERS = [getattr(signal, name) for name in STOP_SIGNALS if hasattr(signal, name)]


@pytest.mark.parametrize("number", NUMBERS)
def test_it_opens_the_page_and_ends_at_a_signal(number, stage, monkeypatch, tmp_path, capsys):
    before = [signal.getsignal(one) for one in NUMBERS]
    seen = opened(monkeypatch, lambda: interrupt(number))
    options = ["--port", "0", "--out", str(tmp_path / "kept"), "--gait", "wave"]
    assert main(["studio", "paper", *options]) == 0
    [(address, status, url, page)] = seen
    assert (status, url) == (200, address.partition("?")[0])
    assert b"<!doctype html>" in page.lower()
    told = capsys.readouterr().out.splitlines()
    assert told == [
        f"The robot is at {address}",
        "Ctrl-C ends it.",
        "phasmid: the studio is closed.",
    ]
    [made] = stage.made
    assert made.lives is False
    assert made.out == tmp_path / "kept"
    assert made.scenario.load_gait().name == "wave"
    assert [signal.getsignal(one) for one in NUMBERS] == before


@pytest.mark.parametrize("number", NUMBERS)
@pytest.mark.parametrize("moment", ["__init__", "start", "close"])
def test_a_signal_at_any_moment_ends_it_in_the_same_way(moment, number, stage, monkeypatch):
    # Between its first thread and its last, where an exception would leave something behind.
    usual = getattr(Stage, moment)

    def interrupted(self, *args, **options):
        interrupt(number)
        interrupt(number)
        return usual(self, *args, **options)

    monkeypatch.setattr(Stage, moment, interrupted)
    if moment == "close":
        monkeypatch.setattr(Stage, "start", lambda self: interrupt())
    assert main(["studio", "--no-open", "--port", "0"]) == 0
    assert stage.made[0].lives is False


def test_a_robot_that_is_being_built_is_not_waited_for(stage, monkeypatch, capsys):
    waited = []
    monkeypatch.setattr(Stage, "close", lambda self, longest: bool(waited.append(longest)))
    opened(monkeypatch, interrupt)
    assert main(["studio", "--port", "0"]) == 130
    assert waited == [studio.LONGEST_CLOSE]
    assert capsys.readouterr().err == "phasmid: stopped.\n"


@pytest.mark.parametrize("given", ["--no-open", "no display"])
def test_no_browser_is_opened_where_none_is_wanted(given, stage, monkeypatch):
    asked = []
    monkeypatch.setattr(webbrowser, "open", asked.append)
    monkeypatch.setattr(Stage, "start", lambda self: threading.Timer(0.2, interrupt).start())
    if given == "no display":
        monkeypatch.delenv("DISPLAY")
        monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
        monkeypatch.setattr("sys.platform", "linux")
    options = ["--no-open"] if given == "--no-open" else []
    assert main(["studio", "--port", "0", *options]) == 0
    assert asked == []


def test_a_port_that_is_taken_is_named_where_it_was_asked_for(stage, capsys):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert main(["studio", "--no-open", "--port", str(port)]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"phasmid: port {port} is taken; another must be given.\n  try  --port ")


def test_else_the_next_port_is_taken(monkeypatch):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        monkeypatch.setattr(server, "PORT", port)
        with listen("127.0.0.1", None) as found:
            assert port < found.getsockname()[1] < port + server.PORTS_TRIED
        monkeypatch.setattr(server, "PORTS_TRIED", 1)
        with pytest.raises(Exception, match=f"ports {port} to {port} are taken"):
            listen("127.0.0.1", None)


def test_a_page_beyond_this_machine_is_warned_of(stage, monkeypatch, capsys):
    # It listens here all the same: a test opens no door.
    monkeypatch.setattr(server, "listen", lambda host, port: listen("127.0.0.1", port))
    monkeypatch.setattr(Stage, "start", lambda self: threading.Timer(0.2, interrupt).start())
    assert main(["studio", "--no-open", "--port", "0", "--host", "0.0.0.0"]) == 0
    said = "others on the network can reach 0.0.0.0; the address lets them drive."
    assert capsys.readouterr().err == f"phasmid: note: {said}\n"


def test_the_names_by_which_a_browser_may_call_it_are_few():
    assert names_of("127.0.0.1", 8033) == ("127.0.0.1:8033", "localhost:8033")
    assert names_of("::1", 8033) == ("[::1]:8033", "localhost:8033")
    assert names_of("192.0.2.1", 8033) == ("192.0.2.1:8033",)
    # Browsers leave out the port that is usual.
    assert names_of("127.0.0.1", 80) == ("127.0.0.1", "localhost")
    wide = names_of("0.0.0.0", 8033)
    assert wide[:2] == ("127.0.0.1:8033", "localhost:8033")
    assert f"{socket.gethostname().lower()}:8033" in wide
    assert "0.0.0.0:8033" not in wide
