"""Runs on worker processes of this machine."""

from __future__ import annotations

import os
import signal
import time
import warnings
from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

from phasmid.interrupts import held_signals
from phasmid.parent_death import end_with_parent
from phasmid.studies.results import write_rows
from phasmid.studies.runs import Row, Run, Runner

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

Report: TypeAlias = Callable[[Sequence[Row]], bool]
"""Receives the rows of each task that is done, and returns False to stop."""


def make_rows(runner: Runner, runs: Sequence[Run]) -> tuple[list[Row], float]:
    """Make runs, and return their rows and the time that they took [s]."""
    begin = time.perf_counter()
    rows = [runner.row(run) for run in runs]
    return rows, time.perf_counter() - begin


class Executor(ABC):
    """Workers that make runs; each task is a few runs, whose rows go into the folder of the study.

    A worker process that dies costs only the runs at work. They are made again, one at a time, so
    that the run that kills its worker is found; it counts as failed.

    Args:
        runner: Makes a run.
        folder: Folder of the study.
        workers: Number of workers.
        report: Receives the rows.
    """

    lost_errors: tuple[type[BaseException], ...]
    """Errors of a task whose worker process died."""

    most_runs = 500
    """Most runs of a task."""

    def __init__(self, runner: Runner, folder: Path, workers: int, report: Report) -> None:
        self._runner, self._folder = runner, folder
        self._workers, self._report = workers, report
        self._deaths: Counter[str] = Counter()
        # The first run is made alone: it compiles what the others use.
        self._size, self._window = 1, 1
        self._pending: dict[Future[Any], list[Run]] = {}
        self.going = True

    @abstractmethod
    def __enter__(self) -> Executor:
        """Start the workers."""

    @abstractmethod
    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """End the workers; at an error without waiting for the runs under way."""

    @abstractmethod
    def _submit(self, task: list[Run]) -> Future[Any]:
        """Begin a task."""

    def _result(self, future: Future[Any]) -> tuple[list[Row], float]:
        """Return the rows of a task, and the time that it took [s]."""
        rows, seconds = future.result()
        return rows, seconds

    def _restart(self) -> list[Run]:
        """Replace dead workers, and return the pending runs that were lost with them."""
        return []

    def make(self, runs: Sequence[Run]) -> None:
        """Make runs, and return when all rows are written or the study is stopped."""
        queue, suspects, pending = deque(runs), deque[Run](), self._pending
        self._runner.remove_partials(runs)
        while pending or (self.going and (queue or suspects)):
            most = 1 if suspects else self._window
            while self.going and (queue or suspects) and len(pending) < most:
                source, count = (suspects, 1) if suspects else (queue, self._size)
                task = [source.popleft() for _ in range(min(count, len(source)))]
                pending[self._submit(task)] = task
            finished, _ = wait(pending, return_when=FIRST_COMPLETED)
            lost: list[Run] = []
            for future in finished:
                task = pending.pop(future)
                try:
                    rows, seconds = self._result(future)
                except self.lost_errors:
                    lost += task
                    continue
                self._write(rows)
                if self._window > 1:
                    fair = max(1, len(queue) // (4 * self._workers))
                    wanted = max(1, round(TASK_TIME * len(rows) / seconds))
                    self._size = min(wanted, fair, self.most_runs)
                self._window = 2 * self._workers
            for run in [*lost, *(self._restart() if lost else ())]:
                self._runner.remove_partials([run])
                self._deaths[run.id] += 1
                if self._deaths[run.id] < MOST_DEATHS:
                    suspects.append(run)
                else:
                    self._write([self._runner.failed(run, DIED)])

    def _write(self, rows: list[Row]) -> None:
        write_rows(self._folder, rows)
        self.going &= self._report(rows)


class LocalExecutor(Executor):
    """Worker processes of this machine."""

    lost_errors = (BrokenProcessPool,)

    def __enter__(self) -> Executor:
        from loky import ProcessPoolExecutor
        from loky.backend import resource_tracker

        # Ctrl-C reaches all processes of a terminal; the first one ends the study. The function
        # imports little, so that no worker goes on while it starts.
        with held_signals(), _blocked_signals():
            self._pool = ProcessPoolExecutor(
                self._workers,
                env=ONE_THREAD,
                initializer=partial(end_with_parent, os.getpid(), ignores_interrupts=True),
            )
            # Started here, so that it inherits the blocked signals.
            resource_tracker.ensure_running()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self._pool.shutdown()
            return
        self._kill()
        for task in self._pending.values():
            self._runner.remove_partials(task)

    def _kill(self) -> None:
        """End all workers at once."""
        with warnings.catch_warnings():
            # Without psutil and pgrep only the workers are killed, and not their children.
            warnings.simplefilter("ignore", UserWarning)
            self._pool.shutdown(kill_workers=True)

    def _submit(self, task: list[Run]) -> Future[Any]:
        # It may start workers, which fail with a traceback if that is interrupted.
        with held_signals(), _blocked_signals():
            future: Future[Any] = self._pool.submit(make_rows, self._runner, task)
        return future

    def _restart(self) -> list[Run]:
        # The pool breaks as a whole.
        lost = [run for task in self._pending.values() for run in task]
        self._pending.clear()
        self._kill()
        self.__enter__()
        return lost


@contextmanager
def _blocked_signals() -> Iterator[None]:
    """Block Ctrl-C and a closed terminal in the processes that the body starts.

    They end with this process; a helper of the workers that ended before would be started again.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT, signal.SIGHUP])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
