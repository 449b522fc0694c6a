"""What a controller is told of the robot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """What the robot's sensors have told by now; a sensor that it lacks is None.

    A value that is not finite is of a sensor that has failed; a controller must not follow it.

    Attributes:
        time: Of this observation, on the controller's own clock [s].
        joint_position: Joint angles [rad], shape (L, 3).
        joint_velocity: Joint speeds [rad/s], shape (L, 3); most servos tell none.
        joint_load: Output of each servo, a share of its largest, shape (L, 3).
        servo_running: Which servos have not shut down and answer, shape (L, 3).
        orientation: Of the body, by the inertial sensor, w x y z; its yaw may drift, shape (4,).
        angular_velocity: By the gyro, body axes [rad/s], shape (3,).
        acceleration: Specific force by the accelerometer, body axes [m/s²], shape (3,).
        contact: Which feet feel the ground, shape (L,).
        foot_normal_force: By the feet's sensors [N], shape (L,).
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
