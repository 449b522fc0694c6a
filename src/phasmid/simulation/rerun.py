"""A recorded run, made again from what the recording says of itself, and compared bit by bit."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from phasmid.arguments import check_callable
from phasmid.errors import InvalidInput, plain
from phasmid.motion import plan, trajectory_from_text
from phasmid.recording import Recording, check_recording, load_recording
from phasmid.scenario import recorded_scenario
from phasmid.simulation.channels import versions
from phasmid.simulation.drive import DriveExperiment
from phasmid.simulation.experiment import simulate_part
from phasmid.simulation.run import Progress


@dataclass(frozen=True)
class Difference:
    """Where a repeated run first differs.

    Attributes:
        channel: Name of the channel.
        sample: Index of the sample.
        time: Its time [s].
        recorded: What was recorded; of an array the first number that differs.
        repeated: What came out now.
    """

    channel: str
    sample: int
    time: float
    recorded: float
    repeated: float


@dataclass(frozen=True)
class Replay:
    """What came of running a recorded walk again; as text, one sentence.

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
        found = self.difference
        if found is None:
            said = f"equal: {self.samples} samples of {self.channels} channels, bit by bit"
        else:
            said = (
                f"different: {found.channel} at sample {found.sample} ({found.time:.6g} s) is "
                f"{found.repeated!r}; {found.recorded!r} was recorded"
            )
        changed = ", ".join(
            f"{name} {now} here, {plain(then) or 'unknown'} then"
            for name, (then, now) in self.versions.items()
        )
        return f"{said}; {changed}." if changed else f"{said}."


def replay(recording: str | Path | Recording, *, progress: Progress | None = None) -> Replay:
    """Run a recorded walk again, as far as it was recorded, and compare it bit by bit.

    The same bits come out on the same kind of machine with the same versions.

    Args:
        recording: Of a simulation, or its file.
        progress: Is told how far the run is.

    Raises:
        InvalidInput: The file cannot be read, or it holds no simulation, or one that was driven by
            a controller that is none of phasmid's own.
        InfeasibleLoad: This version refuses the walk.
    """
    check_callable("progress", progress)
    if isinstance(recording, str | Path):
        recording = load_recording(recording)
    check_recording(recording)
    if recording.attrs.get("kind") != "simulation":
        raise InvalidInput(
            "only a simulation can be run again; this recording is of another kind.",
            hint="a recording that phasmid.simulate made",
        )
    scenario, robot = recorded_scenario(recording.attrs)
    scenario = scenario.replace(robot=robot)
    samples = recording.sizes["time"]
    if "controller" in recording.attrs:
        repeated = DriveExperiment.again(recording, scenario).repeat(samples, progress)
        return _compared(recording, repeated)
    text = recording.attrs.get("trajectory")
    robot = scenario.load_robot()
    # A plan begins with the same bits, however long it is.
    needed = float(recording["time"].values[-1]) + scenario.simulation.dt
    planned = scenario.replace(duration=min(scenario.duration, needed))
    walk = plan(planned) if text is None else trajectory_from_text(str(text), robot)
    repeated = simulate_part(scenario, walk, samples, start=_start(recording), progress=progress)
    return _compared(recording, repeated)


def _compared(recording: Recording, repeated: Recording) -> Replay:
    """What came of a run that was made again."""
    samples = recording.sizes["time"]
    then = {name: str(recording.attrs.get(name, "")) for name in versions()}
    changed = {name: (then[name], now) for name, now in versions().items() if then[name] != now}
    return Replay(samples, len(recording.data_vars), first_difference(recording, repeated), changed)


def first_difference(recorded: Recording, repeated: Recording) -> Difference | None:
    """The earliest sample at which a bit differs; None where there is none.

    Args:
        recorded: Its channels and samples are looked at.
        repeated: What should be the same; it may have more.
    """
    time = np.asarray(recorded["time"].values)
    found: Difference | None = None
    arrays = {"time": recorded["time"]} | {str(name): recorded[name] for name in recorded.data_vars}
    for name, array in arrays.items():
        was, now = np.asarray(array.values), np.asarray(repeated.get(name, np.empty(0)))
        was = was.reshape(len(was), -1)
        now = now.reshape(len(now), -1) if now.size else np.empty((0, was.shape[1]))
        count = min(len(was), len(now)) if now.shape[1] == was.shape[1] else 0
        other = (_bits(was[:count]) != _bits(now[:count])).any(axis=1)
        sample = int(np.argmax(other)) if other.any() else count
        if sample == len(was) or (found and found.sample <= sample):
            continue
        column = 0
        if sample < count:
            column = int(np.argmax(_bits(was[sample]) != _bits(now[sample])))
        repeats = float(now[sample, column]) if sample < count else float("nan")
        found = Difference(name, sample, float(time[sample]), float(was[sample, column]), repeats)
    return found


def _bits(values: np.ndarray) -> np.ndarray:
    """Numbers as their bits: the sign of zero counts, and what is no number equals itself."""
    return values.view(np.uint64) if values.dtype == np.float64 else values


def _start(recording: Recording) -> Float[np.ndarray, " state"] | None:
    text = recording.attrs.get("start")
    if text is None:
        return None
    try:
        return np.frombuffer(base64.b64decode(str(text), validate=True), "<f8").astype(np.float64)
    except (binascii.Error, ValueError):
        raise InvalidInput("the recording's start is not a state of a run.") from None
