"""Independent runs side by side."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor, as_completed

from phasmid.arguments import check_callable, check_type, described
from phasmid.cores import cores
from phasmid.errors import FailedRuns, InvalidInput
from phasmid.motion import Walk, plan
from phasmid.recording import Recording
from phasmid.scenario import Scenario
from phasmid.simulation.experiment import check_motion, simulate_part


def simulate_many(
    scenarios: Iterable[Scenario | tuple[Scenario, Walk]],
    *,
    workers: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> list[Recording]:
    """Run independent walks on all cores; each gives the same bits as by itself.

    Args:
        scenarios: What to run; each is planned first, unless its plan stands beside it.
        workers: How many run at a time; by default as many as there are cores.
        progress: Is told how many have ended.

    Returns:
        What `simulate` gives for each, in the same order.

    Raises:
        InvalidInput: There is no worker, or something is no scenario and no scenario with its plan.
        FailedRuns: Some were refused or failed; it names them and carries the recordings of the
            others.
    """
    must = "a list of scenarios"
    check_type("scenarios", scenarios, (Iterable,), must, "simulate_many([scenario])")
    given = list(scenarios)
    for place, one in enumerate(given):
        _check(one, f"scenarios[{place}]")
    check_callable("progress", progress)
    if workers is not None:
        check_type("workers", workers, (int,), "a whole number")
        if workers < 1:
            raise InvalidInput(f"workers is {workers}; it must be 1 or more.")
    stopped: list[int] = []
    recordings: list[Recording | None] = [None] * len(given)
    errors: dict[int, Exception] = {}
    # Threads are enough: the engine releases Python's lock during each step.
    with ThreadPoolExecutor(min(workers or cores(), max(1, len(given)))) as pool:
        places: dict[Future[Recording], int] = {
            pool.submit(_simulate, one, stopped): place for place, one in enumerate(given)
        }
        try:
            for count, done in enumerate(as_completed(places), 1):
                try:
                    recordings[places[done]] = done.result()
                except Exception as error:
                    # Also a mistake of ours: the other runs are worth keeping.
                    errors[places[done]] = error
                if progress:
                    progress(count)
        except BaseException:
            # Ctrl-C, for one: the runs under way end within a block of steps.
            stopped.append(1)
            pool.shutdown(cancel_futures=True)
            raise
    if errors:
        names = [_scenario(one).name for one in given]
        raise FailedRuns(names, recordings, errors)
    return [recording for recording in recordings if recording is not None]


def _check(one: object, name: str) -> None:
    """Refuse what is no scenario and no scenario with its plan."""
    if isinstance(one, Scenario):
        return
    if not (isinstance(one, tuple) and len(one) == 2 and isinstance(one[0], Scenario)):
        raise InvalidInput(
            f"{name} is {described(one)}; it must be a Scenario, or a Scenario and its plan.",
            hint='phasmid.load_scenario("paper")',
        )
    check_motion(one[1], f"{name}[1]")


def _scenario(one: Scenario | tuple[Scenario, Walk]) -> Scenario:
    return one if isinstance(one, Scenario) else one[0]


def _simulate(one: Scenario | tuple[Scenario, Walk], stopped: list[int]) -> Recording:
    scenario, walk = (one, plan(one)) if isinstance(one, Scenario) else one
    return simulate_part(scenario, walk, interrupted=stopped)
