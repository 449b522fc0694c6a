"""Settings of the ground estimator: thresholds, time constants and limits."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from phasmid.errors import InvalidInput

POSITIVE = (
    *("force_on", "force_off", "load_on", "load_off", "plane_rate", "plane_time"),
    *("level_time", "level_rate", "shift_rate", "ease_time"),
)
"""Settings that must be greater than 0; the others may be 0."""


@dataclass(frozen=True, slots=True)
class EstimatorSettings:
    """Settings of contact detection, ground plane, attitude, levelling and admittance.

    Attributes:
        force_on: Measured normal force from which a foot is in contact, divided by the weight that
            each foot bears when all stand.
        force_off: The same for the force below which it loses contact.
        load_on: As `force_on`, for forces computed from joint loads or position errors.
        load_off: As `force_off`, for these.
        touch_time: Duration of contact readings before contact is detected [s].
        release_time: Duration of readings without contact before its loss is detected [s].
        least_roughness: Height difference of the stance feet along the plane's normal that is due
            to compliant legs [m]: AX-12A servos and light legs deflect by 1 to 2 mm.
        joint_delay: Delay from a joint's motion to the arrival of its reading [s].
        imu_delay: Delay of the inertial readings, compensated by the gyro [s].
        plane_rate: Largest rate of the plane's slope [1/s].
        plane_time: Time constant of each of the plane's two lags [s].
        motion_lag: Delay from a target to the body's motion [s].
        level: 1: the body is level; 0: parallel to the ground; between: the share.
        level_time: Time constant of levelling [s].
        level_rate: Largest angular velocity of levelling [rad/s].
        level_limit: Largest angle of levelling [rad].
        shift: Share of the shift that puts the centre of mass over the centre of the feet.
        shift_rate: Its largest velocity [m/s].
        shift_limit: Its largest length [m].
        height_limit: Largest height by which the body is raised over compliant legs [m].
        ease_time: Time constant with which corrections decay without inertial sensors [s].
        admittance: Whether stance feet yield to forces that exceed their share.

    Raises:
        InvalidInput: A number is out of range.
    """

    force_on: float = 0.35
    force_off: float = 0.16
    load_on: float = 0.4
    load_off: float = 0.2
    touch_time: float = 0.0
    release_time: float = 0.015
    least_roughness: float = 0.003
    joint_delay: float = 0.023
    imu_delay: float = 0.01
    plane_rate: float = 1.0
    plane_time: float = 0.05
    motion_lag: float = 0.04
    level: float = 0.0
    level_time: float = 0.4
    level_rate: float = math.radians(20)
    level_limit: float = math.radians(20)
    shift: float = 1.0
    shift_rate: float = 0.05
    shift_limit: float = 0.02
    height_limit: float = 0.02
    ease_time: float = 2.0
    admittance: bool = False

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name == "admittance":
                continue
            positive = field.name in POSITIVE
            if not (0 <= value < math.inf) or (positive and value == 0):
                must = "greater than 0" if positive else "0 or more"
                raise InvalidInput(
                    f"{field.name} is {value:g}; it must be a finite number, {must}."
                )
        for name in ("level", "shift", "force_on", "load_on"):
            if getattr(self, name) > 1:
                raise InvalidInput(f"{name} is {getattr(self, name):g}; it must be 1 or less.")
        for low, high in (("force_off", "force_on"), ("load_off", "load_on")):
            if getattr(self, low) > getattr(self, high):
                raise InvalidInput(
                    f"{low} is {getattr(self, low):g}; it must be at most {high}, "
                    f"{getattr(self, high):g}."
                )
