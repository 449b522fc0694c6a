"""The inertial sensor at the origin of the body frame: gyro, accelerometer and orientation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.kinematics import quaternion_rotation
from phasmid.scenario.sensors import SensorsTable
from phasmid.sensors.sampling import Sampling, quantised, random_stream

GYRO, ACCELEROMETER, ORIENTATION = 1, 2, 3
"""Numbers of the sensors' random streams."""

STEPS = 2**15
"""Steps from nothing to the largest reading of a sensor of 16 bits."""


class InertialNoise(NamedTuple):
    """What is wrong with some readings, one row for each."""

    gyro: Float[np.ndarray, "readings 3"]
    accelerometer: Float[np.ndarray, "readings 3"]
    turn: Float[np.ndarray, "readings 3"]


class InertialSensor:
    """The inertial sensor, reading by reading.

    Args:
        table: Ranges, noise and seed.
        gravity: Acceleration of free fall [m/s²].
    """

    def __init__(self, table: SensorsTable, gravity: float) -> None:
        seed = table.sensor_seed
        self._upwards = np.array([0.0, 0.0, gravity])
        self._gyro = _Axes(table.gyro_noise, table.gyro_bias, table.gyro_range, seed, GYRO)
        self._accelerometer = _Axes(
            table.accelerometer_noise,
            table.accelerometer_bias,
            table.accelerometer_range,
            seed,
            ACCELEROMETER,
        )
        self._turn = table.orientation_noise
        self._turns = random_stream(seed, ORIENTATION)

    def noise(self, count: int) -> InertialNoise:
        """That of the next readings."""
        return InertialNoise(
            self._gyro.noise(count),
            self._accelerometer.noise(count),
            self._turn * self._turns.standard_normal((count, 3)),
        )

    def read(
        self,
        orientation: Float[np.ndarray, "readings 4"],
        acceleration: Float[np.ndarray, "readings 3"],
        angular_velocity: Float[np.ndarray, "readings 3"],
        noise: InertialNoise,
    ) -> dict[str, np.ndarray]:
        """Readings by channel name.

        Args:
            orientation: Of the body, w x y z, shape (M, 4).
            acceleration: Of the body frame's origin, world axes [m/s²], shape (M, 3).
            angular_velocity: World axes [rad/s], shape (M, 3).
            noise: Of these readings.
        """
        R = quaternion_rotation(orientation)
        gyro, accelerometer = (
            np.einsum("tji,tj->ti", R, vector)
            for vector in (angular_velocity, acceleration + self._upwards)
        )
        return {
            "imu_angular_velocity": self._gyro.read(gyro, noise.gyro),
            "imu_acceleration": self._accelerometer.read(accelerometer, noise.accelerometer),
            "imu_orientation": turned(orientation, noise.turn),
        }


class _Axes:
    """Three axes with a constant error and noise, in steps, within the range."""

    def __init__(self, noise: float, bias: float, largest: float, seed: int, sensor: int) -> None:
        self._rng, self._noise, self._largest = random_stream(seed, sensor), noise, largest
        self._bias = bias * self._rng.standard_normal(3)

    def noise(self, count: int) -> Float[np.ndarray, "readings 3"]:
        return self._noise * self._rng.standard_normal((count, 3))

    def read(
        self, true: Float[np.ndarray, "readings 3"], noise: Float[np.ndarray, "readings 3"]
    ) -> Float[np.ndarray, "readings 3"]:
        wrong = quantised(true + self._bias + noise, self._largest / STEPS)
        return np.clip(wrong, -self._largest, self._largest)


def turned(
    orientation: Float[np.ndarray, "readings 4"], turn: Float[np.ndarray, "readings 3"]
) -> Float[np.ndarray, "readings 4"]:
    """Orientations, each turned about a vector in body axes.

    Args:
        orientation: w x y z, shape (M, 4).
        turn: Axis times angle [rad], shape (M, 3).
    """
    angle = np.linalg.norm(turn, axis=-1)
    w, v = np.cos(angle / 2), 0.5 * np.sinc(angle / (2 * np.pi))[:, None] * turn
    q0, q = orientation[:, 0], orientation[:, 1:]
    return np.concatenate(
        [
            (q0 * w - np.sum(q * v, axis=-1))[:, None],
            q0[:, None] * v + w[:, None] * q + np.cross(q, v),
        ],
        axis=-1,
    )


def imu_channels(
    table: SensorsTable,
    gravity: float,
    time: Float[np.ndarray, " time"],
    orientation: Float[np.ndarray, "time 4"],
    velocity: Float[np.ndarray, "time 3"],
    angular_velocity: Float[np.ndarray, "time 3"],
) -> dict[str, np.ndarray]:
    """What the inertial sensor tells, body axes.

    Args:
        table: Rate, delay, ranges, noise.
        gravity: Acceleration of free fall [m/s²].
        time: [s], shape (N,).
        orientation: Of the body, w x y z, shape (N, 4).
        velocity: Of the body frame's origin, world axes [m/s], shape (N, 3).
        angular_velocity: World axes [rad/s], shape (N, 3).

    Returns:
        ``imu_angular_velocity``, ``imu_acceleration`` (specific force: at rest one g upwards) and
        ``imu_orientation``, each with N rows.
    """
    sampling = Sampling(table.imu_rate, table.imu_delay)
    reading = sampling.reading_at(time)
    row = sampling.row_of(time, np.arange(reading[-1] + 1))
    # The mean over the last interval, as a sensor with a low-pass filter of its own gives it; at
    # the first sample the robot has stood still.
    acceleration = np.zeros_like(velocity)
    acceleration[1:] = np.diff(velocity, axis=0) / np.diff(time)[:, None]
    sensor = InertialSensor(table, gravity)
    told = sensor.read(
        orientation[row], acceleration[row], angular_velocity[row], sensor.noise(len(row))
    )
    return {name: values[reading] for name, values in told.items()}
