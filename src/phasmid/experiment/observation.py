"""Observation of the robot by its sensors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """Latest sensor readings of a robot with L legs; None where it lacks a sensor.

    A value that is not finite comes from a failed sensor; a controller must not use it.

    Attributes:
        time: Time on the controller's clock [s].
        joint_position: Joint angles [rad], shape (L, 3).
        joint_velocity: Joint speeds [rad/s], shape (L, 3); most servos measure none.
        joint_load: Output of each servo as a share of the full one at its supply, shape (L, 3).
        servo_running: Servos that answer and have not shut down, shape (L, 3).
        orientation: Orientation of the body, w x y z; its yaw may drift, shape (4,).
        angular_velocity: Gyro reading, body axes [rad/s], shape (3,).
        acceleration: Specific force of the accelerometer, body axes [m/s²], shape (3,).
        contact: Contact of each foot, shape (L,).
        foot_normal_force: Normal force of each foot [N], shape (L,).
        ground_points: Points of the ground that a depth sensor measured, in the body axes of the
            time of the reading [m], shape (N, 3); None where no new reading has arrived.
        body_position: Estimated origin of the body frame in odom [m], shape (3,); None where the
            body's state is not estimated.
        body_velocity: Its estimated velocity, axes of odom [m/s], shape (3,).
        body_orientation: Estimated orientation of the body in odom, w x y z, shape (4,).
    """

    time: float
    joint_position: Float[np.ndarray, "legs 3"]
    joint_velocity: Float[np.ndarray, "legs 3"] | None = None
    joint_load: Float[np.ndarray, "legs 3"] | None = None
    servo_running: Bool[np.ndarray, "legs 3"] | None = None
    orientation: Float[np.ndarray, "4"] | None = None
    angular_velocity: Float[np.ndarray, "3"] | None = None
    acceleration: Float[np.ndarray, "3"] | None = None
    contact: Bool[np.ndarray, " legs"] | None = None
    foot_normal_force: Float[np.ndarray, " legs"] | None = None
    ground_points: Float[np.ndarray, "points 3"] | None = None
    body_position: Float[np.ndarray, "3"] | None = None
    body_velocity: Float[np.ndarray, "3"] | None = None
    body_orientation: Float[np.ndarray, "4"] | None = None
