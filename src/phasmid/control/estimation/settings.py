"""How a robot feels the ground: thresholds, time constants and limits."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from phasmid.arguments import check_number
from phasmid.errors import InvalidInput

MAY_BE_ZERO = (
    "touch_time",
    "release_time",
    "level",
    "shift",
    "hit_rise",
    "step_rise",
    "body_rise",
    "least_roughness",
    "landing_sink",
    "level_limit",
    "shift_limit",
    "height_limit",
    "admittance_limit",
    "imu_delay",
    "joint_delay",
    "motion_lag",
)
"""Settings that say 0 for none; all others must be greater."""


@dataclass(frozen=True, slots=True)
class EstimatorSettings:
    """Thresholds, time constants and limits of what is felt of the ground.

    Attributes:
        force_on: Normal force from which a foot is on the ground, as a share of the weight that
            each foot bears when all stand.
        force_off: The same of the force below which it has left.
        load_on: The same of forces that are computed from joint loads or position errors.
        load_off: The same for leaving.
        touch_time: For so long a foot must feel the ground to be on it [s].
        release_time: For so long it must feel none to be in the air [s].
        release_by: Share of a swing by which a foot's sensor must have left the ground to be heard
            again in this swing.
        hit_by: Share of a swing before which a touch is an obstacle and no ground.
        hit_rise: How much higher than the plane a foot looks for the ground for each obstacle, up
            to three, that it has met in its swing, over which it lifts anew [m].
        least_roughness: Difference in height of the stance feet, along the plane's normal, that is
            due to soft legs and not to the ground [m]: AX-12A servos and light legs give 1 to 2 mm.
        step_rise: Share of the difference beyond it by which steps are higher; they are twice as
            high at most.
        body_rise: Share of that difference, of 50 mm at most, by which the body is higher.
        landing_sink: How much lower than the plane a foot that feels aims, so that it meets level
            ground in its swing [m].
        implausible_steps: Steps in which a sensor contradicts the leg's motion until it is no
            longer believed.
        dead_time: For so long a sensor may tell no number until it counts as dead [s].
        joint_delay: From a joint's motion to its reading's arrival; position errors are taken
            against the targets of that time [s].
        orientation_time: Within it the attitude follows the orientation that is told [s].
        accelerometer_time: Within it the attitude follows the accelerometer; between, the gyro [s].
        bias_time: Within it the gyro's bias is learnt while the robot stands [s].
        imu_delay: Age of the inertial sensor's readings, made up for by the gyro [s].
        gate: Angle by which the told orientation may be off the attitude and still be heard [rad].
        quarrel_time: For so long inertial sensors may contradict each other, or one stand still
            while the robot walks, until they are no longer believed [s].
        forgetting_time: Within it the place of a lifted foot is forgotten by the plane [s].
        plane_spread: Feet that spread less than this across a line tell nothing of the slope
            across it [m].
        plane_rate: Largest change of the plane's slope [1/s].
        plane_time: Of each of the two lags that smooth the plane's motion [s].
        motion_lag: From a target to the body's motion [s].
        level: 1: the body is kept level; 0: parallel to the ground; between: the share.
        level_time: Within it the body follows what it shall do [s].
        level_rate: Largest speed of its turn for that [rad/s].
        level_limit: Largest turn for that [rad].
        shift: Share of the shift that keeps the centre of mass over the middle of the feet.
        shift_rate: Its largest speed [m/s].
        shift_limit: Its largest length [m].
        height_time: Within it the body is raised by what the legs give way [s].
        height_limit: At most by this [m].
        ease_time: Within it the corrections leave once the inertial sensor is dead [s].
        admittance: Whether standing feet give way to forces that are larger than their share.
        admittance_mass: Virtual mass of a foot [kg].
        swing_stiffness: Virtual spring of a swinging foot [N/m].
        stance_stiffness: Of a standing one [N/m].
        damping_ratio: Of spring and mass.
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
    quarrel_time: float = 0.5
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
