"""The emulated servo bus: times of exchanges, rates of 18 servos, and ticks of a driven robot.

    python benchmarks/bus.py [--exchanges 200] [--ticks 200] [--duration 60] [--priority]

The first table has the time of one exchange, from the first byte sent to the last byte received, of
an emulator in a process of its own. The second has the rate of a sync write of all goals with a
read of all positions, by `phasmid.hardware.Bus` (extra hardware). The last lines are of a robot
that walks on the bus. With --priority driver and emulator run ahead of other processes, where the
system allows it; on a machine with other work the times are those of that work otherwise.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import select
import statistics
import subprocess
import sys
import tempfile
import termios
import time
import tty
from collections.abc import Iterator
from pathlib import Path

from phasmid.experiment import Command
from phasmid.hardware import (
    Bus,
    Driver,
    RobotBus,
    achievable_rate,
    default_calibration,
    exchange_time,
    model,
)
from phasmid.hardware.packets import Instruction, encode
from phasmid.scenario import load_scenario
from phasmid.simulation.drive import scenario_controller

LATENCIES = 1e-3, 16e-3
BAUDS = 57_600, 1_000_000


@contextlib.contextmanager
def emulated(priority: bool, **options: object) -> Iterator[str]:
    """Yield the port of an emulator in another process, with options of the command."""
    command = [sys.executable, "-m", "phasmid", "bus", "emulate"]
    for name, value in options.items():
        command += [f"--{name.replace('_', '-')}", str(value)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        assert process.stdout is not None
        if priority:
            os.sched_setscheduler(process.pid, os.SCHED_RR, os.sched_param(10))
        yield process.stdout.readline().removeprefix("The port is ").strip()
        process.terminate()


def emulated_servos(
    name: str, baud: int, latency: float, delay_us: float, priority: bool
) -> contextlib.AbstractContextManager[str]:
    """Return an emulator of servos of one model."""
    return emulated(
        priority, model=name, baud=baud, latency_ms=1000 * latency, return_delay_us=delay_us
    )


def exchange_times(port: str, baud: int, request: bytes, size: int, count: int) -> list[float]:
    """Return the times of exchanges [s]."""
    file = os.open(port, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(file)
    setting = termios.tcgetattr(file)
    setting[4] = setting[5] = getattr(termios, f"B{baud}")
    termios.tcsetattr(file, termios.TCSANOW, setting)
    times = []
    for _ in range(count):
        received, begin = 0, time.perf_counter()
        os.write(file, request)
        while received < size and select.select([file], [], [], 0.5)[0]:
            received += len(os.read(file, 4096))
        times.append(time.perf_counter() - begin)
        # A busy machine's late answer belongs to its own request.
        time.sleep(0.002)
    os.close(file)
    return times


def measure_exchanges(count: int, priority: bool) -> None:
    """Print times of exchanges beside the computed ones."""
    print("model       read   baud     latency  computed  median    deviation  within 5 %")
    for name in ("AX-12A", "XL430-W250"):
        table = model(name)
        position, number = table.register("present_position"), table.protocol
        for baud in BAUDS:
            for latency in LATENCIES:
                with emulated_servos(name, baud, latency, 500, priority) as port:
                    for several in (1, 18) if number == 2 else (1,):
                        request, answers = _read(number, position.address, position.size, several)
                        computed = exchange_time(
                            len(request), answers, baud=baud, return_delay=5e-4, latency=latency
                        )
                        times = exchange_times(port, baud, request, sum(answers), count)
                        median = statistics.median(times)
                        within = sum(abs(t / computed - 1) < 0.05 for t in times) / count
                        print(
                            f"{name:<11} {several:>2}  {baud:>8}  {1000 * latency:>5.0f} ms  "
                            f"{1000 * computed:>6.2f} ms {1000 * median:>6.2f} ms  "
                            f"{100 * (median / computed - 1):>+6.1f} %  {100 * within:>7.0f} %"
                        )


def _read(protocol: int, address: int, size: int, several: int) -> tuple[bytes, list[int]]:
    """Return a request for one register of servos from 1 on, and the bytes of each answer."""
    if protocol == 1:
        return encode(1, 1, Instruction.READ, bytes([address, size])), [6 + size]
    block = address.to_bytes(2, "little") + size.to_bytes(2, "little")
    if several == 1:
        return encode(2, 1, Instruction.READ, block), [11 + size]
    ids = bytes(range(1, several + 1))
    return encode(2, 254, Instruction.SYNC_READ, block + ids), [11 + size] * several


def measure_drive(name: str, rate: float, duration: float, priority: bool) -> None:
    """Drive a robot of 18 servos, and print how late its ticks were."""
    scenario = load_scenario("paper").replace(robot="phantomx-ax", drive="servo")
    robot, table = scenario.load_robot(), model(name)
    with (
        tempfile.TemporaryDirectory() as folder,
        emulated(
            priority, robot="phantomx-ax", model=name, return_delay_us=0, latency_ms=1
        ) as port,
        Bus(port, 1_000_000, table.protocol, 1e-3) as bus,
    ):
        calibration = default_calibration(robot, table)
        bus.scan([row.id for row in calibration])
        driver = Driver(
            RobotBus(bus, robot, calibration),
            scenario,
            scenario_controller(scenario, rate, ground_sensing=False),
            Command((0.06, 0.0, 0.0)),
            rate=rate,
            log=Path(folder) / "drive.mcap",
        )
        report = driver.drive(duration)
    in_time = 100 * (1 - report.late / report.ticks)
    print(
        f"{name:11} {rate:4.0f} Hz  {report.ticks:6} ticks  {in_time:6.2f} % less than 5 ms late  "
        f"worst {1000 * report.worst_delay:5.1f} ms  servos read at {report.reading_rate:4.1f} Hz  "
        f"{report.lost} of {report.answers} answers lost  {report.ending or ''}",
        flush=True,
    )


def measure_rates(ticks: int, priority: bool) -> None:
    """Print rates of ticks beside the computed ones."""
    print("\nmodel       servos  read per tick   computed  reached   lost")
    ids = list(range(1, 19))
    for name, reads in (("AX-12A", 18), ("AX-12A", 6), ("MX-28", 18), ("XL430-W250", 18)):
        table = model(name)
        computed = achievable_rate(
            table,
            18,
            baud=1_000_000,
            read_size=table.register("present_position").size,
            read_servos=reads,
        )
        with (
            emulated_servos(name, 1_000_000, 1e-3, 0, priority) as port,
            Bus(port, 1_000_000, table.protocol, latency=1e-3) as bus,
        ):
            for id_ in ids:
                bus.models[id_] = table
            begin = time.perf_counter()
            for tick in range(ticks):
                bus.write_all("goal_position", dict.fromkeys(ids, 0.2))
                some = [ids[(tick * reads + k) % 18] for k in range(reads)]
                bus.read_all(some, ["present_position"])
            rate = ticks / (time.perf_counter() - begin)
            print(
                f"{name:<11} {18:>6}  {reads:>13}   {computed:>5.0f} Hz  {rate:>5.0f} Hz  "
                f"{bus.traffic.lost:>5}"
            )


def main() -> None:
    """Measure both."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else "")
    parser.add_argument("--exchanges", type=int, default=200)
    parser.add_argument("--ticks", type=int, default=200)
    parser.add_argument("--duration", type=float, default=60.0, help="of each drive [s]")
    parser.add_argument("--priority", action="store_true")
    options = parser.parse_args()
    measure_exchanges(options.exchanges, options.priority)
    measure_rates(options.ticks, options.priority)
    if options.priority:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(5))
    for name, rate in ("AX-12A", 50.0), ("XL430-W250", 100.0):
        measure_drive(name, rate, options.duration, options.priority)


if __name__ == "__main__":
    main()
