"""Settings of the ground estimator."""

from __future__ import annotations

from dataclasses import dataclass, fields

from phasmid.errors import InvalidInput


@dataclass(frozen=True, slots=True)
class EstimatorSettings:
    """Settings of the ground estimator: levelling, and delays of sensors and servos.

    Attributes:
        level: 1: the body is level; 0: parallel to the ground; between: the share.
        joint_delay: Delay from a joint's motion to the arrival of its reading [s].
        imu_delay: Delay of the inertial readings, compensated by the gyro [s].
        motion_lag: Delay from a target to the body's motion [s].
        depth_delay: Delay from a reading of the depth sensor to its arrival [s].

    Raises:
        InvalidInput: A number is out of range.
    """

    level: float = 0.0
    joint_delay: float = 0.023
    imu_delay: float = 0.01
    motion_lag: float = 0.04
    depth_delay: float = 0.05

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not 0.0 <= value <= 1.0:
                raise InvalidInput(f"{field.name} is {value:g}; it must be from 0 to 1.")
