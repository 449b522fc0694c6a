"""Models of the robot's sensors: sampling, delay, resolution and noise of joints, IMU and feet."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from jaxtyping import Float, Int

from phasmid.compiled import gufunc
from phasmid.experiment import Experiment, Sensors
from phasmid.kinematics.vector_kernels import rotate_by
from phasmid.robot.similarity import Scale

GYRO, ACCELEROMETER, ORIENTATION, FOOT = 1, 2, 3, 4
"""Numbers of the sensors' random streams."""

ROUND_OFF = 1e-12
"""Steps of readings below this are those of the numbers themselves."""

RESOLUTION = 2**15
"""Steps from zero to the end of the range of a 16-bit sensor."""

ROUNDING = 5e-10
"""Readings due at a sample count as made there, whatever the last digit of the times [s]."""

INVERSE = np.array([1.0, -1.0, -1.0, -1.0])
"""Factors that make a unit quaternion that of the inverse rotation."""


@dataclass(frozen=True)
class Sampling:
    """Sampling at a fixed rate, with readings that arrive late.

    The last reading that has arrived holds until the next one. The first reading is available from
    the beginning, because the robot has stood still until then.

    Attributes:
        rate: Readings per second [1/s]; the first is made at the start of the recording.
        delay: Time from a reading to its arrival [s].
    """

    rate: float
    delay: float

    def latest(self, elapsed: float | Float[np.ndarray, " time"]) -> Int[np.ndarray, "..."]:
        """Return the number, from 0, of the latest reading that has arrived after each time [s]."""
        number = np.floor((elapsed - self.delay + ROUNDING) * self.rate)
        return np.asarray(np.maximum(number, 0.0), dtype=np.int64)

    def row(self, reading: int, interval: float) -> int:
        """Return the index of the last sample that is not later than a reading.

        Args:
            reading: Number of the reading.
            interval: Time between samples, of which the first is at zero [s].
        """
        return math.floor((reading / self.rate + ROUNDING) / interval)

    def row_of(
        self, time: Float[np.ndarray, " time"], reading: Int[np.ndarray, " readings"]
    ) -> Int[np.ndarray, " readings"]:
        """Return the index of the last sample that is not later than each reading, shape (M,)."""
        when = time[0] + reading / self.rate + ROUNDING
        row: np.ndarray = np.searchsorted(time, when, side="right") - 1
        return row


class JointSensor:
    """Encoder and load reading of every servo.

    The load is the servo's output as a share of the largest one: an AX-12 measures no torque.
    """

    name, needs = "joint", ("joint_position",)

    def __init__(self, table: Sensors, stall_torque: Float[np.ndarray, "legs 3"]) -> None:
        self.sampling = Sampling(table.joint_rate, table.joint_delay)
        self._table, self._stall = table, stall_torque

    def noise(self, count: int) -> None:
        """Return nothing: these readings have a resolution and no noise."""

    def read(self, true: Mapping[str, np.ndarray], noise: None) -> dict[str, np.ndarray]:
        """Return joint angles [rad] and loads, shapes (M, L, 3)."""
        del noise
        table, load = self._table, true.get("servo_duty")
        torque = true.get("servo_motor_torque", true.get("joint_torque"))
        measured = {
            "joint_position_measured": quantised(true["joint_position"], table.encoder_step)
        }
        if load is None and torque is not None:
            load = torque / self._stall
        if load is not None:
            load = np.minimum(np.maximum(load, -1.0), 1.0)
            measured["joint_load_measured"] = quantised(load, table.load_step)
        return measured


