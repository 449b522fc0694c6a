"""Each command once in a terminal of 80 columns, and once in a pipe."""

import os
import re
import signal
import struct
import sys
import threading
from contextlib import contextmanager

import pytest

from phasmid.cli import main
from phasmid.paper.document import Graded
from phasmid.paper.reproduction import STATEMENTS
from phasmid.paper.statement import Finding, Grade
from studio.pretended import PretendedStage

WALK = ["--duration", "0.1", "--no-figures", "--out", "out"]

COMMANDS = {
    "walk": ["walk", *WALK],
    "drive": ["drive", "--velocity", "0.05,0,0", *WALK],
    "video": ["walk", *WALK, "--video", "out.gif"],
    "studio": ["studio", "--port", "0", "--no-open"],
    "paper": ["paper"],
    "figures": ["report", "run", "--figures", "joint-torque"],
}

SHOWN = {
    "walk": ("walking", "COMPLETED", "torque"),
    "drive": ("walking", "COMPLETED", "torque"),
    "video": ("walking", "filming", "COMPLETED"),
    "studio": ("The robot is at", "the studio is closed"),
    "paper": ("simulating", "the paper says", "statements"),
    "figures": ("joint-torque.svg",),
}
"""Words of each command's output on a terminal."""

COLOUR = re.compile(r"\x1b\[[0-9;]*3[0-9]")
CONTROL = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


class Stage(PretendedStage):
    """A pretended robot; Ctrl-C comes a little after its start."""

    def __init__(self, scenario, *, out, publish):
        super().__init__()

        self.timer = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))

    def start(self):
        self.timer.start()

    def close(self, longest):
        self.timer.cancel()
        return True


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A folder with a short run in it."""
    folder = tmp_path_factory.mktemp("recorded") / "run"
    options = ["--duration", "0.1", "--no-figures", "--quiet", "--out", str(folder)]
    assert main(["walk", *options]) == 0
    return folder


@pytest.fixture
def here(tmp_path, recorded, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "run").symlink_to(recorded)
    for name in ("COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setattr("phasmid.studio.live_simulation.LiveSimulation", Stage)
    monkeypatch.setattr("phasmid.paper.reproduction.reproduce", graded)
    return tmp_path


def graded(folder, *, force, announce):
    """The paper's statements with a grade for each; its walks take half a minute."""
    announce("simulating")
    finding = Finding("0.1 mm", Grade.HOLDS)
    return {name: [Graded(one, finding) for one in all_] for name, all_ in STATEMENTS.items()}


@contextmanager
def streams(monkeypatch, write, read):
    """Both streams write to a descriptor; the text arrives in the list that is yielded."""
    text, parts = [], []

    def collect():
        # A terminal whose other end is closed raises an OSError.
        try:
            while part := os.read(read, 65536):
                parts.append(part)
        except OSError:
            pass
        text.append(b"".join(parts).decode())

    reader = threading.Thread(target=collect)
    reader.start()
    with os.fdopen(write, "w", encoding="utf-8", buffering=1) as stream:
        monkeypatch.setattr(sys, "stdout", stream)
        monkeypatch.setattr(sys, "stderr", stream)
        yield text
        monkeypatch.undo()
    reader.join()
    os.close(read)


@pytest.mark.parametrize(
    ("command", "change"),
    [
        *[(command, {}) for command in COMMANDS],
        ("walk", {"NO_COLOR": "1"}),
        ("paper", {"TERM": None}),
        ("walk", {"COLUMNS": "0"}),
        ("figures", {"COLUMNS": "²"}),
    ],
)
def test_every_command_ends_well_on_a_terminal(command, change, here, monkeypatch):
    pty, fcntl = pytest.importorskip("pty"), pytest.importorskip("fcntl")
    import termios

    read, write = pty.openpty()
    fcntl.ioctl(write, termios.TIOCSWINSZ, struct.pack("HHHH", 40, 80, 0, 0))
    for name, value in change.items():
        monkeypatch.delenv(name) if value is None else monkeypatch.setenv(name, value)
    with streams(monkeypatch, write, read) as text:
        status = main(COMMANDS[command])
    shown = " ".join(CONTROL.sub("", text[0]).split())
    assert status == 0, shown
    for words in SHOWN[command]:
        assert words in shown
    if "NO_COLOR" in change:
        assert not COLOUR.search(text[0])


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_ends_well_in_a_pipe(command, here, monkeypatch):
    read, write = os.pipe()
    with streams(monkeypatch, write, read) as text:
        status = main(COMMANDS[command])
    assert status == 0, text[0]
    assert SHOWN[command][-1] in " ".join(text[0].split())
    assert "\x1b" not in text[0]
    assert "%" not in text[0].partition("Walked?")[0]
