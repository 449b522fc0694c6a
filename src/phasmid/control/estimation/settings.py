"""Settings of the ground estimator: thresholds, time constants and limits."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from phasmid.arguments import check_number
from phasmid.errors import InvalidInput

MAY_BE_ZERO = (
    *("touch_time", "release_time", "level", "shift", "hit_rise", "step_rise", "body_rise"),
    *("least_roughness", "landing_sink", "level_limit", "shift_limit", "height_limit"),
    *("admittance_limit", "imu_delay", "joint_delay", "motion_lag"),
)
"""Settings that switch something off by 0; all others must be greater."""


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
        release_by: Share of a swing by which a sensor must have lost contact, or it is ignored for
            the rest of the swing.
        hit_by: Share of a swing before which a contact is an obstacle.
        hit_rise: Height that the expected landing gains for each obstacle hit, up to three [m].
        least_roughness: Height difference of the stance feet along the plane's normal that is due
            to compliant legs [m]: AX-12A servos and light legs deflect by 1 to 2 mm.
        step_rise: Share of the difference beyond it that is added to the step height; steps are at
            most twice as high.
        body_rise: Share of that difference, of 50 mm at most, that is added to the body's height.
        landing_sink: Depth below the plane at which a foot with contact sensing aims [m].
        implausible_steps: Steps in which a sensor contradicts the leg's motion before it is
            distrusted.
        dead_time: Duration without a reading after which a sensor is dead [s].
        joint_delay: Delay from a joint's motion to the arrival of its reading [s].
        orientation_time: Time constant of the correction by the orientation sensor [s].
        accelerometer_time: Time constant of the correction by the accelerometer [s].
        bias_time: Time constant of the gyro's bias while the robot stands [s].
        imu_delay: Delay of the inertial readings, compensated by the gyro [s].
        gate: Largest angle between an orientation reading that is used and the estimate [rad].
        disagreement_time: Duration for which inertial sensors may contradict each other, or one may
            be frozen while the robot walks, before they are distrusted [s].
        forgetting_time: Time constant with which the plane forgets a lifted foot [s].
        plane_spread: Spread of the feet across a line below which they do not determine the slope
            across it [m].
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
        height_time: Time constant with which the body is raised by the legs' deflection [s].
        height_limit: Largest height by which it is raised [m].
        ease_time: Time constant with which corrections decay without inertial sensors [s].
        admittance: Whether stance feet yield to forces that exceed their share.
        admittance_mass: Virtual mass of a foot [kg].
        swing_stiffness: Virtual stiffness of a swinging foot [N/m].
        stance_stiffness: Virtual stiffness of a standing foot [N/m].
        damping_ratio: Of the virtual spring and mass.
        admittance_limit: Largest offset of a foot [m].

    Raises:
        InvalidInput: A number is out of range.
    """

    force_on: float = 0.35
    force_off: float = 0.16
    load_on: float = 0.4
    load_off: float = 0.2
    touch_time: float = 0.0
    release_time: float = 0.015
    release_by: float = 0.35
    hit_by: float = 0.65
    hit_rise: float = 0.02
    least_roughness: float = 0.003
    step_rise: float = 0.5
    body_rise: float = 0.5
    landing_sink: float = 0.0
    implausible_steps: float = 2.0
    dead_time: float = 0.1
    joint_delay: float = 0.023
    orientation_time: float = 0.02
    accelerometer_time: float = 1.0
    bias_time: float = 3.0
    imu_delay: float = 0.01
    gate: float = math.radians(20)
    disagreement_time: float = 0.5
    forgetting_time: float = 1.0
    plane_spread: float = 0.03
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
    height_time: float = 1.0
    height_limit: float = 0.02
    ease_time: float = 2.0
    admittance: bool = False
    admittance_mass: float = 1.0
    swing_stiffness: float = 500.0
    stance_stiffness: float = 2000.0
    damping_ratio: float = 1.0
    admittance_limit: float = 0.01

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name == "admittance":
                continue
            check_number(field.name, value)
            least = 0.0 if field.name in MAY_BE_ZERO else math.ulp(0.0)
            if not (math.isfinite(value) and value >= least):
                must = "0 or more" if least == 0.0 else "greater than 0"
                raise InvalidInput(
                    f"{field.name} is {value:g}; it must be a finite number, {must}."
                )
        for name in ("level", "shift", "release_by", "hit_by", "force_on", "load_on"):
            if getattr(self, name) > 1:
                raise InvalidInput(f"{name} is {getattr(self, name):g}; it must be 1 or less.")
        for low, high in (("force_off", "force_on"), ("load_off", "load_on")):
            if getattr(self, low) > getattr(self, high):
                raise InvalidInput(
                    f"{low} is {getattr(self, low):g}; it must be at most {high}, "
                    f"{getattr(self, high):g}."
                )
