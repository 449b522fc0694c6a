"""Inverse dynamics of the whole robot at one instant, with feet and Jacobians.

The same as `dynamics.inverse_dynamics` without feet on the ground; used once per update.
"""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import internal
from phasmid.control.feed_forward.state import InverseDynamics, Motion, Parameters


@internal
def solve_inverse_dynamics(robot: Parameters, motion: Motion, result: InverseDynamics) -> None:
    """Fill in the forces that a motion requires, by recursion from the trunk to the feet and back.

    Args:
        robot: Masses and lengths.
        motion: Motion at one instant.
        result: Written.
    """
    R, w, dw = motion.R_world_body, motion.angular_velocity, motion.angular_acceleration
    q, qd, qdd, felt = motion.q, motion.qd, motion.qdd, np.empty(3)
    felt[0], felt[1] = motion.acceleration[0], motion.acceleration[1]
    felt[2] = motion.acceleration[2] + robot.gravity
    trunk_f, trunk_n, base = np.empty(3), np.empty(3), np.empty((3, 3))
    # Columns of base: w, dw and the felt acceleration in the body's axes.
    for i in range(3):
        base[i, 0] = R[0, i] * w[0] + R[1, i] * w[1] + R[2, i] * w[2]
        base[i, 1] = R[0, i] * dw[0] + R[1, i] * dw[1] + R[2, i] * dw[2]
        base[i, 2] = R[0, i] * felt[0] + R[1, i] * felt[1] + R[2, i] * felt[2]
    w0, w1, w2 = base[0, 0], base[1, 0], base[2, 0]
    d0, d1, d2 = base[0, 1], base[1, 1], base[2, 1]
    a0, a1, a2 = base[0, 2], base[1, 2], base[2, 2]
    _newton_euler(
        robot.trunk_mass,
        robot.trunk_moment,
        robot.trunk_inertia,
        w0,
        w1,
        w2,
        d0,
        d1,
        d2,
        a0,
        a1,
        a2,
        trunk_f,
        trunk_n,
    )
    f, n = np.empty((3, 3)), np.empty((3, 3))
    turn, hip = np.empty((3, 2)), np.empty((3, 3))
    for leg in range(robot.leg_count):
        B, p = robot.R_body_hip[leg], robot.p_body_hip[leg]
        coxa, femur, tibia, left = robot.lengths[leg]
        # The hip's acceleration, then all in the hip's axes.
        along = w0 * p[0] + w1 * p[1] + w2 * p[2]
        square = w0 * w0 + w1 * w1 + w2 * w2
        h0 = a0 + d1 * p[2] - d2 * p[1] + w0 * along - square * p[0]
        h1 = a1 + d2 * p[0] - d0 * p[2] + w1 * along - square * p[1]
        h2 = a2 + d0 * p[1] - d1 * p[0] + w2 * along - square * p[2]
        for i in range(3):
            hip[i, 0] = B[0, i] * w0 + B[1, i] * w1 + B[2, i] * w2
            hip[i, 1] = B[0, i] * d0 + B[1, i] * d1 + B[2, i] * d2
            hip[i, 2] = B[0, i] * h0 + B[1, i] * h1 + B[2, i] * h2
        x, y, z = hip[0, 0], hip[1, 0], hip[2, 0]
        dx, dy, dz = hip[0, 1], hip[1, 1], hip[2, 1]
        ax, ay, az = hip[0, 2], hip[1, 2], hip[2, 2]
        for k in range(3):
            c, s = math.cos(q[leg, k]), math.sin(q[leg, k])
            turn[k, 0], turn[k, 1] = c, s
            start = 0.0 if k == 0 else robot.lengths[leg, k - 1]
            ax -= start * (y * y + z * z)
            ay += start * (dz + x * y)
            az += start * (x * z - dy)
            if k == 1:
                # The femur's axis is the coxa's -y (Table 1's alpha of 90 degrees).
                y, z = z, -y
                dy, dz = dz, -dy
                ay, az = az, -ay
            x, y = c * x + s * y, c * y - s * x
            dx, dy = c * dx + s * dy, c * dy - s * dx
            ax, ay = c * ax + s * ay, c * ay - s * ax
            rate = qd[leg, k]
            dx, dy, dz = dx + y * rate, dy - x * rate, dz + qdd[leg, k]
            z += rate
            _newton_euler(
                robot.link_mass[leg, k],
                robot.link_moment[leg, k],
                robot.link_inertia[leg, k],
                x,
                y,
                z,
                dx,
                dy,
                dz,
                ax,
                ay,
                az,
                f[k],
                n[k],
            )
        fx = fy = fz = nx = ny = nz = 0.0
        for back in range(3):
            k = 2 - back
            fx, fy, fz = fx + f[k, 0], fy + f[k, 1], fz + f[k, 2]
            nx, ny, nz = nx + n[k, 0], ny + n[k, 1], nz + n[k, 2]
            result.torque[leg, k] = nz + robot.armature * qdd[leg, k]
            c, s = turn[k, 0], turn[k, 1]
            fx, fy = c * fx - s * fy, s * fx + c * fy
            nx, ny = c * nx - s * ny, s * nx + c * ny
            if k == 1:
                fy, fz = -fz, fy
                ny, nz = -nz, ny
            if k > 0:
                start = robot.lengths[leg, k - 1]
                ny -= start * fz
                nz += start * fy
        g0 = B[0, 0] * fx + B[0, 1] * fy + B[0, 2] * fz
        g1 = B[1, 0] * fx + B[1, 1] * fy + B[1, 2] * fz
        g2 = B[2, 0] * fx + B[2, 1] * fy + B[2, 2] * fz
        trunk_f[0] += g0
        trunk_f[1] += g1
        trunk_f[2] += g2
        trunk_n[0] += B[0, 0] * nx + B[0, 1] * ny + B[0, 2] * nz + p[1] * g2 - p[2] * g1
        trunk_n[1] += B[1, 0] * nx + B[1, 1] * ny + B[1, 2] * nz + p[2] * g0 - p[0] * g2
        trunk_n[2] += B[2, 0] * nx + B[2, 1] * ny + B[2, 2] * nz + p[0] * g1 - p[1] * g0

        # The foot and its Jacobian, in the hip's axes, then in the world's.
        c1, s1, c2, s2 = turn[0, 0], turn[0, 1], turn[1, 0], turn[1, 1]
        c3, s3 = c2 * turn[2, 0] - s2 * turn[2, 1], s2 * turn[2, 0] + c2 * turn[2, 1]
        out, up = femur * c2 + tibia * c3, femur * s2 + tibia * s3
        reach = coxa + out
        hip[0, 0], hip[1, 0], hip[2, 0] = -reach * s1 - left * c1, reach * c1 - left * s1, 0.0
        hip[0, 1], hip[1, 1], hip[2, 1] = -up * c1, -up * s1, out
        hip[0, 2], hip[1, 2], hip[2, 2] = -tibia * s3 * c1, -tibia * s3 * s1, tibia * c3
        for i in range(3):
            u0 = R[i, 0] * B[0, 0] + R[i, 1] * B[1, 0] + R[i, 2] * B[2, 0]
            u1 = R[i, 0] * B[0, 1] + R[i, 1] * B[1, 1] + R[i, 2] * B[2, 1]
            u2 = R[i, 0] * B[0, 2] + R[i, 1] * B[1, 2] + R[i, 2] * B[2, 2]
            at = R[i, 0] * p[0] + R[i, 1] * p[1] + R[i, 2] * p[2]
            result.foot[leg, i] = at + u0 * reach * c1 + u1 * reach * s1 + u2 * up
            result.foot[leg, i] += left * (u1 * c1 - u0 * s1)
            for k in range(3):
                result.jacobian[leg, i, k] = u0 * hip[0, k] + u1 * hip[1, k] + u2 * hip[2, k]
    for i in range(3):
        result.wrench[i] = R[i, 0] * trunk_f[0] + R[i, 1] * trunk_f[1] + R[i, 2] * trunk_f[2]
        result.wrench[3 + i] = R[i, 0] * trunk_n[0] + R[i, 1] * trunk_n[1] + R[i, 2] * trunk_n[2]


