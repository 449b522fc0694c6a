"""Inverse dynamics of the whole robot at one instant, with feet and Jacobians in world axes."""

from __future__ import annotations

import numpy as np

from phasmid.compiled import internal
from phasmid.control.feed_forward.state import InverseDynamics, Motion, Parameters
from phasmid.dynamics.whole_body_kernels import (
    RobotMoments,
    add,
    inverse_dynamics,
    rotate,
    vector,
)
from phasmid.kinematics.leg_kernels import foot_jacobian, forward_kinematics


@internal
def solve_inverse_dynamics(robot: Parameters, motion: Motion, result: InverseDynamics) -> None:
    """Write the forces that a motion requires without the ground, feet and Jacobians.

    Args:
        robot: Masses and lengths.
        motion: Motion at one instant.
        result: Written.
    """
    legs, acceleration = robot.leg_count, motion.acceleration.copy()
    acceleration[2] += robot.gravity
    inverse_dynamics(
        RobotMoments(
            robot.lengths[:, :3],
            robot.lengths[:, 3],
            robot.link_mass,
            robot.link_moment,
            robot.link_inertia,
            robot.R_body_hip,
            robot.p_body_hip,
            robot.trunk_mass,
            robot.trunk_moment,
            robot.trunk_inertia,
        ),
        motion.R_world_body,
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
    J = np.empty((3, 3))
    for leg in range(legs):
        lengths, R_body_hip = robot.lengths[leg], robot.R_body_hip[leg]
        q1, q2, q3 = motion.q[leg, 0], motion.q[leg, 1], motion.q[leg, 2]
        p_hip_foot = forward_kinematics(lengths, lengths[3], q1, q2, q3)
        p_body_foot = add(vector(robot.p_body_hip[leg]), rotate(R_body_hip, p_hip_foot))
        foot, jacobian = result.foot[leg], result.jacobian[leg]
        foot[0], foot[1], foot[2] = rotate(motion.R_world_body, p_body_foot)
        foot_jacobian(lengths, lengths[3], q1, q2, q3, J)
        for k in range(3):
            column = rotate(R_body_hip, (J[0, k], J[1, k], J[2, k]))
            jacobian[0, k], jacobian[1, k], jacobian[2, k] = rotate(motion.R_world_body, column)
            result.torque[leg, k] += robot.armature * motion.qdd[leg, k]
