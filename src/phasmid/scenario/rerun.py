"""Recorded runs, simulated again from their own attributes and compared bit by bit."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from phasmid.arguments import checked
from phasmid.control import script_from_text
from phasmid.errors import InvalidInput, plain
from phasmid.experiment import Experiment
from phasmid.motion import Motion, plan, trajectory_from_text
from phasmid.recording import Recording, load_recording
from phasmid.recording.provenance import versions
from phasmid.scenario.file import recorded_scenario
from phasmid.simulation.drive import new_drive, recorded_controller
from phasmid.simulation.run import Progress, Run
from phasmid.simulation.walks import new_run


@dataclass(frozen=True)
class Difference:
    """The first difference of a repeated run.

    Attributes:
        channel: Name of the channel.
        sample: Index of the sample.
        time: Its time [s].
        recorded: The recorded number; of an array the first that differs.
        repeated: The number now.
    """

    channel: str
    sample: int
    time: float
    recorded: float
    repeated: float


@dataclass(frozen=True)
class Replay:
    """The comparison of a recorded run with its repetition; as text, one sentence.

    Attributes:
        samples: Number of samples compared.
        channels: Number of channels compared.
        difference: The first; None where all bits are the same.
        versions: What differs here of all that the bits depend on, by name: then and now.
    """

    samples: int
    channels: int
    difference: Difference | None
    versions: Mapping[str, tuple[str, str]]

    @property
    def equal(self) -> bool:
        """Whether every bit is the same."""
        return self.difference is None

    def __str__(self) -> str:
        first = self.difference
        text = f"equal: {self.samples} samples of {self.channels} channels, bit by bit"
        if first is not None:
            text = (
                f"different: {first.channel} at sample {first.sample} ({first.time:.6g} s) is "
                f"{first.repeated!r}; {first.recorded!r} was recorded"
            )
        changed = ", ".join(
            f"{name} {now} here, {plain(then) or 'unknown'} then"
            for name, (then, now) in self.versions.items()
        )
        return f"{text}; {changed}." if changed else f"{text}."


@checked
def replay(recording: str | Path | Recording, *, progress: Progress | None = None) -> Replay:
    """Simulate a recorded run again, as far as it was recorded, and compare it bit by bit.

    The same bits result on the same kind of machine with the same versions.

    Args:
        recording: Of a simulation, or its file.
        progress: Receives the simulated time [s].

    Raises:
        InvalidInput: The file cannot be read, or it holds no simulation, or one that was driven by
            a controller that is none of phasmid's own.
        InfeasibleLoad: This version refuses the walk.
    """
    if isinstance(recording, str | Path):
        recording = load_recording(recording)
    attributes = recording.attrs
    if attributes.get("kind") != "simulation":
        raise InvalidInput(
            "only a simulation can be run again; this recording is of another kind.",
            hint="a recording that phasmid.simulate made",
        )
    experiment = recorded_scenario(attributes).build()
    # The samples are the same bits, however long the run goes on.
    last = max(float(recording["time"].values[-1]), experiment.solver.time_step)
    experiment = experiment.replace(duration=min(experiment.duration, last))
    repeated = _repeat(recording, experiment).simulate(progress=progress)
    then = {name: str(attributes.get(name, "")) for name in versions()}
    changed = {name: (then[name], now) for name, now in versions().items() if then[name] != now}
    difference = first_difference(recording, repeated)
    return Replay(recording.sizes["time"], len(recording.data_vars), difference, changed)


def first_difference(recorded: Recording, repeated: Recording) -> Difference | None:
    """Return the earliest sample of the recorded channels with a bit that differs, or None."""
    time = np.asarray(recorded["time"].values)
    first: Difference | None = None
    for name in ("time", *map(str, recorded.data_vars)):
        was, now = np.asarray(recorded[name].values), np.asarray(repeated.get(name, np.empty(0)))
        if was.shape[1:] != now.shape[1:]:
            now = np.empty((0, *was.shape[1:]))
        was, now = (np.ascontiguousarray(each).reshape(len(each), -1) for each in (was, now))
        count = min(len(was), len(now))
        differs = _bits(was[:count]) != _bits(now[:count])
        rows = np.flatnonzero(differs.any(axis=1))
        sample = int(rows[0]) if len(rows) else count
        if sample == len(was) or (first and first.sample <= sample):
            continue
        column, repeats = 0, float("nan")
        if sample < count:
            column = int(np.argmax(differs[sample]))
            repeats = float(now[sample, column])
        first = Difference(name, sample, float(time[sample]), float(was[sample, column]), repeats)
    return first


def _bits(values: np.ndarray) -> np.ndarray:
    """Return numbers as their bits: nan equals itself, -0 differs from 0."""
    return values.view(np.uint64) if values.dtype == np.float64 else values


def _repeat(recording: Recording, experiment: Experiment) -> Run:
    """Return the run of a recording, before its first step.

    Raises:
        InvalidInput: The recording does not hold its controller or its commands.
    """
    attributes = recording.attrs

    def motion() -> Motion:
        text = attributes.get("trajectory")
        if text is not None:
            return trajectory_from_text(str(text), experiment.robot)
        return plan(experiment)

    if "controller" not in attributes:
        return new_run(experiment, motion(), start=_start(attributes.get("start")))
    controller = recorded_controller(attributes, experiment, motion)
    if "commands" not in attributes:
        raise InvalidInput(
            "the recording does not hold its run's commands; it cannot be run again.",
            hint="phasmid.drive with commands in a CommandScript",
        )
    return new_drive(
        experiment,
        controller,
        script_from_text(str(attributes["commands"])),
        rate=float(attributes["control_rate"]),
        faults=json.loads(str(attributes.get("faults", "[]"))),
    )


def _start(text: object) -> Float[np.ndarray, " state"] | None:
    if text is None:
        return None
    try:
        return np.frombuffer(base64.b64decode(str(text), validate=True), "<f8").astype(np.float64)
    except ValueError:
        raise InvalidInput("the recording's start is not a state of a run.") from None
