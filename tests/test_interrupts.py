import errno
import signal
import subprocess
import sys
import time
import weakref
from contextlib import suppress

import pytest

from phasmid import cli, interrupts
from phasmid.interrupts import STOP_SIGNALS, StopSignals, held_signals

SIGNALS = [getattr(signal, name) for name in STOP_SIGNALS if hasattr(signal, name)]


class Thing:
    pass


def swallow(number):
    """Raise a signal in the callback of a weak reference, where Python ignores exceptions."""
    thing = Thing()
    reference = weakref.ref(thing, lambda _: signal.raise_signal(number))
    del thing
    assert reference() is None


@pytest.mark.parametrize("number", SIGNALS)
def test_each_signal_raises_and_is_noted(number):
    before = signal.getsignal(number)
    with StopSignals() as signals:
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(number)
        assert signals.noticed == [number]
    assert signal.getsignal(number) == before


@pytest.mark.parametrize("number", SIGNALS)
def test_an_exception_that_python_swallows_is_raised_again_and_not_printed(number, capsys):
    with StopSignals() as signals, pytest.raises(KeyboardInterrupt):  # noqa: PT012
        swallow(number)
        assert signals.noticed == [number]
        # What raises it again does not wake a sleep.
        for _ in range(3000):
            time.sleep(0.01)
    assert capsys.readouterr() == ("", "")


def test_signals_that_follow_at_once_do_not_disturb_the_cleaning_up(monkeypatch):
    # A terminal that closes sends several.
    with StopSignals() as signals:
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        monkeypatch.setattr(interrupts, "REPEAT_TIME", 0.0)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        assert len(signals.noticed) == 3


@pytest.mark.parametrize("in_command", [True, False])
def test_a_held_signal_is_raised_when_the_body_has_ended(in_command, monkeypatch):
    done = []

    def hold():
        with held_signals() as noticed:
            assert not noticed
            with held_signals():
                signal.raise_signal(signal.SIGINT)
            assert noticed
            done.append("the body")

    if in_command:
        with StopSignals(), pytest.raises(KeyboardInterrupt):
            hold()
    else:
        before = signal.getsignal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            hold()
        assert signal.getsignal(signal.SIGINT) is before
    assert done == ["the body"]
    monkeypatch.setattr(interrupts, "REPEAT_TIME", 0.0)
    with pytest.raises(KeyboardInterrupt), held_signals():  # noqa: PT012
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        pytest.fail("the second one must end the body")


@pytest.mark.parametrize("status", [0, 3])
@pytest.mark.parametrize(("command", "ends"), [("walk", True), ("bus", False), ("studio", False)])
def test_a_command_that_swallows_a_signal_ends_as_stopped(
    command, ends, status, monkeypatch, capsys
):
    def run(arguments):
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            return status

    monkeypatch.setattr(cli, "_run", run)
    # A bus and the studio end at a signal, with their own status.
    assert cli.main([command]) == (130 if ends else status)
    assert capsys.readouterr().err == ("phasmid: stopped.\n" if ends else "")
    assert cli.main([]) == 130


@pytest.mark.parametrize("number", SIGNALS)
def test_a_closed_terminal_does_not_change_the_status(number, monkeypatch):
    class Closed:
        def write(self, text=""):
            raise OSError(errno.EIO, "Input/output error")

        flush = isatty = write

    def run(arguments):
        monkeypatch.setattr(sys, "stderr", Closed())
        monkeypatch.setattr(sys, "stdout", Closed())
        signal.raise_signal(number)

    monkeypatch.setattr(cli, "_run", run)
    assert cli.main(["walk"]) == 130


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGHUP")
def test_a_program_that_nohup_started_ignores_the_end_of_its_terminal():
    text = (
        "import signal; signal.signal(signal.SIGHUP, signal.SIG_IGN)\n"
        "from phasmid.interrupts import StopSignals\n"
        "with StopSignals() as signals: signal.raise_signal(signal.SIGHUP)\n"
        "assert not signals.noticed"
    )
    assert subprocess.run([sys.executable, "-c", text], check=False).returncode == 0


def test_an_exception_that_is_raised_again_waits_for_the_end_of_a_held_body():
    steps = []
    with StopSignals():
        swallow(signal.SIGTERM)
        with pytest.raises(KeyboardInterrupt):  # noqa: SIM117, PT012
            with held_signals():
                time.sleep(10 * interrupts.RAISE_AGAIN_TIME)
                steps.append("whole")
    assert steps == ["whole"]


def test_held_work_does_not_go_on_after_a_signal_that_was_swallowed():
    with StopSignals():
        with suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
        with pytest.raises(KeyboardInterrupt), held_signals() as noticed:
            assert noticed == [signal.SIGTERM]
