"""State, parameters and measurements of the ground estimator.

Each class names the fields of a NumPy record (`records.record_of`); compiled functions take arrays
of records.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from enum import IntEnum, IntFlag
from typing import Annotated

import numpy as np
from jaxtyping import Float, Int

from phasmid.control.estimation.settings import EstimatorSettings
from phasmid.control.records import record_of
from phasmid.control.types import Contact
from phasmid.dynamics.matrices import link_moments
from phasmid.errors import InvalidInput
from phasmid.kinematics.leg import geometry
from phasmid.robot import Robot

DELAY_UPDATES = 128
"""Length of the delay lines; the array shapes of `EstimatorState` repeat it."""

SWITCH_ON = 0.5
"""Reading of a switch in contact."""

FORCE_ON, FORCE_OFF = 0.35, 0.16
"""Measured normal force from which a foot is in contact, and below which it loses contact, divided
by the weight that each foot bears when all stand."""

LOAD_ON, LOAD_OFF = 0.4, 0.2
"""The same for forces computed from joint loads or position errors."""


class SensorKind(IntEnum):
    """Contact sensor of a foot, the preferred one first."""

    SWITCH = 0
    FORCE = 1
    LOAD = 2
    ANGLE = 3


class SensorEvent(IntEnum):
    """Change of the trust in a contact sensor."""

    NONE = 0
    DEAD = 1
    STUCK_ON = 2
    STUCK_OFF = 3
    FLICKERING = 4
    RECOVERED = 5


class AttitudeSource(IntEnum):
    """Sensor that the attitude estimate follows."""

    NONE = 0
    ORIENTATION = 1
    ACCELEROMETER = 2


class EstimatorEvent(IntFlag):
    """Events of one update."""

    SENSOR = 1
    ATTITUDE = 2


@dataclass(eq=False)
class Measurements:
    """Sensor readings of one update, NaN where a sensor is absent."""

    joint_position: Float[np.ndarray, "legs 3"]  # [rad]
    joint_load: Float[np.ndarray, "legs 3"]  # servo output over its maximum
    contact: Float[np.ndarray, " legs"]  # switches, 0 or 1
    foot_normal_force: Float[np.ndarray, " legs"]  # force sensors of the feet [N]
    orientation: Float[np.ndarray, "4"]  # of the body, w x y z
    angular_velocity: Float[np.ndarray, "3"]  # gyro, body axes [rad/s]
    acceleration: Float[np.ndarray, "3"]  # accelerometer, body axes [m/s²]


@dataclass(eq=False)
class ContactSensor:
    """Reading and reliability of one contact sensor of one foot."""

    reading: float  # 0 or 1 of a switch, else the normal force [N]; NaN: none
    contact: int  # 1 while the sensor indicates contact
    silence: float  # time since the last finite reading [s]
    air_time: float  # time without contact since the last lift-off [s]
    swing_count: int  # readings in mid-swing since the last lift-off
    swing_contacts: int  # those of them that indicate contact
    swing_changes: int  # changes of the indication in mid-swing
    stance_count: int  # readings in stance since the last lift-off
    stance_contacts: int  # those of them that indicate contact
    fault_score: float  # implausible steps, less RECOVERY for each plausible one
    distrusted: int  # 1 while the sensor is ignored
    event: int  # SensorEvent that Python has not reported yet


@dataclass(eq=False)
class FootEstimate:
    """Plan and estimate of one foot."""

    sensors: Annotated[list[ContactSensor], "4"]  # by SensorKind
    standing: int  # 1 where the plan has the foot in stance
    was_standing: int  # the same at the last update
    swing_progress: float  # completed share of the planned swing
    contact: int  # Contact after debouncing
    contradiction_time: float  # for which the sensors have contradicted `contact` [s]
    left_ground: int  # 1 in a swing once the foot has lost contact
    obstacle_hits: int  # obstacles met in this swing
    reported_hits: int  # those of them that are in the engine's reference
    bearing: int  # 1 where the foot stands and is not in the air
    foothold: Float[np.ndarray, "3"]  # last bearing position in odom [m]
    foothold_weight: float  # in the ground plane, 0 to 1
    deflection: float  # height over the joint targets' position, from the body [m]
    sag: float  # height that the foot lacks in the air, or lacked at touchdown [m]


@dataclass(eq=False)
class AttitudeEstimate:
    """Direction of up in body axes."""

    up: Float[np.ndarray, "3"]  # estimate with the sensor delay compensated
    filtered_up: Float[np.ndarray, "3"]  # filter over all inertial sensors
    inertial_up: Float[np.ndarray, "3"]  # filter over gyro and accelerometer alone
    gyro_bias: Float[np.ndarray, "3"]  # [rad/s]
    orientation: Float[np.ndarray, "4"]  # last reading
    started: int  # 1 after the first usable reading
    frozen_time: float  # for which a walking robot's orientation has not changed [s]
    disagreement_time: float  # for which the two filters have contradicted each other [s]
    accelerometer_silence: float  # time since the last usable specific force [s]
    source: int  # AttitudeSource in use


@dataclass(eq=False)
class Plane:
    """Plane in odom by the height at a reference point, and the slopes."""

    height: float  # [m]
    slope_x: float
    slope_y: float
    x: float  # reference point [m]
    y: float


@dataclass(eq=False)
class BodyLevelling:
    """Direction of up in odom, and correction of the body's pose in the axes of the path."""

    up: Float[np.ndarray, "3"]  # low-pass filtered
    tilt: float  # sine of the angle between up and odom's z, to which odom is aligned
    started: int  # 1 after the first update
    shift: Float[np.ndarray, "2"]  # forward and lateral [m]
    rise: float  # of the shift along the ground [m]
    lean: Float[np.ndarray, "2"]  # roll and pitch [rad]


