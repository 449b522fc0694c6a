"""The robot's sensors while a run goes on: the numbers of `phasmid.sense`, as they arrive."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.robot import Robot
from phasmid.scenario import Scenario
from phasmid.sensors.feet import FootSensor
from phasmid.sensors.imu import InertialSensor
from phasmid.sensors.joints import joint_readings
from phasmid.sensors.measurement import servo_load
from phasmid.sensors.sampling import Sampling

Reader = Callable[[Mapping[str, np.ndarray], Any], dict[str, np.ndarray]]


class SensorStream:
    """What sensors have told by now, of samples that come one after another.

    Args:
        scenario: Its sensors and its gravity are used.
        robot: The robot, L legs.
        time: Of all samples that may come [s], shape (N,).

    Raises:
        InvalidInput: A sensor reads more often than there are samples.
    """

    def __init__(self, scenario: Scenario, robot: Robot, time: Float[np.ndarray, " time"]) -> None:
        table = scenario.sensors
        table.check_interval(float(np.diff(time).max(initial=0.0)))
        imu = InertialSensor(table, scenario.model.gravity)
        foot = FootSensor(table, len(robot.legs))
        self._time, self._velocity = time, np.zeros(3)
        self._sensors = (
            _Sensor(
                Sampling(table.joint_rate, table.joint_delay),
                time,
                lambda seen, _: joint_readings(
                    table, seen["joint_position"], servo_load(robot, seen)
                ),
                lambda: None,
            ),
            _Sensor(
                Sampling(table.imu_rate, table.imu_delay),
                time,
                lambda seen, noise: imu.read(
                    seen["body_orientation"],
                    seen["body_acceleration"],
                    seen["body_angular_velocity"],
                    noise,
                ),
                lambda: imu.noise(1),
            ),
            _Sensor(
                Sampling(table.foot_rate, table.foot_delay),
                time,
                lambda seen, noise: foot.read(seen["foot_normal_force"], noise),
                lambda: foot.noise(1),
            ),
        )

    def begin(self, seen: Mapping[str, np.ndarray]) -> None:
        """What is known before the first sample, at rest, which the first readings tell until then.

        Args:
            seen: Channels by name, one sample each.
        """
        still = {**seen, "body_acceleration": np.zeros((1, 3))}
        for sensor in self._sensors:
            sensor.begin(still)

    def needs(self, row: int) -> bool:
        """Whether any sensor reads at a sample."""
        return any(sensor.next_row == row for sensor in self._sensors)

    def skip(self, velocity: Float[np.ndarray, "3"]) -> None:
        """Go on past a sample at which nothing is read.

        Args:
            velocity: Of the body then, world axes [m/s], shape (3,).
        """
        self._velocity = velocity

    def take(self, row: int, seen: Mapping[str, np.ndarray]) -> None:
        """Let the sensors read a sample; each sample is taken or skipped, in their order.

        Args:
            row: Its index.
            seen: Its channels by name, one sample each.
        """
        velocity = seen["body_velocity"]
        acceleration = np.zeros_like(velocity)
        if row:
            passed = self._time[row] - self._time[row - 1]
            acceleration = (velocity - self._velocity) / passed
        self._velocity = velocity[0].copy()
        whole = {**seen, "body_acceleration": acceleration}
        for sensor in self._sensors:
            while sensor.next_row == row:
                sensor.take(whole)

    def told(self, time: float) -> dict[str, np.ndarray]:
        """The latest readings that have arrived, by channel name.

        Args:
            time: [s]; not before that of an earlier call.
        """
        passed = time - float(self._time[0])
        return {
            name: value for sensor in self._sensors for name, value in sensor.told(passed).items()
        }


class _Sensor:
    """One sensor's readings: when they are made, and those that may still be told."""

    def __init__(
        self,
        sampling: Sampling,
        time: Float[np.ndarray, " time"],
        read: Reader,
        noise: Callable[[], Any],
    ) -> None:
        self._sampling, self._read, self._noise = sampling, read, noise
        last = sampling.latest(float(time[-1] - time[0]))
        self._rows = sampling.row_of(time, np.arange(last + 2)).tolist()
        self._readings: deque[dict[str, np.ndarray]] = deque()
        self._first = self._done = 0
        self._noise_of_first: Any = None

    @property
    def next_row(self) -> int:
        """Index of the sample of its next reading; -1 where there is none."""
        return self._rows[self._done] if self._done < len(self._rows) else -1

    def begin(self, seen: Mapping[str, np.ndarray]) -> None:
        self._noise_of_first = self._noise()
        self._readings.append(_single(self._read(seen, self._noise_of_first)))

    def take(self, seen: Mapping[str, np.ndarray]) -> None:
        if self._done == 0:
            self._readings.clear()
        noise = self._noise() if self._done else self._noise_of_first
        self._readings.append(_single(self._read(seen, noise)))
        self._done += 1

    def told(self, passed: float) -> dict[str, np.ndarray]:
        latest = self._sampling.latest(passed)
        while self._first < latest and len(self._readings) > 1:
            self._readings.popleft()
            self._first += 1
        return self._readings[0]


def _single(rows: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {name: values[0] for name, values in rows.items()}
