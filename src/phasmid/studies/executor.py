"""Runs on worker processes of this machine."""

from __future__ import annotations

import signal
import time
from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any, NamedTuple

from phasmid.studies.results import read_rows, write_rows
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


class Executor(ABC):
    """Workers that make runs; each task is a few runs, whose rows go into the folder of the study.

    A worker process that dies costs only the runs at work. They are made again, one at a time, so
    that the run that kills its worker is found; it counts as failed.

    Args:
        runner: Makes a run.
        folder: Folder of the study.
        workers: Number of workers.
        report: Receives each task that is done, and returns False to stop.
    """

    lost_errors: tuple[type[BaseException], ...]
    """Errors of a task whose worker process died."""

    most_runs = 500
    """Most runs of a task."""

    def __init__(
        self, runner: Runner, folder: Path, workers: int, report: Callable[[Done], bool]
    ) -> None:
        self._runner, self._folder = runner, folder
        self._workers, self._report = workers, report
        self._deaths: Counter[str] = Counter()
        # The first run is made alone: it compiles what the others use.
        self._size, self._window = 1, 1
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

    @abstractmethod
    def _finish(self, result: Any) -> Done:
        """Write the rows of a task where its worker has not."""

    @abstractmethod
    def _restart(self, pending: dict[Future[Any], list[Run]]) -> list[Run]:
        """Replace dead workers, and return the pending runs that were lost with them."""

    def make(self, runs: Sequence[Run]) -> None:
        """Make runs, and return when all rows are written or the study is stopped."""
        queue, suspects = deque(runs), deque[Run]()
        pending: dict[Future[Any], list[Run]] = {}
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
                    done = self._finish(future.result())
                except self.lost_errors:
                    lost += task
                    continue
                self.going &= self._report(done)
                if self._window > 1:
                    fair = max(1, len(queue) // (4 * self._workers))
                    wanted = max(1, round(TASK_TIME * done.runs / done.seconds))
                    self._size = min(wanted, fair, self.most_runs)
                self._window = 2 * self._workers
            if lost:
                suspects += self._recover(lost + self._restart(pending))

    def _recover(self, lost: Sequence[Run]) -> list[Run]:
        """Return the runs that are to be made again; of the others the rows are written."""
        written, again = set(read_rows(self._folder)["run"]), []
        for run in lost:
            self._deaths[run.id] += 1
            if run.id in written:
                self.going &= self._report(Done(1, [], 0.0))
            elif self._deaths[run.id] < MOST_DEATHS:
                again.append(run)
            else:
                write_rows(self._folder, [self._runner.failed(run, DIED)])
                self.going &= self._report(Done(1, [DIED], 0.0))
        return again


# Processes of this machine ------------------------------------------------------------------------

_WORKER: tuple[Runner, Path] | None = None


class LocalExecutor(Executor):
    """Worker processes of this machine, which write their rows themselves."""

    lost_errors = (BrokenProcessPool,)

    def __enter__(self) -> Executor:
        from loky import ProcessPoolExecutor

        self._pool = ProcessPoolExecutor(
            self._workers,
            env=ONE_THREAD,
            initializer=_initialise,
            initargs=(self._runner, self._folder),
        )
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._pool.shutdown(kill_workers=kind is not None)

    def _submit(self, task: list[Run]) -> Future[Any]:
        future: Future[Any] = self._pool.submit(_make, task)
        return future

    def _finish(self, result: Any) -> Done:
        assert isinstance(result, Done)
        return result

    def _restart(self, pending: dict[Future[Any], list[Run]]) -> list[Run]:
        # The pool breaks as a whole.
        lost = [run for task in pending.values() for run in task]
        pending.clear()
        self._pool.shutdown(kill_workers=True)
        self.__enter__()
        return lost


def _initialise(runner: Runner, folder: Path) -> None:
    global _WORKER  # noqa: PLW0603, a process has one study
    _WORKER = runner, folder
    # Ctrl-C reaches all processes of a terminal; the first one ends the study.
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _make(runs: Sequence[Run]) -> Done:
    """Make runs and write their rows."""
    assert _WORKER is not None
    runner, folder = _WORKER
    rows, seconds = make_rows(runner, runs)
    write_rows(folder, rows)
    return done(rows, seconds)


def make_rows(runner: Runner, runs: Sequence[Run]) -> tuple[list[Row], float]:
    """Make runs, and return their rows and the time that they took [s]."""
    begin = time.perf_counter()
    rows = [runner.row(run) for run in runs]
    return rows, time.perf_counter() - begin


def done(rows: Sequence[Row], seconds: float) -> Done:
    """Return the report of a task."""
    failures = [str(row["error"]) for row in rows if row["status"] == "failed"]
    return Done(len(rows), failures, seconds)
