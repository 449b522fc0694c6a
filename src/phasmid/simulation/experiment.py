"""Experiments: a run of a scenario, recorded in memory or in a log."""

from __future__ import annotations

import json
import signal
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.cores import cores
from phasmid.errors import FailedRuns, InvalidInput
from phasmid.motion import JointTrajectory, Motion, Walk, plan
from phasmid.recording import Recording, RecordingLog, load_recording, new_recording
from phasmid.recording.recording import Attributes
from phasmid.scenario import Scenario
from phasmid.sensors import sense
from phasmid.simulation.channels import ending_attributes, run_attributes
from phasmid.simulation.drives import check_feed_forward
from phasmid.simulation.faults import Faults
from phasmid.simulation.loop import Samples
from phasmid.simulation.model_reference import ModelReference
from phasmid.simulation.run import Progress, Run
from phasmid.simulation.start import check_start, check_time_step
from phasmid.simulation.termination import Ending, Failure


class Experiment(ABC):
    """A run that can be made, and how it is recorded.

    Attributes:
        scenario: The scenario.
    """

    scenario: Scenario

    @abstractmethod
    def begin_run(self, *, samples: int | None = None, interrupted: Sequence[int] = ()) -> Run:
        """Return the run before its first step.

        Args:
            samples: Number of samples to be recorded; None: all.
            interrupted: The robot stops settling as soon as this is not empty.
        """

    def channels(self, run: Run, samples: Samples) -> dict[str, np.ndarray]:
        """Return all channels of the samples that are recorded next."""
        return run.channels(samples)

    def attributes(self, run: Run) -> Attributes:
        """Return the recording's attributes, except for how the run ended."""
        return run_attributes(run)

    def final_attributes(self, run: Run) -> Attributes:
        """Return attributes that are known at the end of the run only."""
        del run
        return {}

    def shortfall(self, run: Run) -> Failure | None:
        """Return why a run that came to its end is incomplete, or None."""
        del run
        return None

    def simulate(
        self,
        samples: int | None = None,
        *,
        progress: Progress | None = None,
        interrupted: Sequence[int] | None = None,
    ) -> Recording:
        """Make the run, recorded in memory.

        Args:
            samples: Number of samples to record at most; None: all.
            progress: Receives the simulated time [s].
            interrupted: The run stops as soon as this is not empty; None: at Ctrl-C.
        """
        run = self.begin_run(samples=samples, interrupted=interrupted or ())
        count = len(run.time) if samples is None else min(samples, len(run.time))
        channels: dict[str, np.ndarray] = {}

        def keep(rows: Samples) -> None:
            part = slice(run.done, run.done + len(rows))
            for name, values in self.channels(run, rows).items():
                if name not in channels:
                    channels[name] = np.empty((count, *values.shape[1:]), values.dtype)
                channels[name][part] = values

        noticed = noticed_interrupts() if interrupted is None else nullcontext(interrupted)
        with noticed as seen:
            until = None if samples is None else run.step_of(count - 1) + 1
            failure = run.advance(progress, keep=keep, interrupted=seen, until=until)
        if samples is None:
            failure = failure or self.shortfall(run)
        attributes = {**self.attributes(run), **self._outcome(run, failure)}
        recorded = {name: values[: run.done] for name, values in channels.items()}
        recording = new_recording(run.time[: run.done], recorded, attributes)
        return with_sensors(self.scenario, recording)

    def record(
        self, path: str | Path, *, progress: Progress | None = None, force: bool = False
    ) -> Failure | None:
        """Make the run, recorded into a log file only, in memory that does not grow with it.

        Args:
            path: The log file.
            progress: Receives the simulated time [s].
            force: Whether an older file of that name is replaced.

        Returns:
            What ended the run early; None where it was completed.

        Raises:
            InvalidInput: The file exists and may not be replaced.
            OutputError: It cannot be written.
        """
        run = self.begin_run()

        def keep(rows: Samples) -> None:
            time = run.time[run.done : run.done + len(rows)]
            log.append(time, self.channels(run, rows))

        first = self.channels(run, run.first)
        cut = {"ending": Ending.CUT.name, "ending_reason": Ending.CUT.value}
        attributes = {**self.attributes(run), **cut}
        with (
            noticed_interrupts() as interrupted,
            RecordingLog(path, first, attributes, time=run.time, force=force) as log,
        ):
            failure = run.advance(progress, keep=keep, interrupted=interrupted)
            failure = failure or self.shortfall(run)
            log.finish(self._outcome(run, failure))
        return failure

    def make(self, *, progress: Progress | None, log: str | Path | None, force: bool) -> Recording:
        """Make the run, in memory or through a log; arguments as in `phasmid.simulate`."""
        if log is None:
            return self.simulate(progress=progress)
        self.record(log, progress=progress, force=force)
        return with_sensors(self.scenario, load_recording(log))

    def _outcome(self, run: Run, failure: Failure | None) -> Attributes:
        return {**ending_attributes(failure), **self.final_attributes(run)}