@dataclass(eq=False)
class EstimatorState:
    """State of the ground estimator."""

    feet: Annotated[list[FootEstimate], "legs"]
    attitude: AttitudeEstimate
    fitted_plane: Plane  # through the bearing feet
    lagged_plane: Plane  # the same after one first-order lag
    ground_plane: Plane  # the same after two: the estimate
    plane_started: int  # 1 once the planes have values
    levelling: BodyLevelling
    roughness: float  # largest recent height difference of the feet over the plane [m]
    narrowing: float  # of the stance, towards the body [m]
    body_sag: float  # height that the body lacks, low-pass filtered [m]
    commanded_step_height: float  # before it is raised for rough ground [m]
    raised_step_height: float  # last one in the engine's reference [m]
    joint_targets: Float[np.ndarray, "128 legs 3"]  # delay line [rad]
    body_attitudes: Float[np.ndarray, "128 3 3"]  # delay line, commanded, in odom
    available: Int[np.ndarray, "4"]  # contact sensors of the robot, by SensorKind
    used: Int[np.ndarray, "4"]  # those that contact is detected by
    updates: int  # number of updates


@dataclass(eq=False)
class EstimatorParameters:
    """Settings, thresholds, and constants of the robot."""

    level: float  # 1: the body is level; 0: parallel to the ground
    imu_delay: float  # of the inertial readings [s]
    contact_on: Float[np.ndarray, "4"]  # least reading in contact, by SensorKind
    contact_off: Float[np.ndarray, "4"]  # below it contact is lost
    lengths: Float[np.ndarray, "legs 4"]  # of the links, and the foot's lateral offset [m]
    up: Float[np.ndarray, "legs 3"]  # body's z in hip axes
    link_mass: Float[np.ndarray, "legs 3"]  # [kg]
    link_moment: Float[np.ndarray, "legs 3 3"]  # first moments, as in `link_moments` [kg·m]
    link_inertia: Float[np.ndarray, "legs 3 3 3"]  # about the links' origins [kg·m²]
    dt: float  # update period [s]
    full_torque: Float[np.ndarray, "legs 3"]  # of the servos at their full output [N·m]
    stiffness: Float[np.ndarray, "legs 3"]  # of the servos [N·m/rad]
    gravity: float  # acceleration of free fall [m/s²]
    joint_delay: int  # of the joint readings [updates]
    attitude_delay: int  # length of the attitude's delay line [updates]
    leg_count: int


MEASURED = tuple(field.name for field in fields(Measurements))
"""Sensor readings of an `Observation` that the estimator uses."""

MEASUREMENTS, ESTIMATOR_STATE, ESTIMATOR_PARAMETERS = (
    record_of(kind) for kind in (Measurements, EstimatorState, EstimatorParameters)
)


def parameters_of(
    robot: Robot, settings: EstimatorSettings, dt: float, gravity: float
) -> EstimatorParameters:
    """Return the parameters of a robot's estimator.

    Args:
        robot: The robot.
        settings: Levelling and delays.
        dt: Update period [s].
        gravity: Gravitational acceleration [m/s²].

    Raises:
        InvalidInput: A delay is longer than `DELAY_UPDATES` updates.
    """
    for name in ("joint_delay", "motion_lag"):
        delay = getattr(settings, name)
        if delay > (DELAY_UPDATES - 1) * dt:
            raise InvalidInput(
                f"{name} is {delay:g} s; it must be at most {DELAY_UPDATES - 1} update periods, "
                f"{(DELAY_UPDATES - 1) * dt:g} s."
            )
    arrays, own = robot.arrays, robot.mass * gravity / len(robot.legs)
    return EstimatorParameters(
        settings.level,
        settings.imu_delay,
        np.array([SWITCH_ON, FORCE_ON * own, LOAD_ON * own, LOAD_ON * own]),
        np.array([SWITCH_ON, FORCE_OFF * own, LOAD_OFF * own, LOAD_OFF * own]),
        np.column_stack(geometry(arrays)),
        arrays.R_body_hip[:, 2],
        *link_moments(arrays),
        dt,
        arrays.strength * robot.servo.full_output_torque,
        arrays.strength * robot.servo.stiffness,
        gravity,
        max(1, round(settings.joint_delay / dt)),
        1 + round(settings.motion_lag / dt),
        len(robot.legs),
    )


def clear(states: np.ndarray) -> None:
    """Reset records of the estimator's state to no knowledge but the direction of up.

    Args:
        states: Records of `EstimatorState`, written.
    """
    states[:] = np.zeros((), ESTIMATOR_STATE)
    states["attitude"]["up"][:, 2] = 1.0
    feet = states["feet"]
    feet["was_standing"], feet["contact"] = 1, Contact.UNKNOWN
    feet["sensors"]["reading"] = math.nan
