"""Ticks of a driven robot on the emulated bus, and its log against the simulation.

    python benchmarks/drive_bus.py [--duration 60] [--priority]

For 18 AX-12A at 50 Hz and 18 XL430-W250 at 100 Hz: how late the ticks were, and how often each
servo was read. Then `phasmid compare` of a log of the AX-12A robot: what it finds of delay and
stiffness that the emulator was set to. With --priority driver and emulator run ahead of other
processes, where the system allows it.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from phasmid.comparison import compare
from phasmid.experiment import Command
from phasmid.hardware import (
    Bus,
    Driver,
    RobotBus,
    default_calibration,
    exchange_time,
    model,
    write_time,
)
from phasmid.robot import load_servo
from phasmid.scenario import load_scenario
from phasmid.simulation.drive import scenario_controller

CASES = ("AX-12A", 50.0), ("XL430-W250", 100.0)
BAUD, LATENCY = 1_000_000, 1e-3


@contextlib.contextmanager
def emulated(name: str, priority: bool) -> Iterator[str]:
    """Yield the port of an emulated robot in another process."""
    command = [sys.executable, "-m", "phasmid", "bus", "emulate", "--robot", "phantomx-ax"]
    command += ["--model", name, "--return-delay-us", "0", "--latency-ms", f"{1000 * LATENCY:g}"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        if priority:
            os.sched_setscheduler(process.pid, os.SCHED_RR, os.sched_param(10))
        yield process.stdout.readline().removeprefix("The port is ").strip()
        process.terminate()


def drive(name: str, rate: float, duration: float, log: Path, priority: bool) -> None:
    """Drive a robot, and print how late its ticks were."""
    scenario = load_scenario("paper").replace(robot="phantomx-ax", drive="servo")
    robot, table = scenario.load_robot(), model(name)
    with emulated(name, priority) as port, Bus(port, BAUD, table.protocol, LATENCY) as bus:
        calibration = default_calibration(robot, table)
        bus.scan([row.id for row in calibration])
        driver = Driver(
            RobotBus(bus, robot, calibration),
            scenario,
            scenario_controller(scenario, rate, ground_sensing=False),
            Command((0.06, 0.0, 0.0)),
            rate=rate,
            log=log,
            force=True,
        )
        report = driver.drive(duration)
    in_time = 100 * (1 - report.late / report.ticks)
    print(
        f"{name:11} {rate:4.0f} Hz  {report.ticks:6} ticks  {in_time:6.2f} % less than 5 ms late  "
        f"worst {1000 * report.worst_delay:5.1f} ms  servos read at {report.reading_rate:4.1f} Hz  "
        f"{report.lost} of {report.answers} answers lost  {report.ending or ''}",
        flush=True,
    )


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--duration", type=float, default=60.0)
    parser.add_argument("--priority", action="store_true")
    options = parser.parse_args()
    if options.priority:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(5))
    with tempfile.TemporaryDirectory() as folder:
        for name, rate in CASES:
            drive(name, rate, options.duration, Path(folder) / f"{name}.mcap", options.priority)
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        found = compare(Path(folder) / "AX-12A.mcap")
    servo, table = load_servo("AX-12A"), model("AX-12A")
    block = 8
    # From a goal to its reading: packet of goals, the servo, and the way of an answer.
    bus_delay = write_time(table, 18, 4, baud=BAUD)
    bus_delay += exchange_time(0, [6 + block], baud=BAUD, return_delay=0.0, latency=LATENCY)
    for name, unit, scale, expected in (
        ("latency", "ms", 1e3, servo.delay + bus_delay),
        ("stiffness", "N·m/rad", 1.0, found["stiffness"].simulation),
    ):
        quantity = found[name]
        assert expected is not None
        assert quantity.interval is not None
        half = scale * (quantity.interval[1] - quantity.interval[0]) / 2
        print(
            f"{name}: {scale * quantity.robot:.2f} ± {half:.2f} {unit} of "
            f"{scale * expected:.2f} set ({100 * (quantity.robot / expected - 1):+.1f} %)"
        )


if __name__ == "__main__":
    main()
