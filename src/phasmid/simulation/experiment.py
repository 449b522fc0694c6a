"""Walks in a simulator, recorded."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float

from phasmid.arguments import check_callable, check_type
from phasmid.motion import JointTrajectory, Motion, Walk
from phasmid.recording import Recording, load_recording
from phasmid.scenario import Scenario, check_scenario
from phasmid.sensors import sense
from phasmid.simulation.channels import run_attributes, run_channels
from phasmid.simulation.faults import Faults, spoilt_recording_channels
from phasmid.simulation.model_reference import BLOCK_SAMPLES, ModelReference
from phasmid.simulation.recorder import record_to_log, record_to_memory
from phasmid.simulation.run import Progress, Run
from phasmid.simulation.samples import Samples
from phasmid.simulation.start import check_start
from phasmid.simulation.termination import Failure
from phasmid.simulation.time_step import check_time_step
from phasmid.simulation.torque import check_feed_forward

LOGGED_FIGURES = 16 * BLOCK_SAMPLES
"""Most of the model's figures that wait for their samples where a run is in a log alone."""


def simulate(
    scenario: Scenario,
    walk: Motion,
    *,
    progress: Progress | None = None,
    log: str | Path | None = None,
    force: bool = False,
    start: Float[np.ndarray, " state"] | None = None,
) -> Recording:
    """Run a walk in the physics engine.

    The robot starts at rest on its feet, in equilibrium. Interrupting the run (Ctrl-C) ends it
    and keeps what was recorded.

    Args:
        scenario: Its simulation, contact and terrain are used.
        walk: The plan that the joints follow, or a trajectory: then there is no model beside the
            simulation, and the run ends with it.
        progress: Is told how far the run is.
        log: A file, by custom ``.rec``, that is written while the run goes on and outlives a
            killed process; `phasmid.load_recording` reads it.
        force: Whether an older file of that name is replaced.
        start: A state of an earlier run of the same walk, from `Run.state`, to go on from.

    Returns:
        What physics made of the walk, beside the model's torques and forces at the same instants.
        How the run ended is in the attributes ``ending`` and ``ending_reason``.

    Raises:
        InvalidInput: The time step cannot resolve the contact, or the walk was planned for another
            robot, gait or stride, or starts with a foot below the terrain, or the start is none
            of its states, or the log exists.
        InfeasibleLoad: The feet cannot give what the motion needs within the force model's limits.
        OutputError: The log cannot be written; what it holds until then can be read.
    """
    check_scenario(scenario)
    check_motion(walk)
    check_callable("progress", progress)
    if log is not None:
        record(scenario, walk, log, progress=progress, force=force, start=start)
        return with_sensors(scenario, load_recording(log))
    return simulate_part(scenario, walk, progress=progress, start=start, interrupted=None)


def simulate_part(
    scenario: Scenario,
    walk: Motion,
    samples: int | None = None,
    *,
    progress: Progress | None = None,
    start: Float[np.ndarray, " state"] | None = None,
    interrupted: Sequence[int] | None = (),
) -> Recording:
    """Run a walk as `simulate` does, or its beginning alone.

    Args:
        scenario: As in `simulate`.
        walk: As in `simulate`.
        samples: How many to record at most; None: all.
        progress: As in `simulate`.
        start: As in `simulate`.
        interrupted: The run is stopped as soon as this is not empty; None: at Ctrl-C.

    Raises:
        InvalidInput: As in `simulate`.
        InfeasibleLoad: As in `simulate`.
    """
    scenario = _lasting(scenario, walk)
    run, figures = _prepare(scenario, walk, start, samples=samples, interrupted=interrupted or ())
    recording = record_to_memory(
        run,
        lambda rows, time: _told(run, rows, time, figures),
        run_attributes(scenario, walk, run),
        samples=samples,
        progress=progress,
        interrupted=interrupted,
    )
    return with_sensors(scenario, recording)


def with_sensors(scenario: Scenario, recording: Recording) -> Recording:
    """A recording with what its sensors would have told, where the scenario asks for that.

    A log does not hold it, since it follows from the rest. Faults that the recording tells of are
    in what its sensors tell.
    """
    if scenario.sensors.measured != "everything":
        return recording
    told = sense(scenario, recording)
    texts = json.loads(str(told.attrs.get("faults", "[]")))
    if not texts:
        return told
    faults = Faults(scenario.load_robot(), texts, scenario.sensors.contact_threshold)
    added = [str(name) for name in told.data_vars if name not in recording.data_vars]
    channels = {name: np.asarray(told[name].values) for name in added}
    spoilt = spoilt_recording_channels(faults, np.asarray(told["time"].values), channels)
    return told.assign({name: (told[name].dims, spoilt[name], told[name].attrs) for name in added})