class WalkExperiment(Experiment):
    """The simulation of a planned walk or a trajectory; arguments and errors as in `simulate`."""

    def __init__(
        self, scenario: Scenario, walk: Motion, start: Float[np.ndarray, " state"] | None = None
    ) -> None:
        if isinstance(walk, JointTrajectory) and walk.duration < scenario.duration:
            scenario = scenario.replace(duration=walk.duration)
        walk.check_planned_for(scenario)
        check_time_step(scenario, walk)
        check_feed_forward(scenario, walk)
        if start is None:
            check_start(scenario, walk)
        self.scenario, self.walk, self.start = scenario, walk, start

    def begin_run(self, *, samples: int | None = None, interrupted: Sequence[int] = ()) -> Run:
        """Return the run before its first step, its load checked.

        Raises:
            InfeasibleLoad: The feet cannot give what the motion needs within the model's limits.
        """
        run = new_run(self.scenario, self.walk, start=self.start, interrupted=interrupted)
        if isinstance(self.walk, Walk):
            last = len(run.time) if samples is None else min(samples, len(run.time))
            self._model = ModelReference(self.scenario, self.walk, float(run.time[last - 1]))
            self._model.check(interrupted)
        return run

    def channels(self, run: Run, samples: Samples) -> dict[str, np.ndarray]:
        """Return the model's channels beside the simulated ones."""
        walk, time = self.walk, run.time[run.done : run.done + len(samples)]
        model = walk.channels(time) if isinstance(walk, JointTrajectory) else self._model.at(time)
        return {**model, **run.channels(samples)}


def simulate(
    scenario: Scenario,
    walk: Motion,
    *,
    progress: Progress | None = None,
    log: str | Path | None = None,
    force: bool = False,
    start: Float[np.ndarray, " state"] | None = None,
) -> Recording:
    """Simulate a walk.

    The robot starts at rest on its feet, in equilibrium. Interrupting the run (Ctrl-C) ends it
    and keeps what was recorded.

    Args:
        scenario: Its simulation, contact and terrain are used.
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
        OutputError: The log cannot be written; what it holds until then can be read.
    """
    experiment = WalkExperiment(scenario, walk, start)
    return experiment.make(progress=progress, log=log, force=force)


def new_run(
    scenario: Scenario,
    walk: Motion,
    *,
    start: Float[np.ndarray, " state"] | None = None,
    interrupted: Sequence[int] = (),
) -> Run:
    """Return the run of a walk, before its first step, in the simulator of its contact law.

    Arguments as in `simulate`; the robot stops settling as soon as `interrupted` is not empty.

    Raises:
        InvalidInput: The simulator does not support the scenario, or the start is none of its
            states.
    """
    if scenario.contact.contact_law != "simscape":
        return Run(scenario, walk, start=start, interrupted=interrupted)
    # Lazy import: its compiled functions take a while.
    from phasmid.simulation.simscape.run import SimscapeRun

    return SimscapeRun(scenario, walk, start=start, interrupted=interrupted)


def check_load(
    scenario: Scenario,
    walk: Walk,
    *,
    until: float | None = None,
    interrupted: Sequence[int] = (),
) -> None:
    """Refuse a walk whose load the scenario's force model cannot share until a time [s].

    Raises:
        InvalidInput: The load transfer takes longer than the gait allows.
        InfeasibleLoad: The feet cannot give what the motion needs within the model's limits.
    """
    last = scenario.duration if until is None else until
    ModelReference(scenario, walk, last).check(interrupted)


