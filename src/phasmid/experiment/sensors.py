"""Sensors of a robot and their quality."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le

from phasmid.errors import InvalidInput
from phasmid.robot.similarity import Scale
from phasmid.tables import Angle, AngularVelocity, Count, Length, Number, Of, Table, Time
from phasmid.units import STANDARD_GRAVITY, rounded_down

SENSORS = ("joint", "imu", "foot")
"""Sensors, by the beginning of their options' names."""


FORCE_NOISE = 0.1
"""Noise of the normal force of a foot of ``phantomx-ax`` [N]."""

TOUCHING_FORCE = 0.5
"""Normal force from which a foot of ``phantomx-ax`` counts as touching [N]."""


class Sensors(Table):
    """``[sensors]``: rate, delay and noise of the robot's sensors.

    The defaults are those of an AX-12A on its bus and of a small inertial sensor such as the
    MPU-6050, with its ranges at power-on; noises are standard deviations of one sample.

    Attributes:
        measured: Whether a recording also contains sensor readings (``everything``), or only true
            values (``nothing``).
        body_state: Pose by which a driven robot follows waypoints: the true one, or the one
            estimated by legs and inertial sensor, which controllers observe too.
        sensor_seed: Seed of all noise and biases.
        joint_rate: Readings of each joint's angle and load a second [1/s]. At 1 Mbit/s and the
            default return delay of 0.5 ms, reading 18 servos in turn takes 13 ms.
        joint_delay: Time from a reading to its arrival [s].
        encoder_step: Angle from one tick of the joints' encoders to the next [rad]; 0: exact.
        load_step: Share of full output by which the load reading steps; an AX-12A has 1023 steps.
        imu_rate: Readings of gyro, accelerometer and orientation a second [1/s].
        imu_delay: Time from a reading to its arrival [s].
        gyro_noise: Standard deviation of each axis [rad/s].
        gyro_bias: Standard deviation of each axis' constant error [rad/s]; assumed: what is left
            of the chip's 20 deg/s after taking the mean at rest.
        gyro_range: Largest reading of the gyro [rad/s].
        accelerometer_noise: Standard deviation of each axis [m/s²]: 400 µg/√Hz at 100 Hz.
        accelerometer_bias: Standard deviation of each axis' constant error [m/s²]; assumed.
        accelerometer_range: Largest reading of the accelerometer [m/s²].
        orientation_noise: Standard deviation of the orientation's error about each axis [rad];
            assumed.
        foot_rate: Readings of each foot's force and contact a second [1/s].
        foot_delay: Time from a reading to its arrival [s].
        foot_force_noise: Standard deviation of the normal force [N]; absent: 0.1 N for
            ``phantomx-ax``, scaled with the weight per leg for other robots; assumed.
        contact_threshold: Normal force from which a foot counts as in contact [N]; absent: 0.5 N
            for ``phantomx-ax``, scaled with the weight per leg for other robots; assumed.
        depth: Depth sensor of a driven robot: ``none``; ``camera`` at the trunk's front, pitched
            down; ``lidar`` on a mast, with all directions; ``exact``: the true ground on a lattice
            of 20 mm within 0.5 m, at once. The sensor works with any value of `measured`.
        depth_rate: Readings of the depth sensor per second [1/s].
        depth_delay: Time from a reading to its arrival [s].
        depth_noise: Standard deviation of each range, relative to it: half of the 2 % by which a
            RealSense D405 may err at 0.5 m.
        depth_dropout: Fraction of the rays without a reading; assumed.
        depth_drift: Standard deviation of the mounting angles' random walk after a minute [rad];
            assumed.
        depth_range: Longest range of the depth sensor [m].
    """

    measured: Literal["nothing", "everything"] = "nothing"
    body_state: Literal["true", "estimated"] = "true"
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
    foot_force_noise: Annotated[Number, Ge(0)] | None = None
    contact_threshold: Annotated[Number, Gt(0)] | None = None
    depth: Literal["none", "camera", "lidar", "exact"] = "none"
    depth_rate: Annotated[Number, Gt(0), Le(1e3), Of("camera", "lidar", "exact")] = 20.0
    depth_delay: Annotated[Time, Ge(0), Le(10), Of("camera", "lidar")] = 0.05
    depth_noise: Annotated[Number, Ge(0), Le(0.2), Of("camera", "lidar")] = 0.01
    depth_dropout: Annotated[Number, Ge(0), Le(1), Of("camera", "lidar")] = 0.05
    depth_drift: Annotated[Angle, Ge(0), Le(0.2), Of("camera", "lidar")] = math.radians(0.2)
    depth_range: Annotated[Length, Gt(0), Le(1.5), Of("camera", "lidar")] = 1.5

    def force_noise(self, scale: Scale) -> float:
        """Return the noise of the normal force of a robot of a scale [N]."""
        given = self.foot_force_noise
        return FORCE_NOISE * scale.force if given is None else given

    def touching_force(self, scale: Scale) -> float:
        """Return the normal force from which a foot of a robot of a scale touches [N]."""
        given = self.contact_threshold
        return TOUCHING_FORCE * scale.force if given is None else given

    def check_interval(self, interval: float, sensors: Iterable[str] = SENSORS) -> None:
        """Refuse samples so rare that a reading would fall between two of them.

        Args:
            interval: From one recorded sample to the next [s].
            sensors: Those that are to read, each the beginning of its options' names.

        Raises:
            InvalidInput: A sensor reads more often; old values would pass for new ones.
        """
        names = [f"{sensor}_rate" for sensor in sensors]
        # A millionth: times of samples are sums of steps.
        quick = [name for name in names if interval * getattr(self, name) > 1 + 1e-6]
        if quick:
            raise InvalidInput(
                f"{quick[0]} is {getattr(self, quick[0]):g} readings a second and a sample is "
                f"recorded every {1000 * interval:g} ms; old values would pass for new readings.",
                hint=", ".join(f"{name} = {rounded_down(1 / interval)}" for name in quick),
            )
