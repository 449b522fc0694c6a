"""Measured channels: of a whole recording, or of a run while it goes on."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.recording import Recording, new_recording
from phasmid.robot import Robot
from phasmid.scenario import Scenario
from phasmid.sensors.models import Sensor, robot_sensors


def sense(scenario: Scenario, recording: Recording) -> Recording:
    """Add the channels that the robot's sensors would have measured to a recording.

    Every sensor reads at its own rate, with delay, resolution and noise; its last reading holds
    until the next one. The noise follows from the scenario's seed alone: a recording is measured
    the same way each time, and a longer one begins like a shorter one.

    Args:
        scenario: Its robot and its sensors' rates, delays and noise are used.
        recording: True channels, such as `simulate` returns.

    Returns:
        The recording with the channels ``joint_position_measured``, ``joint_load_measured``,
        ``imu_angular_velocity``, ``imu_acceleration``, ``imu_orientation``,
        ``foot_normal_force_measured`` and ``contact_measured``, as far as their sources exist.

    Raises:
        InvalidInput: It has nothing that a sensor could measure, or so few samples that a sensor
            reads more often.
    """
    channels = {str(name): np.asarray(recording[name].values) for name in recording.data_vars}
    time = np.asarray(recording["time"].values)
    true, measured = dict(channels), dict[str, np.ndarray]()
    if "body_velocity" in channels:
        true["body_acceleration"] = mean_acceleration(time, channels["body_velocity"])
    interval = float(np.diff(time).max(initial=0.0))
    for sensor in robot_sensors(scenario, scenario.load_robot()):
        if all(name in true for name in sensor.needs):
            scenario.sensors.check_interval(interval, [sensor.name])
            measured |= measure(sensor, time, true)
    if not measured:
        raise InvalidInput(
            "the recording has nothing that a sensor could measure.", hint="phasmid.simulate"
        )
    attributes = {str(name): value for name, value in recording.attrs.items()}
    return new_recording(time, channels | measured, attributes)


def mean_acceleration(
    time: Float[np.ndarray, " time"], velocity: Float[np.ndarray, "time 3"]
) -> Float[np.ndarray, "time 3"]:
    """Return the mean acceleration since the sample before [m/s²], zero at the first, (N, 3).

    A sensor with a low-pass filter of its own measures this mean.
    """
    acceleration = np.zeros_like(velocity)
    acceleration[1:] = np.diff(velocity, axis=0) / np.diff(time)[:, None]
    return acceleration


def measure(
    sensor: Sensor, time: Float[np.ndarray, " time"], true: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """Return the measured channels of one unused sensor at N samples.

    Args:
        sensor: The sensor.
        time: [s], shape (N,).
        true: Channels of the samples, ``body_acceleration`` [m/s²] among them for the IMU.
    """
    reading = sensor.sampling.latest(time - time[0])
    row = sensor.sampling.row_of(time, np.arange(reading[-1] + 1))
    noise: Any = sensor.noise(len(row))
    read = sensor.read({name: values[row] for name, values in true.items()}, noise)
    return {name: values[reading] for name, values in read.items()}


class SensorStream:
    """The readings of `sense`, while samples arrive one after another.

    Args:
        scenario: Its sensors and its gravity are used.
        robot: The robot, L legs.
        interval: Time between samples [s].
        first: Channels of one sample of the robot at rest, which are read at once.

    Attributes:
        next_row: Index of the next sample that a sensor reads.
    """

    def __init__(
        self, scenario: Scenario, robot: Robot, interval: float, first: Mapping[str, np.ndarray]
    ) -> None:
        sensors = robot_sensors(scenario, robot)
        self._readings = [_Readings(sensor, interval, first) for sensor in sensors]
        self.next_row = 0

    def take(self, true: Mapping[str, np.ndarray]) -> None:
        """Let the sensors read the sample of index `next_row`, channels of one sample."""
        for readings in self._readings:
            while readings.next_row == self.next_row:
                readings.take(true)
        self.next_row = min(readings.next_row for readings in self._readings)

    def measured(self, elapsed: float) -> dict[str, np.ndarray]:
        """Return the latest readings that have arrived, at a time [s] that never decreases."""
        measured: dict[str, np.ndarray] = {}
        for readings in self._readings:
            measured |= readings.latest(elapsed)
        return measured


class _Readings:
    """Readings of one sensor that have not all arrived yet."""

    def __init__(self, sensor: Sensor, interval: float, first: Mapping[str, np.ndarray]) -> None:
        self._sensor, self._interval = sensor, interval
        self._noise: Any = sensor.noise(1)
        self._pending: deque[dict[str, np.ndarray]] = deque()
        self._first = self._done = self.next_row = 0
        self._read(first)

    def take(self, true: Mapping[str, np.ndarray]) -> None:
        if self._done:
            self._noise = self._sensor.noise(1)
        else:
            self._pending.clear()
        self._read(true)
        self._done += 1
        self.next_row = self._sensor.sampling.row(self._done, self._interval)

    def _read(self, true: Mapping[str, np.ndarray]) -> None:
        read = self._sensor.read(true, self._noise)
        self._pending.append({name: values[0] for name, values in read.items()})

    def latest(self, elapsed: float) -> dict[str, np.ndarray]:
        latest = self._sensor.sampling.latest(elapsed)
        while self._first < latest and len(self._pending) > 1:
            self._pending.popleft()
            self._first += 1
        return self._pending[0]
