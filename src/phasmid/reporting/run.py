"""A run: a recording with its robot and experiment, alone or beside others."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, plain
from phasmid.experiment import Experiment
from phasmid.gait import Gait
from phasmid.recording import Recording
from phasmid.recording.channels import LARGEST_VALUE
from phasmid.reporting.steps import settling
from phasmid.reporting.style import RUN_LINES, Layout
from phasmid.robot import Appearance, Robot
from phasmid.robot.similarity import Scale
from phasmid.scenario import recorded_scenario, scenario_names
from phasmid.servo.words import servo_words

LONGEST_NAME, LONGEST_LEG_NAME = 60, 20
"""Longest names of robots and legs in figures [characters]."""

MOST_RUNS = len(RUN_LINES)
"""Most runs in one figure."""

MOST_CYCLES, LAST_CYCLES = 6, 5
"""Walks of more cycles than the first are drawn over the second number of last cycles."""

ENDINGS = {"FELL": "fell", "DIVERGED": "diverged", "STOPPED": "stopped", "CUT": "cut off"}
"""Words for recordings that were not completed."""

Needs = tuple[tuple[str, ...], ...]
"""Groups of channels; a figure requires one of each."""

POSE: Needs = (
    ("body_position",),
    ("body_orientation",),
    ("joint_position", "joint_position_target"),
)
"""Channels of the robot's pose."""


@dataclass(frozen=True, eq=False)
class Source:
    """Robot and experiment of a run.

    Attributes:
        experiment: The experiment.
        robot: The robot as simulated, with its look.
    """

    experiment: Experiment
    robot: Robot

    @property
    def gait(self) -> Gait:
        """The gait."""
        return self.experiment.course.gait

    @property
    def weight(self) -> float:
        """Weight of the whole robot [N]."""
        return self.robot.mass * self.experiment.world.gravity

    @property
    def scale(self) -> Scale:
        """Weight and leg length of the robot relative to ``phantomx-ax``."""
        return self.experiment.scale

    @property
    def settling(self) -> float:
        """Time around a switch of legs in which impacts dominate [s]."""
        return settling(self.scale, self.experiment.course.stride.step_height)

    @property
    def step_time(self) -> float:
        """Duration of a stance, in which the body makes one step [s]."""
        return self.gait.duty_factor * self.experiment.course.stride.period

    @property
    def hip_span(self) -> float:
        """Longer side of the rectangle of the hips [m], the scale of marks."""
        return float(np.ptp(self.robot.arrays.p_body_hip[:, :2], axis=0).max())

    @property
    def supply(self) -> float | None:
        """Supply of the servos that move the joints by their own law, or that is stated [V]."""
        servo = self.robot.servo
        own = self.experiment.solver.drive == "servo" and servo.stall_current is not None
        return servo.voltage if own or servo.supply is not None else None

    @property
    def continuous_torque(self) -> float:
        """Torque that the servos hold continuously [N·m]."""
        return min(self.robot.servo.continuous_torque, self.robot.servo.stall_torque)

    @property
    def joint_continuous_torque(self) -> Float[np.ndarray, "legs 3"]:
        """Torque that each joint holds continuously [N·m], shape (L, 3)."""
        return self.robot.arrays.strength * self.continuous_torque

    @property
    def title(self) -> str:
        """Robot and gait, and a scenario's name that is no preset's."""
        own = "" if self.experiment.name in scenario_names() else self.experiment.name
        parts = (own, self.robot.name, f"{self.gait.name} gait")
        return " · ".join(plain(part) for part in parts if part)


