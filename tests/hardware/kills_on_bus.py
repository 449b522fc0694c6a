"""Drives on an emulated bus whose processes are killed, in real time.

`make slow SUITE=bus` runs this file. Its 120 drives take half an hour, and need a machine without
other work: answers that are late count as silence.
"""

import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import ExitStack, suppress

import pytest

from phasmid.hardware import Emulator, default_calibration, make_servos, model, save_calibration
from phasmid.robot import load_robot
from support.cable import PATIENCE, Cable, is_off, runs, wait
from support.virtual_bus import folded

STAGES = {
    "ramp": ("emulated", "0,0,0"),
    "rise": ("the robot stands up", "0,0,0"),
    "stand": ("the robot walks", "0,0,0"),
    "walk": ("the robot walks", "0.05,0,0"),
    "sit": ("the robot sits down", "0.05,0,0"),
}
"""Line of the output after which a fault begins, and the velocity."""

FAULTS = {
    "none": [],
    "silent": ["lost 1 for 8 s"],
    "garbled": ["garbled 1 for 8 s"],
    "late": ["late 1 by 50 ms for 8 s"],
    "15 % lost": ["lost 0.15"],
    "50 % lost": ["lost 0.5 for 8 s"],
    "95 % lost": ["lost 0.95 for 8 s"],
    "port gone": [],
    "second reader": [],
    "overload": ["5 overload"],
    "hot": ["5 hot"],
    "two legs dead": ["5 dead", "14 dead"],
}

REPAIR = 8.0
"""Time after which a fault of the bus is repaired [s]: the driver has given up before."""


def read_port(path):
    """Read the bytes of another process for a second."""
    file = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    end = time.monotonic() + 1.0
    while time.monotonic() < end:
        with suppress(OSError):
            os.read(file, 64)
    os.close(file)


def second_of(pid):
    """Return the number of a driver's second process; None without one."""
    done = subprocess.run(
        ["pgrep", "-P", str(pid), "-f", "torque_off"], capture_output=True, text=True, check=False
    )
    return int(done.stdout.split()[0]) if done.stdout.split() else None


@pytest.mark.parametrize("killed", ["driver", "second"])
@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("stage", STAGES)
def test_servos_are_off_or_named_after_a_kill(tmp_path, stage, fault, killed):
    """At the end of both processes no torque is on, except in servos that are dead or named.

    The bus is repaired after 8 s: the second process goes on until then.
    """
    robot, words, velocity = load_robot("phantomx-ax"), *STAGES[stage]
    rows = default_calibration(robot, model("AX-12A"))
    save_calibration(tmp_path / "mine.toml", rows, robot.name)
    servos = make_servos("AX-12A", range(1, 19), baud=1_000_000)
    for servo in servos:
        servo["return_delay_time"] = 0
    dead = (5, 14) if fault == "two legs dead" else ()
    with ExitStack() as stack:
        emulator = stack.enter_context(Emulator(servos, folded()))
        port, cable = emulator.port, None
        if fault == "port gone":
            cable = stack.enter_context(Cable(tmp_path / "port", emulator.port))
            port = str(cable.path)
        arguments = ["--calibration", "mine.toml", "--velocity", velocity, "--duration", "3"]
        # The cable and this process's other threads delay answers.
        arguments += ["--rate", "20"]
        command = [sys.executable, "-u", "-m", "phasmid", "drive", "--bus", port]
        driver = stack.enter_context(
            subprocess.Popen(
                [*command, "--robot", "phantomx-ax", *arguments, "--out", "a"],
                cwd=tmp_path,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                stdin=subprocess.DEVNULL,
                text=True,
            )
        )
        stack.callback(driver.kill)
        lines = []
        reader = threading.Thread(target=lambda: lines.extend(driver.stdout), daemon=True)
        reader.start()
        if stage == "ramp":
            wait(lambda: any(servo["torque_enable"] for servo in servos), driver, lines)
        else:
            wait(lambda: any(words in line for line in lines), driver, lines)
        second = second_of(driver.pid)
        if fault == "second reader":
            threading.Thread(target=read_port, args=(port,), daemon=True).start()
        elif cable is not None:
            cable.unplug()
        else:
            for text in FAULTS[fault]:
                emulator.add_fault(text)
        begun = time.monotonic()
        time.sleep(0.3)
        if killed == "driver":
            driver.kill()
        elif second is not None:
            os.kill(second, signal.SIGKILL)
        wait(lambda: time.monotonic() > begun + REPAIR)
        if cable is not None:
            cable.plug()
        driver.wait(timeout=PATIENCE)
        reader.join()
        said = "".join(lines)
        alive = [servo for servo in servos if servo.id not in dead]
        if killed == "driver":
            wait(lambda: is_off(alive))
            if not dead:
                wait(lambda: second is None or not runs(second))
        else:
            assert driver.returncode in (1, 3), said
            # Where answers are late or lost, torque that is off may not be confirmed.
            assert ("the torque is off." in said) != ("switch the supply off" in said), said
            assert "switch the supply off" in said or (is_off(servos) and not dead), said
        if second is not None and runs(second):
            os.kill(second, signal.SIGKILL)
