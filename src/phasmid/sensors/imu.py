"""The inertial sensor at the origin of the body frame: gyro, accelerometer and orientation."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.kinematics import quaternion_rotation
from phasmid.scenario.sensors import SensorsTable
from phasmid.sensors.sampling import Sampling, quantised, random_stream

GYRO, ACCELEROMETER, ORIENTATION = 1, 2, 3
"""Numbers of the sensors' random streams."""

STEPS = 2**15
"""Steps from nothing to the largest reading of a sensor of 16 bits."""


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
    R_world_body = quaternion_rotation(orientation)
    # The mean over the last interval, as a sensor with a low-pass filter of its own gives it; at
    # the first sample the robot has stood still.
    acceleration = np.zeros_like(velocity)
    acceleration[1:] = np.diff(velocity, axis=0) / np.diff(time)[:, None]
    specific_force = acceleration + np.array([0.0, 0.0, gravity])
    gyro, accelerometer = (
        np.einsum("tji,tj->ti", R_world_body[row], vector[row])
        for vector in (angular_velocity, specific_force)
    )
    told = {
        "imu_angular_velocity": _read(
            gyro, table.gyro_noise, table.gyro_bias, table.gyro_range, table.sensor_seed, GYRO
        ),
        "imu_acceleration": _read(
            accelerometer,
            table.accelerometer_noise,
            table.accelerometer_bias,
            table.accelerometer_range,
            table.sensor_seed,
            ACCELEROMETER,
        ),
        "imu_orientation": _turned(
            orientation[row], table.orientation_noise, random_stream(table.sensor_seed, ORIENTATION)
        ),
    }
    return {name: values[reading] for name, values in told.items()}


def _read(
    true: Float[np.ndarray, "readings 3"],
    noise: float,
    bias: float,
    largest: float,
    seed: int,
    sensor: int,
) -> Float[np.ndarray, "readings 3"]:
    """Readings with a constant error and noise, in steps, within the range."""
    rng = random_stream(seed, sensor)
    wrong = true + bias * rng.standard_normal(3) + noise * rng.standard_normal(true.shape)
    return np.clip(quantised(wrong, largest / STEPS), -largest, largest)


def _turned(
    orientation: Float[np.ndarray, "readings 4"], noise: float, rng: np.random.Generator
) -> Float[np.ndarray, "readings 4"]:
    """Orientations, each turned about a random vector in body axes."""
    turn = noise * rng.standard_normal((len(orientation), 3))
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
