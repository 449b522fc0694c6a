"""Inverse dynamics of the whole robot at one instant, with feet and Jacobians in world axes."""

from __future__ import annotations

import numpy as np

from phasmid.compiled import internal
from phasmid.control.feed_forward.state import InverseDynamics, Motion, Parameters
from phasmid.dynamics.whole_body_kernels import inverse_dynamics
from phasmid.kinematics.leg_kernels import foot_jacobian, forward_kinematics


@internal
def solve_inverse_dynamics(robot: Parameters, motion: Motion, result: InverseDynamics) -> None:
    """Write the forces that a motion requires without the ground, feet and Jacobians.

    Args:
        robot: Masses and lengths.
        motion: Motion at one instant.
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
        R_world_hip = R @ robot.R_body_hip[leg]
        p_hip_foot = np.array(forward_kinematics(lengths, left, q[0], q[1], q[2]))
        result.foot[leg] = R @ robot.p_body_hip[leg] + R_world_hip @ p_hip_foot
        foot_jacobian(lengths, left, q[0], q[1], q[2], J)
        result.jacobian[leg] = R_world_hip @ J