class InertialSensor:
    """Gyro, accelerometer and orientation at the origin of the body frame, in body axes."""

    name, needs = "imu", ("body_orientation", "body_acceleration", "body_angular_velocity")

    def __init__(self, table: Sensors, gravity: float) -> None:
        self.sampling = Sampling(table.imu_rate, table.imu_delay)
        self._up = np.array([0.0, 0.0, gravity])
        self._sizes = table.gyro_noise, table.accelerometer_noise, table.orientation_noise
        self._ranges = table.gyro_range, table.accelerometer_range
        self._rng = [
            random_stream(table.sensor_seed, n) for n in (GYRO, ACCELEROMETER, ORIENTATION)
        ]
        self._gyro_bias = table.gyro_bias * self._rng[0].standard_normal(3)
        self._accelerometer_bias = table.accelerometer_bias * self._rng[1].standard_normal(3)

    def noise(self, count: int) -> list[Float[np.ndarray, "readings 3"]]:
        """Draw noise of gyro [rad/s] and accelerometer [m/s²], and rotation errors [rad]."""
        return [
            size * rng.standard_normal((count, 3))
            for size, rng in zip(self._sizes, self._rng, strict=True)
        ]

    def read(
        self, true: Mapping[str, np.ndarray], noise: list[Float[np.ndarray, "readings 3"]]
    ) -> dict[str, np.ndarray]:
        """Return angular velocity, specific force (at rest one g upwards) and orientation."""
        orientation = true["body_orientation"]
        into_body = orientation * INVERSE
        gyro = rotated_vector(into_body, true["body_angular_velocity"]) + self._gyro_bias
        force = rotated_vector(into_body, true["body_acceleration"] + self._up)
        force += self._accelerometer_bias
        return {
            "imu_angular_velocity": _in_range(gyro + noise[0], self._ranges[0]),
            "imu_acceleration": _in_range(force + noise[1], self._ranges[1]),
            "imu_orientation": rotated(orientation, noise[2]),
        }


class FootSensor:
    """Normal force and contact switch of every foot."""

    name, needs = "foot", ("foot_normal_force",)

    def __init__(self, table: Sensors, legs: int, scale: Scale) -> None:
        self.sampling = Sampling(table.foot_rate, table.foot_delay)
        self._legs = legs
        self._noise, self._threshold = table.force_noise(scale), table.touching_force(scale)
        self._rng = random_stream(table.sensor_seed, FOOT)

    def noise(self, count: int) -> Float[np.ndarray, "readings legs"]:
        """Draw the noise of the next readings [N]."""
        return self._noise * self._rng.standard_normal((count, self._legs))

    def read(
        self, true: Mapping[str, np.ndarray], noise: Float[np.ndarray, "readings legs"]
    ) -> dict[str, np.ndarray]:
        """Return normal forces [N] and contacts, shapes (M, L)."""
        force = true["foot_normal_force"] + noise
        return {
            "foot_normal_force_measured": force,
            "contact_measured": force >= self._threshold,
        }


Sensor: TypeAlias = JointSensor | InertialSensor | FootSensor
"""A sensor model: `noise` draws the errors of M readings, `read` applies them to true channels."""


def robot_sensors(experiment: Experiment) -> tuple[Sensor, ...]:
    """Return the sensors of a robot with the settings of a scenario."""
    table, robot = experiment.sensors, experiment.robot
    return (
        JointSensor(table, robot.arrays.strength * robot.servo.full_output_torque),
        InertialSensor(table, experiment.world.gravity),
        FootSensor(table, len(robot.legs), experiment.scale),
    )


def quantised(values: Float[np.ndarray, "*shape"], step: float) -> Float[np.ndarray, "*shape"]:
    """Return values rounded to whole steps, or unchanged where the step is 0 or round-off."""
    return np.rint(values / step) * step if step > ROUND_OFF else values


def _in_range(values: np.ndarray, largest: float) -> np.ndarray:
    """Return the readings of a 16-bit sensor with a range to both sides of zero."""
    return np.minimum(np.maximum(quantised(values, largest / RESOLUTION), -largest), largest)


def random_stream(seed: int, sensor: int) -> np.random.Generator:
    """Return the random numbers of one sensor, independent of those of the others."""
    return np.random.default_rng([seed, sensor])


@gufunc("(q),(v)->(v)")
def rotated_vector(quaternion: np.ndarray, vector: np.ndarray, out: np.ndarray) -> None:
    """Rotate vectors by unit quaternions (w x y z)."""
    w, x, y, z = quaternion
    out[0], out[1], out[2] = rotate_by(w, x, y, z, (vector[0], vector[1], vector[2]))


@gufunc("(q),(v)->(q)")
def rotated(orientation: np.ndarray, rotation: np.ndarray, out: np.ndarray) -> None:
    """Rotate orientations (w x y z) about vectors in body axes, axis times angle [rad]."""
    a, b, c = rotation
    half = 0.5 * math.sqrt(a * a + b * b + c * c)
    w, scale = math.cos(half), 0.5 * math.sin(half) / half if half > 0.0 else 0.5
    a, b, c = scale * a, scale * b, scale * c
    q, x, y, z = orientation
    out[0] = q * w - (x * a + y * b + z * c)
    out[1] = q * a + w * x + (y * c - z * b)
    out[2] = q * b + w * y + (z * a - x * c)
    out[3] = q * c + w * z + (x * b - y * a)
