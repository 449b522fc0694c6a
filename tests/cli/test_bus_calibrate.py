"""``phasmid bus calibrate`` on emulated servos whose joints the test turns."""

import math
import signal
import subprocess
import sys

import numpy as np
import pytest

from phasmid.cli.bus_calibrate import turn_words
from phasmid.hardware import load_calibration
from phasmid.hardware.calibrator import pose_angles
from phasmid.kinematics import foot_position
from phasmid.robot import load_robot, preset_names
from support.hand_turned import PATIENCE, Bench

posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")
TURN = math.radians(15)
PATIENT = ["--latency-ms", f"{1000 * PATIENCE:g}"]


@pytest.fixture
def robot():
    pytest.importorskip("dynamixel_sdk")
    return load_robot("phantomx-ax")


def started(bench, path, *options):
    command = [sys.executable, "-m", "phasmid", "bus", "calibrate", bench.emulator.port]
    command += ["--robot", "phantomx-ax", "--out", str(path), *PATIENT, *options]
    return subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        encoding="utf-8",
    )


def prompted(process, lines):
    """Collect the lines up to the next prompt."""
    for line in process.stdout:
        lines.append(line.rstrip())
        if "press Enter" in line:
            return
    raise AssertionError("\n".join(lines))


def enter(process):
    process.stdin.write("\n")
    process.stdin.flush()


@posix
def test_a_whole_calibration_recovers_how_the_servos_are_mounted(robot, tmp_path):
    """The first leg's coxa is turned at the second request only; the tolerance is one step."""
    path, lines = tmp_path / "robot.toml", []
    limits = robot.arrays.joint_limits
    rest = limits.mean(axis=-1)
    first, others = np.zeros((6, 3)), np.full((6, 3), TURN)
    first[0], others[0] = TURN, 0.0
    with Bench(robot) as bench, started(bench, path) as process:

        def then(turn, angles):
            prompted(process, lines)
            turn(angles)
            enter(process)

        for servo in bench.emulator.servos:
            servo["torque_enable"] = 1
        then(bench.turn, pose_angles(robot, "square"))
        assert not any(servo["torque_enable"] for servo in bench.emulator.servos)
        then(bench.turn, rest)
        then(bench.turn_watched, rest + others)
        then(bench.turn, rest)
        then(bench.turn_watched, rest + first)
        for _ in ("femur", "tibia"):
            then(bench.turn, rest)
            then(bench.turn_watched, rest + TURN)
        prompted(process, lines)
        # At each stop the joints wait until they have been read.
        for stop in (limits[..., 0], limits[..., 1] - np.radians(30)):
            bench.turn_watched(stop)
        enter(process)
        rest_of_output = process.stdout.read()
        assert process.wait(60) == 0, rest_of_output
        plant = bench.plant

    rows = load_calibration(path, robot)
    assert [row.direction for row in rows] == list(plant.direction)
    np.testing.assert_allclose([row.zero for row in rows], plant.zero, atol=1.001 * plant.scale)
    text = "\n".join(lines)
    assert lines[0].startswith("18 servos AX-12A answer; their torque is off.")
    assert "1. The square pose." in text
    assert "Turned too little, or both ways: right_front.coxa.\n" in text
    table = rest_of_output.splitlines()
    assert table[1].split() == ["joint", "id", "offset", "direction", "range", "note"]
    kind = "reversed" if plant.direction[0] < 0 else "normal"
    cells = table[2].split()
    assert cells[:2] == ["right_front.coxa", "1"]
    # The printed offset has one decimal.
    assert float(cells[2][:-1]) == pytest.approx(math.degrees(rows[0].zero), abs=0.051)
    assert cells[3:] == [kind, "-75°", "to", "45°", "limits", "-75°", "to", "75°"]
    assert all(len(line) <= 80 for line in table[1:20])
    assert f"--robot phantomx-ax --calibration {path}" in table[-1]


@posix
@pytest.mark.skipif(sys.platform == "win32", reason="no signals")
def test_ctrl_c_writes_nothing(robot, tmp_path):
    path = tmp_path / "robot.toml"
    with Bench(robot) as bench, started(bench, path) as process:
        prompted(process, [])
        enter(process)
        prompted(process, [])
        enter(process)
        # Now the positions are read.
        prompted(process, [])
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == 130
    assert not path.exists()


@posix
@pytest.mark.parametrize("pose", ["square", "neutral"])
def test_an_input_that_ends_writes_nothing(robot, tmp_path, pose):
    path = tmp_path / "robot.toml"
    with Bench(robot) as bench, started(bench, path, "--pose", pose) as process:
        out, _ = process.communicate("\n\n")
        assert process.returncode == 2
    assert "the input ended before the calibration; nothing was written." in out
    assert "internal error" not in out
    assert ("140 mm" in out) is (pose == "neutral")
    assert not path.exists()


@posix
def test_a_servo_that_falls_silent_ends_the_calibration(robot, tmp_path):
    path, lines = tmp_path / "robot.toml", []
    with Bench(robot) as bench, started(bench, path) as process:
        prompted(process, lines)
        enter(process)
        prompted(process, lines)
        bench.emulator.add_fault("7 dead")
        enter(process)
        rest_of_output = process.stdout.read()
        assert process.wait(60) == 1
    assert "phasmid: servo 7, reading present_position: " in rest_of_output
    assert not path.exists()


@pytest.mark.parametrize("name", preset_names())
def test_the_words_for_a_turn_are_those_of_larger_angles(name):
    """The foot of each leg goes as the words say where an angle grows by a degree."""
    robot = load_robot(name)
    q = pose_angles(robot, "square")
    ways = {"forward": (0, 1), "backward": (0, -1), "up": (2, 1)}
    for joint in (0, 1):
        words = turn_words(robot, ("coxa", "femur")[joint]).removeprefix("Swing each ")
        larger = q.copy()
        larger[:, joint] += math.radians(1)
        moved = foot_position(robot.arrays, larger) - foot_position(robot.arrays, q)
        for leg, p in zip(robot.legs, moved, strict=True):
            phrase = next((part for part in words.split(", or ") if leg.name in part), words)
            axis, sign = next(ways[word] for word in phrase.split() if word in ways)
            assert sign * (leg.X_body_hip[:3, :3] @ p)[axis] > 0
    assert turn_words(robot, "tibia") == "Swing each foot tip outwards and up about its tibia axis"
    larger = q + np.radians([0, 0, 1])
    moved = foot_position(robot.arrays, larger) - foot_position(robot.arrays, q)
    # Along x and z of the hip frame.
    assert np.all(moved[:, [0, 2]] > 0)
