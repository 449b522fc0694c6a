"""Inverse dynamics of the whole robot at one instant, with contact points and their Jacobians."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.control.feed_forward.state import InverseDynamics, Motion, Parameters
from phasmid.dynamics.whole_body_kernels import inverse_dynamics
from phasmid.kinematics.leg_kernels import add_offset, foot_jacobian, forward_kinematics
from phasmid.kinematics.vector_kernels import add, rotate, rotate_back, vector


@compiled
def solve_inverse_dynamics(
    robot: Parameters,
    motion: Motion,
    normals: Float[np.ndarray, "legs 3"],
    result: InverseDynamics,
) -> None:
    """Write the forces that a motion requires without the ground, contact points and Jacobians.

    Args:
        robot: Masses, lengths and the radius of the feet.
        motion: Motion at one instant.
        normals: Of the ground under the feet.
        result: Written.
    """
    legs, R, acceleration = robot.leg_count, motion.R_world_body, motion.acceleration.copy()
    acceleration[2] += robot.gravity
    inverse_dynamics(
        robot,
        R,
        motion.angular_velocity,
        motion.angular_acceleration,
        acceleration,
        motion.q[:legs],
        motion.qd,
        motion.qdd,
        np.zeros((legs, 3)),
        result.torque,
        result.wrench[:3],
        result.wrench[3:],
    )
    result.torque += robot.armature * motion.qdd
    J = np.empty((3, 3))
    for leg in range(legs):
        lengths, left, q = robot.lengths[leg], robot.left[leg], motion.q[leg]
        R_body_hip, foot, jacobian = robot.R_body_hip[leg], result.foot[leg], result.jacobian[leg]
        p_hip_foot = forward_kinematics(lengths, left, q[0], q[1], q[2])
        p_body_foot = add(vector(robot.p_body_hip[leg]), rotate(R_body_hip, p_hip_foot))
        foot[0], foot[1], foot[2] = rotate(R, p_body_foot)
        foot_jacobian(lengths, left, q[0], q[1], q[2], J)
        if robot.foot_radius > 0.0:
            offset = -robot.foot_radius * normals[leg]
            foot += offset
            x, y, z = rotate_back(R_body_hip, rotate_back(R, vector(offset)))
            add_offset(q[0], x, y, z, J)
        for k in range(3):
            column = rotate(R, rotate(R_body_hip, (J[0, k], J[1, k], J[2, k])))
            jacobian[0, k], jacobian[1, k], jacobian[2, k] = column
