"""Inverse dynamics of the whole robot over any number of samples."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid import dynamics
from phasmid.batch.evaluation import evaluate
from phasmid.dynamics import BodyMotion, JointTorqueAndWrench
from phasmid.dynamics.whole_body import joint_arrays
from phasmid.kinematics.arguments import number
from phasmid.robot import Robot
from phasmid.units import STANDARD_GRAVITY


def inverse_dynamics(
    robot: Robot,
    body: BodyMotion,
    q: Float[np.ndarray, "*#batch legs 3"],
    qd: Float[np.ndarray, "*#batch legs 3"],
    qdd: Float[np.ndarray, "*#batch legs 3"],
    *,
    foot_force: Float[np.ndarray, "*#batch legs 3"] | None = None,
    gravity: float = STANDARD_GRAVITY,
    threads: int | None = 1,
) -> JointTorqueAndWrench:
    """Joint torques, and what must hold the trunk, as ``dynamics.inverse_dynamics``.

    Args:
        robot: The robot, L legs.
        body: Pose and motion of the trunk; its leading axes broadcast against those of q.
        q: Joint angles [rad], shape (..., L, 3).
        qd: Joint speeds [rad/s], shape (..., L, 3).
        qdd: Joint accelerations [rad/s²], shape (..., L, 3).
        foot_force: Force of the ground on each foot in world axes [N], shape (..., L, 3);
            none by default.
        gravity: Acceleration of free fall, downwards along the world's z [m/s²].
        threads: Threads to use; None for one per core.

    Returns:
        Joint torques, shape (..., L, 3), and the wrench on the trunk, shape (..., 6).

    Raises:
        InvalidInput: It is no robot or no motion of a trunk, an array or ``threads`` does not fit,
            or gravity is no finite number.
    """
    loads = {} if foot_force is None else {"foot_force": foot_force}
    lead, given = joint_arrays(robot, body, q=q, qd=qd, qdd=qdd, **loads)
    count, gravity = len(robot.legs), number("gravity", gravity)
    gravities = np.full(count, gravity)
    force = [] if loads else [np.zeros((count, 3))]
    joints = dict(zip(("q", "qd", "qdd", "foot_force"), [*given, *force], strict=True))
    arrays, trunk = robot.arrays, robot.body

    def readable(
        rotation: np.ndarray,
        angular_velocity: np.ndarray,
        angular_acceleration: np.ndarray,
        acceleration: np.ndarray,
        **parts: np.ndarray,
    ) -> tuple[np.ndarray, ...]:
        still = np.zeros(3)
        turning = angular_velocity, acceleration, angular_acceleration
        part = BodyMotion(still, rotation, still, *turning)
        torque, wrench = dynamics.inverse_dynamics(robot, part, **parts, gravity=gravity)
        return torque, wrench.reshape(-1, 2, 3)

    torque, wrench = np.empty((*lead, count, 3)), np.empty((*lead, 6))
    upright = np.array_equal(arrays.R_body_hip[:, 2], np.tile([0.0, 0.0, 1.0], (count, 1)))
    evaluate(
        "inverse_dynamics" if upright else "tilted_inverse_dynamics",
        {
            "gravity": gravities,
            "lengths": arrays.lengths,
            "mass": arrays.mass,
            "com": arrays.com,
            "inertia": arrays.inertia,
            "R_body_hip": arrays.R_body_hip,
            "p_body_hip": arrays.p_body_hip,
        },
        {
            "rotation": body.rotation,
            "angular_velocity": body.angular_velocity,
            "angular_acceleration": body.angular_acceleration,
            "acceleration": body.acceleration,
            **joints,
        },
        [torque, wrench.reshape(*lead, 2, 3)],
        lead,
        readable,
        trunk={
            "gravity": gravities[:1],
            "mass": np.array([trunk.mass]),
            "com": trunk.com[None],
            "inertia": trunk.inertia[None],
        },
        threads=threads,
    )
    return JointTorqueAndWrench(torque, wrench)