def with_sensors(scenario: Scenario, recording: Recording) -> Recording:
    """Add the measured channels, with the recorded faults, where the scenario measures.

    A log does not hold these channels, since they follow from the others.
    """
    if scenario.sensors.measured != "everything":
        return recording
    sensed = sense(scenario, recording)
    texts = json.loads(str(sensed.attrs.get("faults", "[]")))
    faults = Faults(scenario.load_robot(), texts, scenario.sensors.contact_threshold)
    added = sensed.data_vars.keys() - recording.data_vars.keys()
    channels = {str(name): sensed[name].values for name in added}
    faulty = faults.apply_to_recording(sensed["time"].values, channels)
    return sensed.assign(
        {name: (sensed[name].dims, values, sensed[name].attrs) for name, values in faulty.items()}
    )


@contextmanager
def noticed_interrupts() -> Iterator[list[int]]:
    """Note the first Ctrl-C in a list instead of raising it; a second one is raised."""
    noticed: list[int] = []

    def note(number: int, frame: Any) -> None:
        if noticed:
            signal.default_int_handler(number, frame)
        noticed.append(number)

    try:
        before = signal.signal(signal.SIGINT, note)
    except ValueError:
        # Only the main thread may handle signals, and only it receives them.
        yield noticed
        return
    try:
        yield noticed
    finally:
        signal.signal(signal.SIGINT, before)


# Several runs -------------------------------------------------------------------------------------


def simulate_many(
    scenarios: Iterable[Scenario | tuple[Scenario, Walk]],
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
    """
    pairs = [(one, None) if isinstance(one, Scenario) else one for one in scenarios]
    if workers is not None and workers < 1:
        raise InvalidInput(f"workers is {workers}; it must be 1 or more.")
    stopped: list[int] = []
    recordings: list[Recording | None] = [None] * len(pairs)
    errors: dict[int, Exception] = {}

    def run(scenario: Scenario, walk: Walk | None) -> Recording:
        return WalkExperiment(scenario, walk or plan(scenario)).simulate(interrupted=stopped)

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


REFINED_CYCLES = 2
"""Cycles of a walk that are compared at half the time step: the first and one in full swing."""


@dataclass(frozen=True)
class Refinement:
    """The difference between a walk and the same walk at half its time step.

    Attributes:
        time_step: Of the walk [s].
        duration: Compared part of the walk [s].
        normal_force: Rms difference of the feet's normal forces over their rms, at all instants.
        joint_torque: Rms difference of the joint torques over their rms, at all instants.
        way: Largest distance between the two trunks [m].
    """

    time_step: float
    duration: float
    normal_force: float
    joint_torque: float
    way: float

    def attributes(self) -> dict[str, float]:
        """Return the numbers as attributes of a recording, for its summary."""
        return {f"refinement_{name}": value for name, value in vars(self).items()}


def time_step_refinement(scenario: Scenario, walk: Motion) -> Refinement | None:
    """Simulate the first two cycles at the time step and at half of it, and compare.

    The error of the time step is about as large as this difference, as MuJoCo's is of first order.
    Arguments and errors are those of `simulate`.

    Returns:
        The difference; None where one of the two runs did not come to its end.

    Raises:
        KeyboardInterrupt: It was stopped by Ctrl-C.
    """
    duration = min(scenario.duration, REFINED_CYCLES * scenario.stride.period)
    dt = scenario.simulation.dt
    changes = {"duration": duration, "record_interval": dt * scenario.record_steps}
    runs = []
    for shorter in (scenario.replace(**changes), scenario.replace(**changes, dt=dt / 2)):
        runs.append(simulate(shorter, walk))
        if runs[-1].attrs["ending"] == Ending.STOPPED.name:
            raise KeyboardInterrupt
        if runs[-1].attrs["ending"] != Ending.COMPLETED.name:
            return None
    coarse, fine = runs

    def difference(name: str) -> float:
        error = coarse[name].values - fine[name].values
        return float(np.sqrt((error**2).mean() / (fine[name].values ** 2).mean()))

    apart = coarse["body_position"].values - fine["body_position"].values
    return Refinement(
        time_step=dt,
        duration=duration,
        normal_force=difference("foot_normal_force"),
        joint_torque=difference("joint_torque"),
        way=float(np.linalg.norm(apart, axis=1).max()),
    )
