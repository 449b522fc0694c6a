"""Recorded runs, simulated again from their own attributes and compared bit by bit."""

from __future__ import annotations

import base64
import binascii
import json
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.control import (
    Controller,
    EngineSettings,
    LocomotionEngine,
    Player,
    SafetyFilter,
    SafetySettings,
    Sequencer,
    script_from_text,
)
from phasmid.control.estimation.settings import EstimatorSettings
from phasmid.control.feed_forward.settings import FeedForwardSettings
from phasmid.errors import InvalidInput, plain
from phasmid.gait import Gait
from phasmid.motion import Motion, plan, trajectory_from_text
from phasmid.recording import Recording, load_recording
from phasmid.scenario import Scenario, recorded_scenario
from phasmid.simulation.channels import versions
from phasmid.simulation.experiment import Experiment, WalkExperiment
from phasmid.simulation.run import Progress

SCENARIO_CONTROLLER = "scenario's own"
"""Recorded name of the controller of a scenario that is driven without another one."""

SETTINGS = {
    kind.__name__: kind
    for kind in (
        EngineSettings,
        FeedForwardSettings,
        EstimatorSettings,
        Gait,
        SafetySettings,
    )
}
"""Types of recorded settings, beside numbers, texts and lists of them."""


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
    scenario, robot = recorded_scenario(attributes)
    scenario = scenario.replace(robot=robot)
    experiment = _drive if "controller" in attributes else _walk
    samples = recording.sizes["time"]
    repeated = experiment(recording, scenario).simulate(samples, progress=progress)
    then = {name: str(attributes.get(name, "")) for name in versions()}
    changed = {name: (then[name], now) for name, now in versions().items() if then[name] != now}
    return Replay(samples, len(recording.data_vars), first_difference(recording, repeated), changed)


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


def _walk(recording: Recording, scenario: Scenario) -> Experiment:
    # A plan begins with the same bits, however long it is.
    needed = float(recording["time"].values[-1]) + scenario.simulation.dt
    planned = scenario.replace(duration=min(scenario.duration, needed))
    return WalkExperiment(scenario, _motion(recording, planned), _start(recording))


def _drive(recording: Recording, scenario: Scenario) -> Experiment:
    """Return the experiment of a driven run.

    Raises:
        InvalidInput: The recording does not hold its controller or its commands.
    """
    from phasmid.simulation.drive import DriveExperiment

    attributes = recording.attrs
    text, start = attributes.get("commands"), attributes.get("start_angles")
    controller = _controller(recording, scenario)
    if text is None:
        raise InvalidInput(
            "the recording does not hold its run's commands; it cannot be run again.",
            hint="phasmid.drive with commands in a CommandScript",
        )
    return DriveExperiment(
        scenario,
        controller,
        script_from_text(str(text)),
        rate=float(attributes["control_rate"]),
        between=str(attributes["between_updates"]),
        start=None if start is None else np.array(json.loads(str(start))),
        faults=json.loads(str(attributes.get("faults", "[]"))),
    )


def _start(recording: Recording) -> Float[np.ndarray, " state"] | None:
    text = recording.attrs.get("start")
    if text is None:
        return None
    try:
        return np.frombuffer(base64.b64decode(str(text), validate=True), "<f8").astype(np.float64)
    except (binascii.Error, ValueError):
        raise InvalidInput("the recording's start is not a state of a run.") from None


def _motion(recording: Recording, scenario: Scenario) -> Motion:
    text = recording.attrs.get("trajectory")
    if text is None:
        return plan(scenario)
    return trajectory_from_text(str(text), scenario.load_robot())


def controller_attributes(controller: Controller) -> dict[str, str]:
    """Return a controller's name and settings, as attributes of a recording."""
    inner: Any = controller
    around = []
    while type(inner) in (SafetyFilter, Sequencer):
        if type(inner) is SafetyFilter:
            around.append(_to_json(inner.monitor.settings))
            inner = inner.controller
        else:
            around.append(Sequencer.__name__)
            inner = inner.walker
    kind = type(inner)
    attributes = {"controller": f"{kind.__module__}.{kind.__qualname__}"}
    if kind is LocomotionEngine:
        settings = json.dumps(_to_json(inner.settings))
        attributes = {"controller": "locomotion engine", "controller_settings": settings}
    elif kind is Player:
        settings = json.dumps({"rate": inner.rate, "lead": inner.lead})
        attributes = {"controller": "player", "controller_settings": settings}
    return attributes | ({"controller_around": json.dumps(around)} if around else {})


def _controller(recording: Recording, scenario: Scenario) -> Controller | None:
    """Return the controller of a recorded run; None: the scenario's own.

    Raises:
        InvalidInput: It is none of phasmid's.
    """
    name, robot = str(recording.attrs["controller"]), scenario.load_robot()
    if name == SCENARIO_CONTROLLER:
        return None
    try:
        settings = _from_json(json.loads(str(recording.attrs.get("controller_settings", "null"))))
        around = _from_json(json.loads(str(recording.attrs.get("controller_around", "[]"))))
        controller: Controller
        if name == "locomotion engine" and isinstance(settings, EngineSettings):
            controller = LocomotionEngine(robot, settings)
        elif name == "player":
            controller = Player(_motion(recording, scenario), **settings)
        else:
            raise ValueError(name)
        for outer in reversed(around):
            if outer == Sequencer.__name__:
                controller = Sequencer(controller, robot)
            elif isinstance(outer, SafetySettings):
                controller = SafetyFilter(controller, robot, outer)
            else:
                raise ValueError(outer)
    except (ValueError, TypeError, KeyError):
        raise InvalidInput(
            f"the run was driven by {plain(name)}, which a recording does not hold; it cannot be "
            "run again.",
            hint="phasmid.drive with that controller",
        ) from None
    return controller


def _to_json(value: Any) -> Any:
    """Return a setting as JSON types; a dataclass carries its name under ``is``."""
    if is_dataclass(value) and not isinstance(value, type):
        inner = {field.name: _to_json(getattr(value, field.name)) for field in fields(value)}
        return {"is": type(value).__name__, **inner}
    if isinstance(value, tuple | list):
        return [_to_json(each) for each in value]
    return value if value is None or isinstance(value, str | int | float) else repr(value)


def _from_json(value: Any) -> Any:
    if isinstance(value, dict):
        inner = {name: _from_json(each) for name, each in value.items() if name != "is"}
        return SETTINGS[value["is"]](**inner) if "is" in value else inner
    return tuple(_from_json(each) for each in value) if isinstance(value, list) else value