@internal
def _newton_euler(
    mass: float,
    first: np.ndarray,
    second: np.ndarray,
    x: float,
    y: float,
    z: float,
    dx: float,
    dy: float,
    dz: float,
    ax: float,
    ay: float,
    az: float,
    force: np.ndarray,
    moment: np.ndarray,
) -> None:
    """Force, and moment about the frame's origin, that give a rigid body its motion."""
    c0, c1, c2 = first[0], first[1], first[2]
    along = x * c0 + y * c1 + z * c2
    square = x * x + y * y + z * z
    force[0] = mass * ax + dy * c2 - dz * c1 + x * along - square * c0
    force[1] = mass * ay + dz * c0 - dx * c2 + y * along - square * c1
    force[2] = mass * az + dx * c1 - dy * c0 + z * along - square * c2
    p = second[0, 0] * x + second[0, 1] * y + second[0, 2] * z
    q = second[1, 0] * x + second[1, 1] * y + second[1, 2] * z
    r = second[2, 0] * x + second[2, 1] * y + second[2, 2] * z
    u = second[0, 0] * dx + second[0, 1] * dy + second[0, 2] * dz
    v = second[1, 0] * dx + second[1, 1] * dy + second[1, 2] * dz
    t = second[2, 0] * dx + second[2, 1] * dy + second[2, 2] * dz
    moment[0] = u + y * r - z * q + c1 * az - c2 * ay
    moment[1] = v + z * p - x * r + c2 * ax - c0 * az
    moment[2] = t + x * q - y * p + c0 * ay - c1 * ax
