"""Runs on a Ray cluster, or on a local Ray."""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import Sequence
from concurrent.futures import Future
from pathlib import Path
from typing import Any

from phasmid.errors import InvalidInput, OutputError
from phasmid.recording.provenance import versions
from phasmid.studies.executor import ONE_THREAD, Executor, Report, make_rows
from phasmid.studies.runs import Row, Run, Runner

PATIENCE = 5.0
"""Longest time that the head node of a cluster takes to accept a connection [s]."""

LOCAL = "local"
"""Address of a Ray that is started on this machine."""


class RayExecutor(Executor):
    """Tasks on Ray, which replaces its dead workers itself.

    A task is 40 runs at most, some kilobytes.

    Args:
        runner: Makes a run; workers receive it once.
        folder: Folder of the study.
        workers: Number of workers of a local Ray, and half the number of tasks under way.
        report: As of `Executor`.
        address: Address of a cluster, or ``local``.
    """

    most_runs = 40

    def __init__(
        self, runner: Runner, folder: Path, workers: int, report: Report, address: str
    ) -> None:
        super().__init__(runner, folder, workers, report)
        self._address = address

    def __enter__(self) -> Executor:
        _check_address(self._address)
        # Otherwise Ray warns about graphics cards.
        os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
        logging.getLogger("ray").setLevel(logging.ERROR)
        import ray

        self.lost_errors = (ray.exceptions.WorkerCrashedError, ray.exceptions.OutOfMemoryError)
        settings: dict[str, Any] = {"address": self._address}
        if self._address == LOCAL:
            settings = {"num_cpus": self._workers, "include_dashboard": False}
        try:
            ray.init(
                **settings,
                runtime_env={"env_vars": ONE_THREAD},
                log_to_driver=False,
                logging_level=logging.ERROR,
            )
        except (ConnectionError, TimeoutError, ValueError, RuntimeError) as error:
            raise _no_cluster(self._address, error) from None
        # In a list, so that a worker checks its versions before it reads the runner.
        self._shelf = [ray.put(self._runner)]
        # Errors are rows; a worker that dies is handled by `Executor`.
        self._task = ray.remote(max_retries=0)(_ray_task)
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        import ray

        ray.shutdown()

    def _submit(self, task: list[Run]) -> Future[Any]:
        wanted = dict(self._runner.versions)
        future: Future[Any] = self._task.remote(self._shelf, wanted, task).future()
        return future

    def _result(self, future: Future[Any]) -> tuple[list[Row], float]:
        result = future.result()
        if isinstance(result, str):
            raise OutputError(result, hint="the same versions on all nodes of the cluster")
        rows, seconds = result
        return rows, seconds


def _check_address(address: str) -> None:
    """Refuse an address at which nobody answers; Ray itself tries for minutes.

    Raises:
        InvalidInput: With the reason.
    """
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if not (host and port.isdigit()):
        return
    try:
        socket.create_connection((host, int(port)), timeout=PATIENCE).close()
    except (OSError, OverflowError) as error:
        raise _no_cluster(address, error) from None


def _no_cluster(address: str, error: Exception) -> InvalidInput:
    reason = " ".join(str(error).split()).rstrip(".")[:120]
    return InvalidInput(
        f"no Ray cluster answers at {address}: {reason}.",
        hint="ray status on its head node, or --ray without an address",
    )


def _ray_task(
    shelf: Sequence[Any], wanted: dict[str, str], runs: Sequence[Run]
) -> tuple[list[Row], float] | str:
    """Make runs on a worker; a sentence where its versions differ from the driver's."""
    import ray

    found = versions()
    for name in wanted:
        if name != "machine" and found[name] != wanted[name]:
            package = name.removesuffix("_version")
            return (
                f"a worker has {package} {found[name]}; the study is made with "
                f"{package} {wanted[name]}."
            )
    return make_rows(ray.get(shelf[0]), runs)
