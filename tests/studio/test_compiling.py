"""Who waits for the compiler: another process, and only where it helps."""

import sys
import threading
import time

import pytest

from phasmid.compiled import is_kept
from phasmid.studio import compiling


@pytest.fixture
def cold(monkeypatch):
    """Nothing is compiled yet; the other process runs what it is given, in place of our own."""
    monkeypatch.setattr(compiling, "are_compiled", lambda: False)
    monkeypatch.setattr(compiling, "is_kept", lambda function: True)

    def runs(code):
        monkeypatch.setattr(compiling, "COMMAND", [sys.executable, "-c", code])

    return runs


def test_the_other_process_is_waited_for(cold, tmp_path):
    made = tmp_path / "made"
    cold(f"import time, pathlib; time.sleep(0.3); pathlib.Path({str(made)!r}).write_text('code')")
    compiling.compile_beside(threading.Event())
    assert made.read_text() == "code"


def test_who_closes_does_not_wait_for_it(cold):
    cold("import time; time.sleep(60)")
    closing = threading.Event()
    threading.Timer(0.2, closing.set).start()
    begin = time.monotonic()
    compiling.compile_beside(closing)
    assert time.monotonic() - begin < 30


@pytest.mark.parametrize("command", [[sys.executable, "-c", "1 / 0"], ["/nowhere/python"]])
def test_one_that_fails_does_no_harm(cold, command, monkeypatch):
    monkeypatch.setattr(compiling, "COMMAND", command)
    compiling.compile_beside(threading.Event())


@pytest.mark.parametrize("lacking", ["cold", "cache"])
def test_there_is_none_where_it_would_not_help(cold, lacking, monkeypatch, tmp_path):
    begun = tmp_path / "begun"
    cold(f"import pathlib; pathlib.Path({str(begun)!r}).touch()")
    if lacking == "cold":
        monkeypatch.setattr(compiling, "are_compiled", lambda: True)
    else:
        monkeypatch.setattr(compiling, "is_kept", lambda function: False)
    compiling.compile_beside(threading.Event())
    assert not begun.exists()


def test_its_own_command_lets_a_robot_walk_with_each_drive(monkeypatch):
    walked = []
    real = compiling.LiveRobot

    def live(setting):
        walked.append(setting.scenario.simulation.drive)
        return real(setting)

    monkeypatch.setattr(compiling, "LiveRobot", live)
    compiling.main()
    assert walked == ["prescribed", "ideal-servo", "servo", "torque", "torque"]
    assert compiling.COMMAND[-1] == compiling.__name__


def test_what_is_kept_for_others():
    assert not is_kept(len)
    numba = pytest.importorskip("numba")
    assert not is_kept(numba.njit(lambda x: x))
    assert all(is_kept(loop) for loop in compiling.FUNCTIONS)
