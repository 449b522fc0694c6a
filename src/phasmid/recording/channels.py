"""Channels of recordings with units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

JOINTS = ("coxa", "femur", "tibia")
"""Coordinates of ``joint``."""

AXES = ("x", "y", "z")
"""Coordinates of ``axis``: forward, left and up where the walk begins."""

QUATERNION = ("w", "x", "y", "z")
"""Coordinates of ``quaternion``."""

WAYS = ("ahead", "left", "turn")
"""Coordinates of ``way``: components of a body's velocity over ground."""


LARGEST_VALUE = 1e12
"""Size of a value above which no part of a robot can be; sums of squares stay within floats."""


@dataclass(frozen=True)
class Channel:
    """Kind of measurement.

    Attributes:
        dims: Names of the array's axes.
        units: Unit of every value; ``1`` where there is none.
        long_name: Description.
        kind: ``float`` for numbers, ``bool`` for yes or no.
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    kind: Literal["float", "bool"] = "float"


_JOINT = ("time", "leg", "joint")
_FOOT = ("time", "leg", "axis")
_LEG = ("time", "leg")
_BODY = ("time", "axis")
_WAY = ("time", "way")

CHANNELS: dict[str, Channel] = {
    "joint_position_target": Channel(_JOINT, "rad", "planned joint angle"),
    "joint_velocity_target": Channel(_JOINT, "rad/s", "planned joint speed"),
    "joint_acceleration_target": Channel(_JOINT, "rad/s²", "planned joint acceleration"),
    "joint_position": Channel(_JOINT, "rad", "joint angle"),
    "joint_velocity": Channel(_JOINT, "rad/s", "joint speed"),
    "joint_torque": Channel(
        _JOINT, "N·m", "torque on the link at the joint's axis, simulated or measured"
    ),
    "joint_torque_model": Channel(_JOINT, "N·m", "joint torque by inverse dynamics"),
    "servo_duty": Channel(_JOINT, "1", "output of the servo, a share of its supply voltage"),
    "servo_current": Channel(_JOINT, "A", "current of the servo's motor"),
    "servo_motor_torque": Channel(_JOINT, "N·m", "torque of the servo's motor, at the output"),
    "servo_friction_torque": Channel(
        _JOINT, "N·m", "friction torque of the servo on its rotor, at the output"
    ),
    "servo_speed": Channel(_JOINT, "rad/s", "speed of the servo's rotor, seen at the output"),
    "servo_temperature": Channel(_JOINT, "degC", "temperature of the servo"),
    "servo_shutdown": Channel(_JOINT, "1", "whether the servo has shut down", "bool"),
    "foot_force": Channel(_FOOT, "N", "force of the ground on the foot, world axes"),
    "foot_force_model": Channel(_FOOT, "N", "force of the ground on the foot by the model"),
    "foot_normal_force": Channel(_LEG, "N", "normal force of the ground on the foot"),
    "foot_normal_force_model": Channel(_LEG, "N", "normal force on the foot by the model"),
    "foot_position": Channel(_FOOT, "m", "foot in the world"),
    "stance": Channel(_LEG, "1", "whether the foot is planned to stand", "bool"),
    "leg_use": Channel(_LEG, "1", "0 lost, 1 in use, 2 lost but needed, lest the robot fall"),
    "contact": Channel(_LEG, "1", "whether the foot touches the ground", "bool"),
    "body_position": Channel(_BODY, "m", "origin of the body frame in the world"),
    "body_velocity": Channel(_BODY, "m/s", "velocity of the body frame's origin, world axes"),
    "body_orientation": Channel(
        ("time", "quaternion"), "1", "orientation of the body in the world, w x y z"
    ),
    "body_angular_velocity": Channel(_BODY, "rad/s", "angular velocity of the body, world axes"),
    "joint_position_measured": Channel(_JOINT, "rad", "joint angle that the encoder reports"),
    "joint_position_time": Channel(_JOINT, "s", "time at which the encoder was read"),
    "joint_load_measured": Channel(_JOINT, "1", "output that the servo reports"),
    "servo_temperature_measured": Channel(_JOINT, "degC", "temperature that the servo reports"),
    "servo_voltage_measured": Channel(_JOINT, "V", "supply that the servo reports"),
    "imu_angular_velocity": Channel(_BODY, "rad/s", "angular velocity by the gyro, body axes"),
    "imu_acceleration": Channel(_BODY, "m/s²", "specific force by the accelerometer, body axes"),
    "imu_orientation": Channel(
        ("time", "quaternion"), "1", "orientation of the body by the inertial sensor, w x y z"
    ),
    "foot_normal_force_measured": Channel(_LEG, "N", "normal force by the foot's sensor"),
    "contact_measured": Channel(_LEG, "1", "whether the foot's sensor feels the ground", "bool"),
    "body_position_estimated": Channel(_BODY, "m", "estimated origin of the body frame in odom"),
    "body_velocity_estimated": Channel(
        _BODY, "m/s", "estimated velocity of the body frame's origin, axes of odom"
    ),
    "velocity_command": Channel(_WAY, "m/s, rad/s", "commanded velocity of the body"),
    "velocity_reference": Channel(_WAY, "m/s, rad/s", "velocity that the engine gives the body"),
    "slow_down": Channel(("time",), "1", "rate at which the engine's own time passes"),
    "support_margin": Channel(("time",), "m", "centre of mass from the edge of the planned stance"),
    "gait_phase": Channel(("time",), "1", "phase of the gait's clock"),
    "sequence": Channel(
        ("time",),
        "1",
        "0 lies, 1 gets up or sits down, 2 stands or walks, 3 stops, 4 lifts legs, 5 has them by "
        "hand, 6 gathers its legs, 7 starts",
    ),
    "safety_mode": Channel(("time",), "1", "0 free, 1 slow, 2 sits, 3 holds still"),
}
"""Every channel by its name, in the order in which a recording keeps them."""

COMMANDED = "velocity_command"
"""Channel of the commanded velocity, beside the controller's telemetry."""

OBSERVED = {
    "joint_position_measured": "joint_position",
    "joint_load_measured": "joint_load",
    "imu_angular_velocity": "angular_velocity",
    "imu_acceleration": "acceleration",
    "imu_orientation": "orientation",
    "foot_normal_force_measured": "foot_normal_force",
    "contact_measured": "contact",
}
"""Measured channels, and their fields of an observation."""

WALKING = 2, 3
"""Values of ``sequence`` at which a robot may walk: stands or walks, and stops."""

COORDINATES: dict[str, tuple[str, ...]] = {
    "joint": JOINTS,
    "axis": AXES,
    "quaternion": QUATERNION,
    "way": WAYS,
}
"""Axes of fixed length; ``time`` and ``leg`` are as long as the run and the robot make them."""

MOST_RECORDED = 4_000_000
"""Most samples of a recording: of a simulated hexapod 1.7 kB each, with servos 2.4 kB."""

MOST_BYTES = 16_000_000_000
"""Most bytes of a recording in memory: those samples of a large robot with all channels."""


def walking_command(
    command: Float[np.ndarray, "time 3"], sequence: Float[np.ndarray, " time"] | None
) -> Float[np.ndarray, "time 3"]:
    """Return a commanded velocity, zero while a robot lies, gets up or moves legs by hand.

    Args:
        command: Channel ``velocity_command``, shape (N, 3).
        sequence: Channel ``sequence``, shape (N,); None: the controller has none.
    """
    if sequence is None:
        return command
    return np.where(np.isin(sequence, WALKING)[:, None], command, 0.0)
