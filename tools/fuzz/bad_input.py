"""Give phasmid bad inputs of every kind, and see each refused in one sentence with status 2.

Fails where one ends otherwise or takes more than 500 MB; times are only reported.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))

MOST_MEMORY = 500.0
"""Most memory of a command [MB]."""

LONGEST = 2.0
"""Time within which a command should end [s]."""


class Outcome(NamedTuple):
    """How a command ended: status, what it printed as errors, time [s] and memory [MB]."""

    status: int
    printed: str
    time: float
    memory: float


def run(folder: Path, arguments: Sequence[str]) -> Outcome:
    """Run a command in a folder.

    Linux counts the memory of the process that starts a command as the command's own, so that
    this one must be small: it imports nothing of phasmid.
    """
    errors = folder / "stderr.txt"
    begin = time.perf_counter()
    with errors.open("wb") as file:
        process = subprocess.Popen(
            [sys.executable, "-m", "phasmid", *arguments],
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=file,
        )
        _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    taken = time.perf_counter() - begin
    printed = errors.read_text("utf-8", "replace")
    return Outcome(process.returncode, printed, taken, usage.ru_maxrss / 1000)


def write(scratch: Path) -> list[tuple[str, Path, tuple[str, ...]]]:
    """Write the files of every bad input; returns their names, folders and arguments."""
    from support.bad_inputs import bad_inputs

    written = []
    for number, one in enumerate(bad_inputs(scratch)):
        folder = scratch / str(number)
        folder.mkdir()
        for name, content in one.files.items():
            (folder / name).write_bytes(content)
        written.append((one.name, folder, one.arguments))
    return written


def rightly(outcomes: Sequence[Outcome]) -> list[bool]:
    """Tell which commands were refused as bad input is."""
    from support.bad_inputs import refused_rightly

    return [refused_rightly(one.status, one.printed) for one in outcomes]


def apart(function: Callable, argument: object) -> list:
    """Call a function in a process of its own, whose memory goes with it."""
    with get_context("spawn").Pool(1) as pool:
        return pool.apply(function, (argument,))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("words", nargs="*", help="run only inputs whose names hold one of these")
    words = parser.parse_args().words
    with tempfile.TemporaryDirectory() as scratch:
        chosen = [
            one
            for one in apart(write, Path(scratch))
            if not words or any(word in one[0] for word in words)
        ]
        outcomes = [run(folder, arguments) for _, folder, arguments in chosen]
    names = [name for name, _, _ in chosen]
    failed = 0
    for name, one, right in zip(names, outcomes, apart(rightly, outcomes), strict=True):
        if not right or one.memory > MOST_MEMORY:
            failed += 1
            print(f"FAILS  {name}: status {one.status}, {one.memory:.0f} MB\n{one.printed[-1500:]}")
    by_time = sorted(zip(names, outcomes, strict=True), key=lambda pair: -pair[1].time)
    slow = [(name, one) for name, one in by_time if one.time > LONGEST]
    for name, one in slow[:10]:
        print(f"slow   {name}: {one.time:.1f} s")
    largest, most = max(zip(names, outcomes, strict=True), key=lambda pair: pair[1].memory)
    print(
        f"{len(chosen)} bad inputs: {failed} not refused rightly, {len(slow)} took more than "
        f"{LONGEST:g} s, the middle one {by_time[len(by_time) // 2][1].time:.1f} s; "
        f"at most {most.memory:.0f} MB ({largest})"
    )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
