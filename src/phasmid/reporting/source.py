"""What a recording says of itself: its robot, its scenario, its gait."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from phasmid.errors import InvalidInput, plain
from phasmid.gait import Gait
from phasmid.recording import Recording, check_recording
from phasmid.robot import Appearance, Robot
from phasmid.scenario import Scenario, recorded_scenario, scenario_names

LEAST = 1e-6
"""What is taken as stall torque [N·m] and no-load speed [rad/s] of a servo whose supply does not
overcome its friction, so that shares of them are numbers."""


@dataclass(frozen=True, eq=False)
class Source:
    """The machine and the experiment behind a recording.

    Attributes:
        robot: As it was simulated: with the scenario's variants of mass, mounts and stance.
        scenario: The experiment; its robot is only a file's name.
        gait: Which legs were to stand, when.
        weight: Of the whole robot [N].
    """

    robot: Robot
    scenario: Scenario
    gait: Gait
    weight: float

    @property
    def step_time(self) -> float:
        """Time for which a foot stands, and in which the body makes one step [s]."""
        return self.gait.duty_factor * self.scenario.stride.period

    @property
    def supply(self) -> float | None:
        """Supply of servos that move the joints by their own law [V]; None for other drives."""
        own = self.scenario.simulation.drive == "servo"
        known = self.robot.servo.stall_current is not None
        return self.scenario.servo.supply(self.robot.servo) if own and known else None

    @property
    def stall_torque(self) -> float:
        """Of the servos at their supply, or else as rated [N·m]."""
        servo = self.robot.servo
        if self.supply is None:
            return servo.stall_torque
        servo = self.scenario.servo.set_up(servo)
        return max(servo.stall_at(self.supply), LEAST)

    @property
    def continuous_torque(self) -> float:
        """Torque that the servos hold without an end [N·m]."""
        return min(self.robot.servo.continuous, self.stall_torque)

    @property
    def no_load_speed(self) -> float:
        """Of the servos at their supply, or else as rated [rad/s]."""
        servo = self.robot.servo
        if self.supply is None:
            return servo.no_load_speed
        return max(servo.motor.no_load_speed(self.supply), LEAST)


def read_source(recording: Recording, appearance: Appearance | None = None) -> Source:
    """The robot and the scenario that a recording carries as text.

    Args:
        recording: The recording.
        appearance: The robot's meshes, which no text carries; those that come with phasmid are
            found without it.

    Raises:
        InvalidInput: The recording carries none, or not one that fits its channels.
    """
    check_recording(recording)
    scenario, robot = _read(*(str(recording.attrs.get(n, "")) for n in ("scenario", "robot")))
    if appearance is not None:
        robot = replace(robot, appearance=appearance)
    legs = recording.sizes.get("leg")
    if legs not in (None, len(robot.legs)):
        raise InvalidInput(
            f"the recording has {legs} legs; the robot that it names, {plain(robot.name)}, "
            f"has {len(robot.legs)}."
        )
    gait = scenario.load_gait(len(robot.legs), [leg.name for leg in robot.legs])
    return Source(robot, scenario, gait, robot.mass * scenario.model.gravity)


def run_title(source: Source) -> str:
    """Return the title of a run: robot and gait, and a scenario's name that is no preset's."""
    own = source.scenario.name not in scenario_names()
    parts = (source.scenario.name if own else "", source.robot.name, f"{source.gait.name} gait")
    return " · ".join(plain(part) for part in parts if part)


@lru_cache(maxsize=4)
def _read(scenario: str, robot: str) -> tuple[Scenario, Robot]:
    """Both as they were run; each figure of a report asks for them."""
    experiment, base = recorded_scenario({"scenario": scenario, "robot": robot})
    return experiment, experiment.vary(base)


def channel(recording: Recording, name: str) -> np.ndarray | None:
    """A channel's numbers, or None where the recording lacks it."""
    return np.asarray(recording[name].values) if name in recording.data_vars else None


def finite_part(recording: Recording) -> Recording:
    """The recording until its first sample that is not finite, as a run that diverged ends in.

    One that is finite all through is given back itself.

    A channel that is not finite from the beginning is left out. Sensors that tell no number have
    failed, and the run has not: what they tell is kept as it is.
    """
    time = recording.sizes["time"]
    good, lost = np.ones(time, dtype=bool), []
    for name in recording.data_vars:
        if str(name).startswith("imu_") or str(name).endswith("_measured"):
            continue
        values = np.asarray(recording[name].values)
        # Most are finite all through, and so is their sum, which is sooner found.
        with np.errstate(over="ignore", invalid="ignore"):
            if np.isfinite(np.sum(values)):
                continue
        finite = np.isfinite(values.reshape(time, -1)).all(axis=1)
        if finite[0]:
            good &= finite
        else:
            lost.append(name)
    if good.all() and not lost:
        return recording
    stop = time if good.all() else int(np.argmin(good))
    return recording.drop_vars(lost).isel(time=slice(0, stop))


def events(recording: Recording) -> list[tuple[float, str]]:
    """What a controller said during a run, and when [s]; safe to print."""
    try:
        told = json.loads(str(recording.attrs.get("events", "[]")))
        return [(float(time), plain(str(sentence))) for time, sentence in told]
    except (ValueError, TypeError):
        return []


def attribute(recording: Recording, name: str) -> str:
    """An attribute as text that is safe to print; empty where the recording lacks it."""
    return plain(str(recording.attrs.get(name, "")))