@dataclass(frozen=True, eq=False)
class Run(Source):
    """A recording with its robot and experiment.

    Attributes:
        recording: Its finite part, or a part of that.
        label: Its name beside other runs.
        line: Properties of its lines beside others.
    """

    recording: Recording
    label: str = ""
    line: dict[str, Any] = field(default_factory=dict)

    @property
    def time(self) -> np.ndarray:
        """Times of the samples [s], shape (N,)."""
        return np.asarray(self.recording["time"].values)

    @property
    def is_simulated(self) -> bool:
        """True for a simulation, False for an analysis or a robot's log."""
        return self.attribute("kind") == "simulation"

    def has(self, *names: str) -> bool:
        """Return whether one of these channels is recorded."""
        return any(name in self.recording.data_vars for name in names)

    def channel(self, *names: str) -> np.ndarray | None:
        """Return the values of the first of these channels that is recorded, or None."""
        for name in names:
            if self.has(name):
                return np.asarray(self.recording[name].values)
        return None

    def first_channel(self, names: Sequence[str], what: str = "this figure") -> str:
        """Return the name of the first of these channels that is recorded.

        Raises:
            InvalidInput: None is; ``what`` needs it.
        """
        for name in names:
            if self.has(name):
                return name
        raise self.absent(names, what)

    def absent(self, names: Sequence[str], what: str) -> InvalidInput:
        """Return the error of channels that are not recorded; ``what`` needs one of them."""
        return InvalidInput(
            f"the recording has no {' or '.join(names)}; {what} needs it.",
            hint=how_to_get(names[0]),
        )

    @property
    def velocity_command(self) -> np.ndarray | None:
        """Commanded velocity, shape (N, 3); None where the run follows a plan, also by a player."""
        is_played = self.attribute("controller") == "player"
        return None if is_played else self.channel("velocity_command")

    @property
    def can_be_drawn(self) -> bool:
        """True where the robot's pose is recorded."""
        return all(self.has(*names) for names in POSE)

    def pose(self, what: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return position [m] and orientation of the body, and joint angles [rad], of all samples.

        Raises:
            InvalidInput: They are not recorded; ``what`` needs them.
        """
        position, orientation, angles = (
            np.asarray(self.recording[self.first_channel(names, what)].values) for names in POSE
        )
        return position, orientation, angles

    @property
    def foot_force(self) -> np.ndarray | None:
        """Forces on the feet [N], shape (N, L, 3), recorded or of the model."""
        return self.channel("foot_force", "foot_force_model")

    @property
    def normal_force(self) -> np.ndarray | None:
        """Normal forces on the feet [N], shape (N, L), of the same origin as `foot_force`."""
        return self.channel(f"foot_normal_force{'' if self.has('foot_force') else '_model'}")

    def attribute(self, name: str) -> str:
        """Return an attribute as text that is safe to print; empty where it is absent."""
        return plain(str(self.recording.attrs.get(name, "")))

    def between(self, first: float, last: float) -> Run:
        """Return the part between two times [s], both included within round-off."""
        part = self.recording.sel(time=slice(first - 1e-9, last + 1e-9))
        return replace(self, recording=part)

    @property
    def caption(self) -> list[str]:
        """Robot, gait and drive, for a subtitle."""
        return [short(self.robot.name), f"{short(self.gait.name)} gait", self.drive_words]

    @property
    def drive_words(self) -> str:
        """Servo and drive in words."""
        servo = servo_words(short(self.attribute("servo") or self.robot.servo.name))
        drive = short(self.attribute("drive"))
        return f"{servo}, {drive} drive" if drive else servo

    @property
    def ending_words(self) -> str:
        """How and when a run ended that was not completed; else empty."""
        ending = ENDINGS.get(self.attribute("ending"))
        return f"{ending} at {self.time[-1]:.2f} s" if ending else ""

    @property
    def force_words(self) -> str:
        """Origin of the forces on the feet in words."""
        if not self.has("foot_force"):
            return "by the model"
        return "simulated" if self.is_simulated else "as recorded"

    @property
    def model_words(self) -> str:
        """Load sharing of the model in words; empty where it is not recorded."""
        forces = short(self.attribute("force_model"))
        known = forces and any(str(name).endswith("_model") for name in self.recording.data_vars)
        return f"model forces: {forces}" if known else ""

    def leg_name(self, leg: int) -> str:
        """Return a leg's number, from 1, and name, such as ``2 right middle``."""
        name = short(self.robot.legs[leg - 1].name, LONGEST_LEG_NAME)
        return f"{leg} {name.replace('_', ' ')}"

    def leg_title(self, leg: int, layout: Layout) -> str:
        """Return the title of a leg's panel, such as ``Leg 2, right middle`` or ``Leg 2``."""
        number, name = self.leg_name(leg).split(" ", 1)
        return f"Leg {number}" if layout.is_narrow else f"Leg {number}, {name}"


def read_run(recording: Recording, appearance: Appearance | None = None) -> Run:
    """Return the finite part of a recording with its robot and experiment.

    Args:
        recording: The recording.
        appearance: The robot's meshes, where they do not come with phasmid.

    Raises:
        InvalidInput: The recording carries none, or they do not fit its channels.
    """
    experiment = _read(*(str(recording.attrs.get(n, "")) for n in ("scenario", "robot")))
    robot = experiment.robot
    if appearance is not None:
        robot = replace(robot, appearance=appearance)
    legs = recording.sizes.get("leg")
    if legs not in (None, len(robot.legs)):
        raise InvalidInput(
            f"the recording has {legs} legs; the robot that it names, {plain(robot.name)}, "
            f"has {len(robot.legs)}."
        )
    return Run(experiment, robot, finite_part(recording))


@lru_cache(maxsize=4)
def _read(scenario: str, robot: str) -> Experiment:
    """Return what was run; cached for the parts of a report."""
    return recorded_scenario({"scenario": scenario, "robot": robot}).build()


def finite_part(recording: Recording) -> Recording:
    """Return the recording up to its first sample that is not finite; itself where all are finite.

    Values above `LARGEST_VALUE` count as infinite. A channel that is not finite from the beginning
    is left out. Sensor channels may hold NaN, from failed sensors.
    """
    count = recording.sizes["time"]
    finite, sensors = {}, {}
    for name, channel in recording.data_vars.items():
        good = np.abs(channel.values) <= LARGEST_VALUE
        if not str(name).startswith("imu_") and not str(name).endswith("_measured"):
            finite[name] = good.reshape(count, -1).all(axis=1)
        elif not (good | np.isnan(channel.values)).all():
            sensors[name] = channel.where(good)
    if sensors:
        recording = recording.assign(sensors)
    lost = [name for name, good in finite.items() if not good[0]]
    kept = [good for name, good in finite.items() if name not in lost]
    good = np.all([np.ones(count, dtype=bool), *kept], axis=0)
    stop = count if good.all() else int(np.argmin(good))
    if stop == count and not lost:
        return recording
    return recording.drop_vars(lost).isel(time=slice(0, stop))


def events(recording: Recording) -> list[tuple[float, str]]:
    """Return time [s] and text of the controller's events; safe to print."""
    try:
        stored = json.loads(str(recording.attrs.get("events", "[]")))
        return [(float(time), plain(str(sentence))) for time, sentence in stored]
    except (ValueError, TypeError):
        return []


def how_to_get(name: str) -> str:
    """Return the command that records a channel."""
    if name.startswith("servo_"):
        return "phasmid walk --drive servo records it"
    if name.endswith("_measured") or name.startswith("imu_"):
        return "phasmid walk --measured everything records it"
    if name.endswith("_model"):
        return "phasmid walk and phasmid.analyse record it"
    if name.endswith("_target") or name == "stance":
        return "phasmid walk records it, from its plan"
    return "phasmid walk and phasmid.simulate record it"


def short(name: str, longest: int = LONGEST_NAME) -> str:
    """Return a name on one line, cut off at a length."""
    name = plain(name)
    return name if len(name) <= longest else f"{name[:longest].rstrip()}…"


def gather(recordings: Sequence[Recording], labels: Sequence[str] | None = None) -> list[Run]:
    """Return recordings as the runs of one figure.

    Args:
        recordings: One, or several that are compared.
        labels: Name of each; by default its robot and gait.

    Raises:
        InvalidInput: There are none or too many, or one does not carry its robot and scenario.
    """
    count = len(recordings)
    if not 1 <= count <= MOST_RUNS:
        raise InvalidInput(f"{count} runs were given; a figure shows 1 to {MOST_RUNS}.")
    if labels is not None and len(labels) != count:
        raise InvalidInput(f"{len(labels)} labels were given for {count} runs; each needs one.")
    runs = [read_run(recording) for recording in recordings]
    words = [short(word) for word in labels or [run.title for run in runs]]
    for number, word in enumerate(words):
        label = f"{word}, run {number + 1}" if words.count(word) > 1 else word
        runs[number] = replace(runs[number], label=label, line=RUN_LINES[number])
    return runs


def shared_caption(runs: Sequence[Run]) -> list[str]:
    """Return the parts of the caption that all runs have in common."""
    rows = [run.caption for run in runs]
    return [parts[0] for parts in zip(*rows, strict=True) if len(set(parts)) == 1]


def shown_part(runs: Sequence[Run]) -> tuple[list[Run], str]:
    """Return the part of each run that figures over time show, and a note on it.

    One run is cut to its last `LAST_CYCLES` where it has more than `MOST_CYCLES`. Several are cut
    at the end of the shortest, and to the last cycles before it.

    Raises:
        InvalidInput: The runs have no time in common.
    """
    first = max(float(run.time[0]) for run in runs)
    last = min(float(run.time[-1]) for run in runs)
    if last < first:
        raise InvalidInput("the runs have no time in common; they cannot be compared over time.")
    period = max(run.experiment.course.stride.period for run in runs)
    cycles = (last - first) / period
    note = ""
    if cycles > MOST_CYCLES + 1e-6:
        first = last - LAST_CYCLES * period
        note = f"{first:.4g} to {last:.4g} s"
        if len(runs) == 1:
            note = f"last {LAST_CYCLES} of {cycles:.4g} cycles"
    return [run.between(first, last) for run in runs], note
