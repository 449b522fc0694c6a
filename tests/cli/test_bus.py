"""``phasmid bus``: its tables and advice, on emulated servos."""

import os
import signal
import subprocess
import sys
from dataclasses import replace

import pytest

from phasmid.cli import main
from phasmid.cli.bus import emulator_of
from phasmid.cli.parser import build_parser
from phasmid.hardware import Emulator, default_calibration, make_servos, model, save_calibration
from phasmid.robot import load_robot

posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")


@pytest.fixture
def servos():
    pytest.importorskip("dynamixel_sdk")
    return make_servos("AX-12A", [3, 5], baud=1_000_000)


@posix
def test_scan_lists_servos_and_the_rate_that_the_port_allows(servos, capsys):
    with Emulator(servos) as emulator:
        assert main(["bus", "scan", emulator.port, "--ids", "1-6"]) == 0
    head, third, fifth, *advice = capsys.readouterr().out.splitlines()
    assert head.split() == ["id", "model", "baud", "protocol", "return", "delay"]
    assert third.split() == ["3", "AX-12A", "1000000", "1.0", "500", "us"]
    assert fifth.split()[0] == "5"
    assert advice[0].startswith("The adapter adds ")
    assert advice[1].startswith("Goals and positions of 2 servos can be exchanged at ")
    assert len(advice) == 2


@posix
def test_scan_shows_in_a_terminal_which_rate_it_tries(servos, monkeypatch):
    read, write = os.openpty()
    monkeypatch.setenv("TERM", "xterm")
    with Emulator(servos) as emulator, os.fdopen(write, "w") as stream:
        monkeypatch.setattr(sys, "stderr", stream)
        assert main(["bus", "scan", emulator.port, "--ids", "3", "--baud", "1000000"]) == 0
        assert "1000000 baud, protocol" in os.read(read, 65536).decode()
    os.close(read)


@posix
def test_a_long_latency_timer_is_named_with_its_remedy(servos, capsys):
    with Emulator(servos, latency=16e-3) as emulator:
        assert main(["bus", "scan", emulator.port, "--ids", "3", "--baud", "1000000"]) == 0
    out = capsys.readouterr().out
    assert "Its latency timer is too long for control; set it to 1 ms:" in out
    assert "echo 1 | sudo tee /sys/bus/usb-serial/devices/" in out


@posix
def test_monitor_shows_states_and_errors(servos, capsys):
    with Emulator(servos, faults=["5 hot"]) as emulator:
        assert main(["bus", "monitor", emulator.port, "--ids", "3,5", "--once"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert all(len(line) <= 80 for line in lines)
    assert lines[1].split() == ["3", "0.0°", "0", "%", "12.0", "V", "25", "°C", "none"]
    assert lines[2].split()[6:] == ["75", "°C", "overheating"]


@posix
def test_a_port_without_servos_has_status_1(servos, capsys):
    with Emulator(servos, faults=["3 dead", "5 dead"]) as emulator:
        options = ["--ids", "3,5", "--baud", "1000000"]
        assert main(["bus", "scan", emulator.port, *options]) == 1
    assert "No servo answers on" in capsys.readouterr().out


@posix
def test_emulate_names_its_port_and_ends_by_ctrl_c():
    command = [sys.executable, "-m", "phasmid", "bus", "emulate", "--ids", "1,2"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        port = process.stdout.readline().removeprefix("The port is ").strip()
        assert os.path.exists(port)  # noqa: PTH110
        process.send_signal(signal.SIGINT)
        assert process.wait(20) == 0
        assert "the bus is closed" in process.stdout.read()


def test_emulated_servos_are_mounted_as_calibrated(tmp_path):
    """Reversed servos with other ids and offsets have the same joint angles behind them."""
    robot, path = load_robot("phantomx-ax"), tmp_path / "robot.toml"
    default = default_calibration(robot, model("AX-12A"))
    rows = [
        replace(row, id=200 - row.id, drive_mode=row.id % 2, homing_offset=5 * row.id - 50)
        for row in default
    ]
    save_calibration(path, rows, robot.name)
    parser, words = build_parser("bus"), ["bus", "emulate", "--robot", "phantomx-ax"]
    plain, _ = emulator_of(parser.parse_args(words))
    emulator, table = emulator_of(parser.parse_args([*words, "--calibration", str(path)]))
    assert [servo.id for servo in emulator.servos] == [row.id for row in rows]
    assert table[1] == ["199", "right_front.coxa", "-45", "256 to 768"]
    # Both have advanced by one step, with sums of angles rounded at 1e-15 rad.
    angles = [
        [row.joint_angle(q) for row, q in zip(own, one.plant.position, strict=True)]
        for own, one in ((default, plain), (rows, emulator))
    ]
    assert angles[1] == pytest.approx(angles[0], abs=1e-9)


def test_a_port_that_is_not_there(capsys):
    pytest.importorskip("dynamixel_sdk")
    assert main(["bus", "scan", "/dev/no-such-port"]) == 2
    assert "there is no port /dev/no-such-port" in capsys.readouterr().err
