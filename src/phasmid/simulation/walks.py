"""Simulation of planned walks: one, or many on all cores."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from pathlib import Path

import numpy as np
from jaxtyping import Float

from phasmid.arguments import check_kind, checked
from phasmid.cores import cores
from phasmid.errors import FailedRuns, InvalidInput
from phasmid.experiment import Experiment, ScenarioLike, built
from phasmid.motion import JointTrajectory, Motion, Walk, plan
from phasmid.recording import Recording
from phasmid.simulation.drives import check_feed_forward
from phasmid.simulation.run import Progress, Run
from phasmid.simulation.start import check_start, with_time_step


@checked
def simulate(
    scenario: ScenarioLike | Experiment,
    walk: Motion,
    *,
    progress: Progress | None = None,
    log: str | Path | None = None,
    force: bool = False,
    start: Float[np.ndarray, " state"] | None = None,
) -> Recording:
    """Simulate a walk.

    The robot starts at rest on its feet, in equilibrium. Ctrl-C ends the run within a few hundred
    steps and raises KeyboardInterrupt; what was recorded until then is kept in the log, if there is
    one.

    Args:
        scenario: The scenario, or its experiment.
        walk: The plan that the joints follow, or a trajectory, which has no model channels and
            ends the run with it.
        progress: Receives the simulated time [s].
        log: A file, by custom ``.mcap``, that is written during the run and outlives a killed
            process; `phasmid.load_recording` reads it.
        force: Whether an older file of that name is replaced.
        start: A state of an earlier run of the same walk to continue from, from `Run.state`.

    Returns:
        The simulated channels, beside the model's torques and forces at the same instants. How the
        run ended is in the attributes ``ending`` and ``ending_reason``.

    Raises:
        InvalidInput: The time step cannot resolve the contact, or the walk was planned for another
            robot, gait or stride, or starts with a foot below the terrain, or the start is none
            of its states, or the log exists.
        InfeasibleLoad: The feet cannot give what the motion needs within the force model's limits.
        KeyboardInterrupt: The run was stopped by Ctrl-C.
        OutputError: The log cannot be written; what it holds until then can be read.
    """
    run = new_run(scenario, walk, start=start)
    return run.make(progress=progress, log=log, force=force)


def new_run(
    scenario: ScenarioLike | Experiment,
    walk: Motion,
    *,
    start: Float[np.ndarray, " state"] | None = None,
) -> Run:
    """Return the run of a walk, before its first step, in the simulator of its contact law.

    Arguments and errors as in `simulate`.
    """
    experiment = built(scenario)
    if isinstance(walk, JointTrajectory) and walk.duration < experiment.duration:
        experiment = experiment.replace(duration=walk.duration)
    walk = walk.for_experiment(experiment)
    experiment = with_time_step(experiment, walk)
    check_feed_forward(experiment, walk)
    if start is None:
        check_start(experiment, walk)
    if experiment.world.contact.kind != "simscape":
        return Run(experiment, walk, start=start)
    # Lazy import: its compiled functions take a while.
    from phasmid.simulation.simscape.run import SimscapeRun

    return SimscapeRun(experiment, walk, start=start)


@checked
def simulate_many(
    scenarios: Iterable[ScenarioLike | Experiment | tuple[ScenarioLike | Experiment, Walk]],
    *,
    workers: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> list[Recording]:
    """Simulate independent walks on all cores; each gives the same bits as by itself.

    Args:
        scenarios: The scenarios, with or without a plan.
        workers: Number of runs at a time; by default the number of cores.
        progress: Receives the number of runs that have ended.

    Returns:
        What `simulate` returns for each, in the same order.

    Raises:
        InvalidInput: There is no worker.
        FailedRuns: Some were refused or failed; it names them and carries the recordings of the
            others.
        KeyboardInterrupt: The runs were stopped by Ctrl-C.
    """
    pair = tuple[ScenarioLike | Experiment, Walk]
    pairs: list[tuple[ScenarioLike | Experiment, Walk | None]] = []
    for i, one in enumerate(scenarios):
        check_kind(one, ScenarioLike | Experiment | pair, f"scenarios[{i}]")
        pairs.append(one if isinstance(one, tuple) else (one, None))
    if workers is not None and workers < 1:
        raise InvalidInput(f"workers is {workers}; it must be 1 or more.")
    stopped: list[int] = []
    recordings: list[Recording | None] = [None] * len(pairs)
    errors: dict[int, Exception] = {}

    def run(scenario: ScenarioLike | Experiment, walk: Walk | None) -> Recording:
        experiment = built(scenario)
        return new_run(experiment, walk or plan(experiment)).simulate(interrupted=stopped)

    # Threads are enough: MuJoCo releases Python's lock during each step.
    with ThreadPoolExecutor(min(workers or cores(), max(1, len(pairs)))) as pool:
        places: dict[Future[Recording], int] = {
            pool.submit(run, *pair): place for place, pair in enumerate(pairs)
        }
        try:
            for count, done in enumerate(as_completed(places), 1):
                try:
                    recordings[places[done]] = done.result()
                except Exception as error:
                    errors[places[done]] = error
                if progress:
                    progress(count)
        except BaseException:
            # Ctrl-C, for one: the runs under way end within a block of steps.
            stopped.append(1)
            pool.shutdown(cancel_futures=True)
            raise
    if errors:
        raise FailedRuns([scenario.name for scenario, _ in pairs], recordings, errors)
    return [recording for recording in recordings if recording is not None]
