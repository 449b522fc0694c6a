"""Measured channels: of a whole recording, or of a run while it goes on."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.arguments import checked
from phasmid.errors import InvalidInput
from phasmid.experiment import Experiment, ScenarioLike, built
from phasmid.recording import Recording, new_recording
from phasmid.simulation.sensors.models import Sensor, robot_sensors


@checked
def sense(scenario: ScenarioLike | Experiment, recording: Recording) -> Recording:
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
        # The mean since the sample before: a sensor with a low-pass filter measures this mean.
        velocity = channels["body_velocity"]
        true["body_acceleration"] = np.zeros_like(velocity)
        true["body_acceleration"][1:] = np.diff(velocity, axis=0) / np.diff(time)[:, None]
    interval = float(np.diff(time).max(initial=0.0))
    experiment = built(scenario)
    for sensor in robot_sensors(experiment):
        if all(name in true for name in sensor.needs):
            experiment.sensors.check_interval(interval, [sensor.name])
            measured |= measure(sensor, time, true)
    if not measured:
        raise InvalidInput(
            "the recording has nothing that a sensor could measure.", hint="phasmid.simulate"
        )
    attributes = {str(name): value for name, value in recording.attrs.items()}
    return new_recording(time, channels | measured, attributes)


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
    """The readings of `sense` of one sensor, while samples arrive one after another.

    Args:
        sensor: The sensor, unused.
        interval: Time between samples [s].
        first: Channels of one sample of the robot at rest, which is read at once.

    Attributes:
        next_row: Index of the next sample that the sensor reads.
    """

    def __init__(self, sensor: Sensor, interval: float, first: Mapping[str, np.ndarray]) -> None:
        self._sensor, self._interval = sensor, interval
        self._noise: Any = sensor.noise(1)
        self._pending: deque[dict[str, np.ndarray]] = deque()
        self._arrived = self._done = self.next_row = 0
        self._read(first)

    def take(self, true: Mapping[str, np.ndarray]) -> None:
        """Read the sample of index `next_row`, channels of one sample."""
        if self._done:
            self._noise = self._sensor.noise(1)
        else:
            self._pending.clear()
        self._read(true)
        self._done += 1
        self.next_row = self._sensor.sampling.row(self._done, self._interval)

    def measured(self, elapsed: float) -> dict[str, np.ndarray]:
        """Return the latest reading that has arrived, at a time [s] that never decreases."""
        latest = self._sensor.sampling.latest(elapsed)
        while self._arrived < latest and len(self._pending) > 1:
            self._pending.popleft()
            self._arrived += 1
        return self._pending[0]

    def _read(self, true: Mapping[str, np.ndarray]) -> None:
        read = self._sensor.read(true, self._noise)
        self._pending.append({name: values[0] for name, values in read.items()})
