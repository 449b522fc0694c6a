"""Runs on the processes of this machine."""

from __future__ import annotations

import signal
import time
from collections import Counter, deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any, NamedTuple

from phasmid.studies.results import read_rows, write_rows
from phasmid.studies.runs import Run, Runner

TASK_TIME = 2.0
"""Time that a task of several runs takes about [s]."""

MOST_DEATHS = 2
"""Deaths of worker processes after which the run at work counts as failed."""

DIED = "its worker process died, for lack of memory or by a signal"
"""Error of such a run."""

ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
"""Environment of the workers."""


class Done(NamedTuple):
    """A task that is done.

    Attributes:
        runs: Its number of runs.
        failures: Errors of its failed runs.
        seconds: Its duration [s].
    """

    runs: int
    failures: list[str]
    seconds: float


_WORKER: tuple[Runner, Path] | None = None


def _initialise(runner: Runner, folder: Path) -> None:
    global _WORKER  # noqa: PLW0603, a process has one study
    _WORKER = runner, folder
    # Ctrl-C reaches all processes of a terminal; the first one ends the study.
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _make(runs: Sequence[Run]) -> Done:
    """Make runs and write their rows."""
    assert _WORKER is not None
    runner, folder = _WORKER
    begin = time.perf_counter()
    rows = [runner.row(run) for run in runs]
    write_rows(folder, rows)
    failures = [str(row["error"]) for row in rows if row["status"] == "failed"]
    return Done(len(rows), failures, time.perf_counter() - begin)


def execute(
    runner: Runner,
    folder: Path,
    runs: Sequence[Run],
    *,
    workers: int,
    report: Callable[[Done], bool],
) -> None:
    """Make runs on worker processes, which write their rows into the folder.

    A worker process that dies costs only the runs at work. They are made again, one at a time, so
    that the run that kills its worker is found; it counts as failed.

    Args:
        runner: Makes a run.
        folder: Folder of the study.
        runs: The runs.
        workers: Number of processes.
        report: Receives each task that is done, and returns False to stop.
    """
    from loky import ProcessPoolExecutor

    def new_pool() -> Any:
        return ProcessPoolExecutor(
            workers, env=ONE_THREAD, initializer=_initialise, initargs=(runner, folder)
        )

    queue, suspects = deque(runs), deque[Run]()
    deaths: Counter[str] = Counter()
    pending: dict[Future[Done], list[Run]] = {}
    # The first run alone: it compiles what the others use.
    size, window = 1, 1
    pool, going = new_pool(), True
    try:
        while pending or (going and (queue or suspects)):
            while going and (queue or suspects) and len(pending) < (1 if suspects else window):
                source, count = (suspects, 1) if suspects else (queue, size)
                task = [source.popleft() for _ in range(min(count, len(source)))]
                pending[pool.submit(_make, task)] = task
            finished, _ = wait(pending, return_when=FIRST_COMPLETED)
            lost: list[Run] = []
            for future in finished:
                task = pending.pop(future)
                try:
                    done = future.result()
                except BrokenProcessPool:
                    lost += task
                    continue
                going &= report(done)
                if window > 1:
                    fair = max(1, len(queue) // (4 * workers))
                    size = min(max(1, round(TASK_TIME * done.runs / done.seconds)), fair, 500)
                window = 2 * workers
            if lost:
                lost += [run for task in pending.values() for run in task]
                pending.clear()
                pool.shutdown(kill_workers=True)
                pool = new_pool()
                written = set(read_rows(folder)["run"])
                for run in lost:
                    if run.id in written:
                        going &= report(Done(1, [], 0.0))
                        continue
                    deaths[run.id] += 1
                    if deaths[run.id] < MOST_DEATHS:
                        suspects.append(run)
                        continue
                    write_rows(folder, [runner.failed(run, DIED)])
                    going &= report(Done(1, [DIED], 0.0))
        pool.shutdown()
    except BaseException:
        # Ctrl-C, for one: runs under way are made again by the next call.
        pool.shutdown(kill_workers=True)
        raise
