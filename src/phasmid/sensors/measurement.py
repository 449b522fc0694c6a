"""Measured channels: of a whole recording, or of a run while it goes on."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.recording import Recording, check_recording, new_recording
from phasmid.robot import Robot
from phasmid.scenario import Scenario, check_scenario
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
        ``foot_normal_force_measured`` and ``contact_measured``, as far as it has what they measure.

    Raises:
        InvalidInput: It has nothing that a sensor could measure, or so few samples that a sensor
            reads more often.
    """
    check_scenario(scenario)
    check_recording(recording)
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
    """Return the measured channels of one sensor at all samples.

    Args:
        sensor: Not used before.
        time: [s], shape (N,).
        true: Channels of N samples, ``body_acceleration`` [m/s²] among them for the IMU.
    """
    reading = sensor.sampling.reading_at(time)
    row = sensor.sampling.row_of(time, np.arange(reading[-1] + 1))
    noise: Any = sensor.noise(len(row))
    read = sensor.read({name: values[row] for name, values in true.items()}, noise)
    return {name: values[reading] for name, values in read.items()}


class SensorStream:
    """The readings of `sense`, while samples arrive one after another.

    Args:
        scenario: Its sensors and its gravity are used.
        robot: The robot, L legs.
        time: Of all samples that may come [s], shape (N,).

    Raises:
        InvalidInput: A sensor reads more often than there are samples.
    """

    def __init__(self, scenario: Scenario, robot: Robot, time: Float[np.ndarray, " time"]) -> None:
        scenario.sensors.check_interval(float(np.diff(time).max(initial=0.0)))
        self._time, self._velocity = time, np.zeros(3)
        self._buffers = [_ReadingBuffer(each, time) for each in robot_sensors(scenario, robot)]

    def begin(self, true: Mapping[str, np.ndarray]) -> None:
        """Make the first readings of the robot at rest, channels of one sample."""
        for buffer in self._buffers:
            buffer.begin({**true, "body_acceleration": np.zeros((1, 3))})

    def needs(self, row: int) -> bool:
        """Return whether any sensor reads at a sample."""
        return any(buffer.next_row == row for buffer in self._buffers)

    def skip(self, velocity: Float[np.ndarray, "3"]) -> None:
        """Pass a sample without readings, with the body's velocity in world axes [m/s]."""
        self._velocity = velocity

    def take(self, row: int, true: Mapping[str, np.ndarray]) -> None:
        """Let the sensors read sample `row`, channels of one sample; the samples come in order."""
        velocity = true["body_velocity"]
        acceleration = np.zeros_like(velocity)
        if row:
            acceleration = (velocity - self._velocity) / (self._time[row] - self._time[row - 1])
        self._velocity = velocity[0].copy()
        for buffer in self._buffers:
            while buffer.next_row == row:
                buffer.take({**true, "body_acceleration": acceleration})

    def measured(self, time: float) -> dict[str, np.ndarray]:
        """Return the latest readings that have arrived, at a time [s] that never decreases."""
        elapsed, measured = time - float(self._time[0]), dict[str, np.ndarray]()
        for buffer in self._buffers:
            measured |= buffer.latest(elapsed)
        return measured


class _ReadingBuffer:
    """Readings of one sensor that have not all arrived yet."""

    def __init__(self, sensor: Sensor, time: Float[np.ndarray, " time"]) -> None:
        self._sensor = sensor
        last = sensor.sampling.latest(float(time[-1] - time[0]))
        self._rows = sensor.sampling.row_of(time, np.arange(last + 2)).tolist()
        self._readings: deque[dict[str, np.ndarray]] = deque()
        self._first = self._done = 0
        self._first_noise: Any = None

    @property
    def next_row(self) -> int:
        return self._rows[self._done] if self._done < len(self._rows) else -1

    def begin(self, true: Mapping[str, np.ndarray]) -> None:
        self._first_noise = self._sensor.noise(1)
        self._append(true, self._first_noise)

    def take(self, true: Mapping[str, np.ndarray]) -> None:
        if self._done == 0:
            self._readings.clear()
        self._append(true, self._sensor.noise(1) if self._done else self._first_noise)
        self._done += 1

    def _append(self, true: Mapping[str, np.ndarray], noise: Any) -> None:
        read = self._sensor.read(true, noise)
        self._readings.append({name: values[0] for name, values in read.items()})

    def latest(self, elapsed: float) -> dict[str, np.ndarray]:
        latest = self._sensor.sampling.latest(elapsed)
        while self._first < latest and len(self._readings) > 1:
            self._readings.popleft()
            self._first += 1
        return self._readings[0]