def record(
    scenario: Scenario,
    walk: Motion,
    path: str | Path,
    *,
    progress: Progress | None = None,
    force: bool = False,
    start: Float[np.ndarray, " state"] | None = None,
) -> Failure | None:
    """Run a walk as `simulate` does, into a log file alone, in memory that does not grow with it.

    Args:
        scenario: As in `simulate`.
        walk: As in `simulate`.
        path: The log file.
        progress: As in `simulate`.
        force: As in `simulate`.
        start: As in `simulate`.

    Returns:
        What ended the run early; None where it was completed.

    Raises:
        InvalidInput: As in `simulate`.
        InfeasibleLoad: As in `simulate`.
        OutputError: As in `simulate`.
    """
    scenario = _lasting(scenario, walk)
    run, figures = _prepare(scenario, walk, start, kept=LOGGED_FIGURES)
    return record_to_log(
        run,
        lambda rows, time: _told(run, rows, time, figures),
        run_attributes(scenario, walk, run),
        path,
        progress=progress,
        force=force,
    )


def check_motion(walk: object, name: str = "walk") -> None:
    """Refuse what is no motion, such as its name.

    Args:
        walk: What was given.
        name: Of the argument.

    Raises:
        InvalidInput: It is something else.
    """
    must, hint = "a plan or a trajectory", "phasmid.plan(scenario)"
    check_type(name, walk, (Walk, JointTrajectory), must, hint)


def _lasting(scenario: Scenario, walk: Motion) -> Scenario:
    """The scenario; of a trajectory for no longer than it lasts."""
    if isinstance(walk, JointTrajectory) and walk.duration < scenario.duration:
        return scenario.replace(duration=walk.duration)
    return scenario


def _prepare(
    scenario: Scenario,
    walk: Motion,
    start: Float[np.ndarray, " state"] | None,
    *,
    samples: int | None = None,
    interrupted: Sequence[int] = (),
    kept: int = sys.maxsize,
) -> tuple[Run, ModelReference | None]:
    """The run, ready to start, of which what cannot be is refused at once; and what its model says.

    Of a trajectory there is no model.
    """
    walk.check_planned_for(scenario)
    check_time_step(scenario, walk)
    check_feed_forward(scenario, walk)
    if start is None:
        check_start(scenario, walk)
    run = new_run(scenario, walk, start=start, interrupted=interrupted)
    if isinstance(walk, JointTrajectory):
        return run, None
    last = len(run.time) if samples is None else min(samples, len(run.time))
    figures = ModelReference(scenario, walk, kept=kept)
    figures.check(float(run.time[last - 1]), interrupted)
    return run, figures


def _told(
    run: Run, rows: Samples, time: Float[np.ndarray, " time"], figures: ModelReference | None
) -> dict[str, np.ndarray]:
    """All channels at some samples: the model's beside the engine's."""
    if isinstance(run.walk, JointTrajectory):
        return run_channels(run, rows, run.walk.channels(time))
    assert figures is not None
    return run_channels(run, rows, figures.at(time))


def new_run(
    scenario: Scenario,
    walk: Motion,
    *,
    start: Float[np.ndarray, " state"] | None = None,
    interrupted: Sequence[int] = (),
) -> Run:
    """The run of a walk, about to start, in the simulator that knows the contact law.

    Args:
        scenario: As in `simulate`.
        walk: As in `simulate`.
        start: As in `simulate`.
        interrupted: It comes to rest no further as soon as this is not empty.

    Raises:
        InvalidInput: That simulator cannot do something else that the scenario asks for, or the
            start is none of its states.
    """
    if scenario.contact.contact_law != "simscape":
        return Run(scenario, walk, start=start, interrupted=interrupted)
    # Here, since it readies its loops for the compiler when it is first imported.
    from phasmid.simulation.simscape.run import TrunkRun

    return TrunkRun(scenario, walk, start=start, interrupted=interrupted)


def check_load(
    scenario: Scenario,
    walk: Walk,
    *,
    until: float | None = None,
    interrupted: Sequence[int] = (),
) -> None:
    """Refuse a walk whose load the scenario's force model cannot share.

    Where all cycles are alike, one of them is looked at.

    Args:
        scenario: Tells the model and the recorded instants.
        walk: The plan.
        until: The last instant that is looked at [s]; None: the walk's last.
        interrupted: Nothing more is looked at as soon as this is not empty.

    Raises:
        InvalidInput: The load transfer takes longer than the gait allows.
        InfeasibleLoad: The feet cannot give what the motion needs within the model's limits.
    """
    last = scenario.duration if until is None else until
    ModelReference(scenario, walk, kept=0).check(last, interrupted)
