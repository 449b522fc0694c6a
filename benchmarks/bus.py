"""The emulated servo bus against protocol arithmetic, and the rates of 18 servos on it.

    python benchmarks/bus.py [--exchanges 200] [--ticks 200] [--priority]

The first table has the time of one exchange, from the first byte sent to the last byte received, of
an emulator in a process of its own. The second has the rate of a sync write of all goals with a
read of all positions, by `phasmid.hardware.Bus` (extra hardware). With --priority the emulator runs
ahead of other processes, where the system allows it; on a machine with other work the times are
those of that work otherwise.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import select
import statistics
import subprocess
import sys
import termios
import time
import tty
from collections.abc import Iterator

from phasmid.hardware import Bus, achievable_rate, exchange_time, model
from phasmid.hardware.packets import Instruction, encode

LATENCIES = 1e-3, 16e-3
BAUDS = 57_600, 1_000_000


@contextlib.contextmanager
def emulated(
    name: str, baud: int, latency: float, delay_us: float, priority: bool
) -> Iterator[str]:
    """Yield the port of an emulator in another process."""
    command = [sys.executable, "-m", "phasmid", "bus", "emulate", "--model", name]
    command += ["--baud", str(baud), "--latency-ms", f"{1000 * latency:g}"]
    command += ["--return-delay-us", f"{delay_us:g}"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        assert process.stdout is not None
        if priority:
            os.sched_setscheduler(process.pid, os.SCHED_RR, os.sched_param(10))
        yield process.stdout.readline().removeprefix("The port is ").strip()
        process.terminate()


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
                with emulated(name, baud, latency, 500, priority) as port:
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
            emulated(name, 1_000_000, 1e-3, 0, priority) as port,
            Bus(port, 1_000_000, table.protocol, latency=1e-3) as bus,
        ):
            for id_ in ids:
                bus.add(id_, table)
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
    parser.add_argument("--priority", action="store_true")
    options = parser.parse_args()
    measure_exchanges(options.exchanges, options.priority)
    measure_rates(options.ticks, options.priority)


if __name__ == "__main__":
    main()
