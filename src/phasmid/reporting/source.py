"""Robot, scenario and gait of a recording."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from phasmid.errors import InvalidInput, plain
from phasmid.gait import Gait
from phasmid.recording import Recording
from phasmid.robot import Appearance, Robot
from phasmid.scenario import Scenario, recorded_scenario, scenario_names

LEAST = 1e-6
"""Least stall torque [N·m] and no-load speed [rad/s], so that shares of them are finite."""


@dataclass(frozen=True, eq=False)
class Source:
    """Robot and experiment of a recording.

    Attributes:
        robot: The robot as simulated, with the scenario's variants of mass, mounts and stance.
        scenario: The experiment.
        gait: The gait.
        weight: Weight of the whole robot [N].
    """

    robot: Robot
    scenario: Scenario
    gait: Gait
    weight: float

    @property
    def step_time(self) -> float:
        """Duration of a stance, in which the body makes one step [s]."""
        return self.gait.duty_factor * self.scenario.stride.period

    @property
    def supply(self) -> float | None:
        """Supply of servos that move the joints by their own law [V]; None for other drives."""
        own = self.scenario.simulation.drive == "servo"
        known = self.robot.servo.stall_current is not None
        return self.scenario.servo.supply(self.robot.servo) if own and known else None

    @property
    def stall_torque(self) -> float:
        """Stall torque of the servos at their supply, or else as rated [N·m]."""
        servo = self.robot.servo
        if self.supply is None:
            return servo.stall_torque
        servo = self.scenario.servo.set_up(servo)
        return max(servo.stall_at(self.supply), LEAST)

    @property
    def continuous_torque(self) -> float:
        """Torque that the servos hold continuously [N·m]."""
        return min(self.robot.servo.continuous, self.stall_torque)

    @property
    def no_load_speed(self) -> float:
        """No-load speed of the servos at their supply, or else as rated [rad/s]."""
        servo = self.robot.servo
        if self.supply is None:
            return servo.no_load_speed
        return max(servo.motor.no_load_speed(self.supply), LEAST)


def read_source(recording: Recording, appearance: Appearance | None = None) -> Source:
    """Return robot and experiment of a recording.

    Args:
        recording: The recording.
        appearance: The robot's meshes, where they do not come with phasmid.

    Raises:
        InvalidInput: The recording carries none, or they do not fit its channels.
    """
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
    """Return both as they were run; cached for the figures of a report."""
    experiment, base = recorded_scenario({"scenario": scenario, "robot": robot})
    return experiment, experiment.vary(base)


def channel(recording: Recording, name: str) -> np.ndarray | None:
    """Return a channel's values, or None where it is not recorded."""
    return np.asarray(recording[name].values) if name in recording.data_vars else None


def finite_part(recording: Recording) -> Recording:
    """Return the recording up to its first sample that is not finite; itself where all are finite.

    A channel that is not finite from the beginning is left out. Sensor channels may hold NaN, from
    failed sensors.
    """
    time = recording.sizes["time"]
    good, lost = np.ones(time, dtype=bool), []
    for name in recording.data_vars:
        if str(name).startswith("imu_") or str(name).endswith("_measured"):
            continue
        values = np.asarray(recording[name].values)
        # The sum of a finite channel is finite, and quick to compute.
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
    """Return time [s] and text of the controller's events; safe to print."""
    try:
        stored = json.loads(str(recording.attrs.get("events", "[]")))
        return [(float(time), plain(str(sentence))) for time, sentence in stored]
    except (ValueError, TypeError):
        return []


def attribute(recording: Recording, name: str) -> str:
    """Return an attribute as text that is safe to print; empty where it is absent."""
    return plain(str(recording.attrs.get(name, "")))
