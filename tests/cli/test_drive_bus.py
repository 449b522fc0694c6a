"""`phasmid drive --bus`: refusals, a drive of an emulated robot, and the end of a killed one."""

import io
import os
import signal
import subprocess
import sys
import threading
import time
import warnings

import pytest

from phasmid.cli import drive_bus, main
from phasmid.hardware import (
    Emulator,
    Reaction,
    default_calibration,
    make_servos,
    model,
    save_calibration,
)
from phasmid.recording import load_recording
from phasmid.recording.log import DamagedRecording
from phasmid.robot import load_robot

pytest.importorskip("dynamixel_sdk")
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")

PATIENCE = 120.0
"""Longest time for anything on a busy machine [s]."""


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--waypoints", "1,0"], "measures no place"),
        (["--velocity", "0.05,0,0", "--policy", "walk"], "has no inertial sensor"),
        (["--velocity", "0.05,0,0"], "needs --calibration"),
        (["--velocity", "0.05,0,0", "--fault", "imu dead at 1 s"], "has no --fault"),
        (["--velocity", "0.05,0,0", "--bus", "emulated", "--robot", "freenove-big"], "has no bus"),
        (["--velocity", "0.05,0,0", "--bus", "emulated", "--rate", "1000"], "1000 are wanted"),
        (["--velocity", "0.05,0,0", "--bus", "emulated", "--calibration", "no.toml"], "no.toml"),
    ],
)
def test_what_a_robot_on_a_bus_cannot_do_is_refused(
    arguments, words, capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert main(["drive", "--bus", "/dev/no-port", "--robot", "phantomx-ax", *arguments]) == 2
    assert words in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_the_emulated_robot_is_that_of_the_scenario(capsys, tmp_path, monkeypatch):
    # The rate is refused after the inspection of the servos, so that the emulator has started.
    monkeypatch.chdir(tmp_path)
    assert main(["drive", "--bus", "emulated", "--velocity", "0,0,0", "--rate", "1000"]) == 2
    assert "1000 are wanted" in capsys.readouterr().err


def test_the_reason_is_given_where_the_emulated_robot_does_not_start(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["drive", "--bus", "emulated", "--velocity", "0,0,0", "--baud", "1234"]) == 2
    assert "did not start: " in (error := capsys.readouterr().err)
    assert "1234" in error


class StopRecorder:
    """Stands for a driver; records the requests to stop."""

    def __init__(self):
        self.requests, self.changed = [], threading.Event()

    def stop(self, reaction):
        self.requests.append(reaction)
        self.changed.set()


@pytest.mark.parametrize(
    ("key", "reaction"),
    [
        (b"q", Reaction.SIT),
        (b"\x1b", Reaction.SIT),
        # Ctrl-Z must not stop the process under a robot that stands.
        (b"\x1a", Reaction.SIT),
        (b" ", Reaction.LIMP),
    ],
)
def test_keys_stop_the_robot(key, reaction, monkeypatch):
    driver = StopRecorder()
    master, slave = os.openpty()
    with os.fdopen(slave) as terminal:
        monkeypatch.setattr(sys, "stdin", terminal)
        with drive_bus.stop_keys(driver):
            os.write(master, b"x" + key)
            assert driver.changed.wait(PATIENCE)
        assert driver.requests == [reaction]
    os.close(master)


def test_a_lost_terminal_is_no_key(monkeypatch):
    # The empty string that a lost terminal gives must not count as the space bar. The thread ends
    # at it, which is waited for.
    driver = StopRecorder()
    master, slave = os.openpty()
    with os.fdopen(slave) as terminal:
        monkeypatch.setattr(sys, "stdin", terminal)
        with drive_bus.stop_keys(driver):
            os.close(master)
            wait(lambda: all(thread.name != "keys" for thread in threading.enumerate()))
        assert driver.requests == []


def test_an_event_without_a_reader_raises_nothing(monkeypatch):
    # An exception would end the drive with the torque off: the robot would fall.
    class Unread(io.StringIO):
        def write(self, text):
            raise BrokenPipeError

    monkeypatch.setattr(sys, "stdout", Unread())
    drive_bus.print_event(1.0, "the robot walks.")


def command(port, *arguments):
    base = [sys.executable, "-m", "phasmid", "drive", "--bus", port, "--robot", "phantomx-ax"]
    return [*base, "--velocity", "0.05,0,0", *arguments]


def test_an_emulated_robot_is_driven_and_its_log_is_written(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    status = main(command("emulated", "--duration", "0.5", "--out", "walk.mcap")[3:])
    printed = capfd.readouterr()
    # On a busy machine the emulator may fall silent, which ends the drive with status 3.
    assert status in (0, 3), printed.err
    assert "left_front.tibia    18  AX-12A" in printed.out
    assert "the torque is off." in printed.out
    recording = load_recording(tmp_path / "walk.mcap")
    assert recording.attrs["kind"] == "robot"
    assert recording.sizes["leg"] == 6


@pytest.mark.parametrize("after_exit", ["limp", "hold"])
def test_a_killed_driver_leaves_its_log_and_the_servos_as_set(after_exit, tmp_path):
    robot = load_robot("phantomx-ax")
    save_calibration(
        tmp_path / "mine.toml", default_calibration(robot, model("AX-12A")), robot.name
    )
    servos = make_servos("AX-12A", range(1, 19), baud=1_000_000)
    with Emulator(servos) as emulator:
        arguments = "--calibration", "mine.toml", "--out", "walk", "--after-exit", after_exit
        process = subprocess.Popen(
            command(emulator.port, *arguments), cwd=tmp_path, stdout=subprocess.DEVNULL
        )
        log = tmp_path / "walk.mcap"
        wait(lambda: log.exists() and log.stat().st_size > 100_000, process)
        process.send_signal(signal.SIGKILL)
        process.wait()
        goals = [servo["goal_position"] for servo in servos]
        if after_exit == "limp":
            wait(lambda: not any(servo.enabled for servo in servos))
        else:
            # Longer than the time after which the other setting switches the torque off.
            time.sleep(3.0)
            assert all(servo.enabled for servo in servos)
            assert goals == [servo["goal_position"] for servo in servos]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DamagedRecording)
        recording = load_recording(log)
    # What the file holds of whole samples is read; its last one may be cut.
    assert recording["time"].values[-1] > 1.0
    assert recording.attrs["ending"] == "CUT"


def wait(condition, process=None):
    """Wait for a condition, for as long as a process runs."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        assert process is None or process.poll() is None
        time.sleep(0.01)
    os.sync()
