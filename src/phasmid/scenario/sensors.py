"""Sensors of a scenario."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le

from phasmid.errors import InvalidInput
from phasmid.tables import Angle, AngularVelocity, Count, Number, Table, Time
from phasmid.units import STANDARD_GRAVITY

SENSORS = ("joint", "imu", "foot")
"""Sensors, by the beginning of their options' names."""


class SensorsTable(Table):
    """``[sensors]``: rate, delay and noise of the robot's sensors.

    The defaults are those of an AX-12A on its bus and of a small inertial sensor such as the
    MPU-6050, with its ranges at power-on; noises are standard deviations of one sample.

    Attributes:
        measured: Whether a recording also holds sensor readings (``everything``) or only the
            true (``nothing``).
        sensor_seed: Of all noise and biases.
        joint_rate: Readings of each joint's angle and load a second [1/s]. 50: one after another,
            18 servos need 13 ms at 1 Mbit/s with the return delay of 0.5 ms that they come with.
        joint_delay: Time from a reading to its arrival [s].
        encoder_step: Angle from one tick of the joints' encoders to the next [rad]; 0: exact.
        load_step: Share of full output by which the load reading steps; an AX-12A has 1023 steps.
        imu_rate: Readings of gyro, accelerometer and orientation a second [1/s].
        imu_delay: Time from a reading to its arrival [s].
        gyro_noise: Of each axis [rad/s].
        gyro_bias: Standard deviation of each axis' constant error [rad/s]; assumed: what is left
            of the chip's 20 deg/s after taking the mean at rest.
        gyro_range: Largest reading [rad/s].
        accelerometer_noise: Of each axis [m/s²]: 400 µg/√Hz at 100 Hz.
        accelerometer_bias: Standard deviation of each axis' constant error [m/s²]; assumed.
        accelerometer_range: Largest reading [m/s²].
        orientation_noise: Of the turn about each axis by which the orientation is wrong [rad];
            assumed.
        foot_rate: Readings of each foot's force and contact a second [1/s].
        foot_delay: Time from a reading to its arrival [s].
        foot_force_noise: Of the normal force [N]; assumed.
        contact_threshold: Normal force from which a foot counts as touching [N]; assumed.
    """

    measured: Literal["nothing", "everything"] = "nothing"
    sensor_seed: Annotated[Count, Ge(0), Le(2**63 - 1)] = 0
    joint_rate: Annotated[Number, Gt(0), Le(1e6)] = 50.0
    joint_delay: Annotated[Time, Ge(0), Le(10)] = 0.013
    encoder_step: Annotated[Angle, Ge(0), Le(math.pi)] = math.radians(300 / 1024)
    load_step: Annotated[Number, Ge(0), Le(1)] = 1 / 1023
    imu_rate: Annotated[Number, Gt(0), Le(1e6)] = 100.0
    imu_delay: Annotated[Time, Ge(0), Le(10)] = 0.005
    gyro_noise: Annotated[AngularVelocity, Ge(0)] = math.radians(0.05)
    gyro_bias: Annotated[AngularVelocity, Ge(0)] = math.radians(0.1)
    gyro_range: Annotated[AngularVelocity, Gt(0)] = math.radians(250)
    accelerometer_noise: Annotated[Number, Ge(0)] = 0.004 * STANDARD_GRAVITY
    accelerometer_bias: Annotated[Number, Ge(0)] = 0.05
    accelerometer_range: Annotated[Number, Gt(0)] = 2 * STANDARD_GRAVITY
    orientation_noise: Annotated[Angle, Ge(0), Le(1)] = math.radians(0.5)
    foot_rate: Annotated[Number, Gt(0), Le(1e6)] = 100.0
    foot_delay: Annotated[Time, Ge(0), Le(10)] = 0.005
    foot_force_noise: Annotated[Number, Ge(0)] = 0.1
    contact_threshold: Annotated[Number, Gt(0)] = 0.5

    def check_interval(self, interval: float, sensors: Iterable[str] = SENSORS) -> None:
        """Refuse samples so rare that a reading would fall between two of them.

        Args:
            interval: From one recorded sample to the next [s].
            sensors: Those that are to read, each the beginning of its options' names.

        Raises:
            InvalidInput: A sensor reads more often; old values would pass for new ones.
        """
        for sensor in sensors:
            rate = getattr(self, f"{sensor}_rate")
            # A millionth: times of samples are sums of steps.
            if interval * rate > 1 + 1e-6:
                raise InvalidInput(
                    f"{sensor}_rate is {rate:g} readings a second and a sample is recorded every "
                    f"{1000 * interval:g} ms; old values would pass for new readings.",
                    hint=f"record_interval_ms = {1000 / rate:g} or less, or {sensor}_rate = "
                    f"{1 / interval:g} or less",
                )
