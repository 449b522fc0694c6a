"""Compiled inverse dynamics of the whole robot at one instant, and a ufunc of it.

`dynamics.whole_body` calls the ufunc, the controller the function of one instant.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from phasmid.compiled import compiled, gufunc
from phasmid.kinematics.leg_kernels import sincos
from phasmid.kinematics.vector_kernels import Vector, add, cross, rotate, rotate_back, vector


class RobotMoments(NamedTuple):
    """Geometry and mass distribution of a robot with L legs; moments as in `link_moments`.

    Attributes:
        lengths: Link lengths [m], shape (L, 3).
        left: Offsets of the feet from the legs' planes, to the left [m], shape (L,).
        mass: Link masses [kg], shape (L, 3).
        first: First moments of the links [kg·m], shape (L, 3, 3).
        second: Inertias of the links [kg·m²], shape (L, 3, 3, 3).
        R_body_hip: Rotations of the hip frames, shape (L, 3, 3).
        p_body_hip: Hips in the body frame [m], shape (L, 3).
        trunk_mass: Mass of the trunk [kg].
        trunk_first: Its first moment [kg·m], shape (3,).
        trunk_second: Its inertia [kg·m²], shape (3, 3).
    """

    lengths: np.ndarray
    left: np.ndarray
    mass: np.ndarray
    first: np.ndarray
    second: np.ndarray
    R_body_hip: np.ndarray
    p_body_hip: np.ndarray
    trunk_mass: float
    trunk_first: np.ndarray
    trunk_second: np.ndarray


@compiled
def relative_acceleration(p: Vector, w: Vector, dw: Vector) -> Vector:
    """Return the acceleration of a point p of a turning body relative to the body's origin."""
    return add(cross(dw, p), cross(w, cross(w, p)))


@compiled
def newton_euler(
    mass: float, first: Vector, second: np.ndarray, w: Vector, dw: Vector, a: Vector
) -> tuple[Vector, Vector]:
    """Return force, and moment about the frame's origin, that give a rigid body its motion."""
    force = add((mass * a[0], mass * a[1], mass * a[2]), relative_acceleration(first, w, dw))
    moment = add(rotate(second, dw), cross(w, rotate(second, w)))
    return force, add(moment, cross(first, a))


@compiled
def turned(v: Vector, s: float, c: float) -> Vector:
    """Return a vector in axes turned about z by an angle of this sine and cosine."""
    return c * v[0] + s * v[1], c * v[1] - s * v[0], v[2]


@compiled
def turned_back(v: Vector, s: float, c: float) -> Vector:
    """Return the inverse of `turned`."""
    return c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]


@compiled
def tilted(v: Vector) -> Vector:
    """Return a vector of the coxa's axes in axes whose z is the femur's, the coxa's -y."""
    return v[0], v[2], -v[1]


@compiled
def tilted_back(v: Vector) -> Vector:
    """Return the inverse of `tilted`."""
    return v[0], -v[2], v[1]


@compiled
def joint_motion(
    w: Vector, dw: Vector, s: float, c: float, qd: float, qdd: float
) -> tuple[Vector, Vector]:
    """Return a link's angular velocity and acceleration from those of the link before its joint."""
    (wx, wy, wz), (dx, dy, dz) = turned(w, s, c), turned(dw, s, c)
    return (wx, wy, wz + qd), (dx + wy * qd, dy - wx * qd, dz + qdd)


@compiled
def inverse_dynamics(
    robot: RobotMoments,
    R_world_body: np.ndarray,
    angular_velocity: np.ndarray,
    angular_acceleration: np.ndarray,
    acceleration: np.ndarray,
    q: np.ndarray,
    qd: np.ndarray,
    qdd: np.ndarray,
    foot_force: np.ndarray,
    torque: np.ndarray,
    force: np.ndarray,
    moment: np.ndarray,
) -> None:
    """Write joint torques, and force and moment on the trunk, for a motion of trunk and legs.

    Args:
        robot: The robot, L legs.
        R_world_body: Rotation of the trunk, shape (3, 3).
        angular_velocity: Of the trunk, world axes [rad/s], shape (3,).
        angular_acceleration: Of the trunk, world axes [rad/s²], shape (3,).
        acceleration: Of the body's origin minus that of free fall, world axes [m/s²], shape (3,).
        q: Joint angles [rad], shape (L, 3).
        qd: Joint speeds [rad/s], shape (L, 3).
        qdd: Joint accelerations [rad/s²], shape (L, 3).
        foot_force: Force of the ground on each foot, world axes [N], shape (L, 3).
        torque: Written: joint torques [N·m], shape (L, 3).
        force: Written: force on the trunk, world axes [N], shape (3,).
        moment: Written: moment about the body's origin, world axes [N·m], shape (3,).

    Source: the recursive Newton-Euler algorithm (Luh, Walker, Paul 1980) on a moving base.
    """
    w_body = rotate_back(R_world_body, vector(angular_velocity))
    dw_body = rotate_back(R_world_body, vector(angular_acceleration))
    a_body = rotate_back(R_world_body, vector(acceleration))
    total_force, total_moment = newton_euler(
        robot.trunk_mass, vector(robot.trunk_first), robot.trunk_second, w_body, dw_body, a_body
    )
    for leg in range(len(q)):
        hip, p_hip = robot.R_body_hip[leg], vector(robot.p_body_hip[leg])
        mass, first, second = robot.mass[leg], robot.first[leg], robot.second[leg]
        lengths = robot.lengths[leg]
        femur, tibia = (lengths[0], 0.0, 0.0), (lengths[1], 0.0, 0.0)
        foot = lengths[2], 0.0, -robot.left[leg]
        (s1, c1), (s2, c2), (s3, c3) = sincos(q[leg, 0]), sincos(q[leg, 1]), sincos(q[leg, 2])
        # Motion outwards, from the hip to the tibia.
        w, dw = rotate_back(hip, w_body), rotate_back(hip, dw_body)
        a = rotate_back(hip, add(a_body, relative_acceleration(p_hip, w_body, dw_body)))
        a1 = turned(a, s1, c1)
        w1, dw1 = joint_motion(w, dw, s1, c1, qd[leg, 0], qdd[leg, 0])
        a2 = turned(tilted(add(a1, relative_acceleration(femur, w1, dw1))), s2, c2)
        w2, dw2 = joint_motion(tilted(w1), tilted(dw1), s2, c2, qd[leg, 1], qdd[leg, 1])
        a3 = turned(add(a2, relative_acceleration(tibia, w2, dw2)), s3, c3)
        w3, dw3 = joint_motion(w2, dw2, s3, c3, qd[leg, 2], qdd[leg, 2])
        # Forces inwards, from the foot to the hip.
        push = rotate_back(hip, rotate_back(R_world_body, vector(foot_force[leg])))
        push = turned(turned(tilted(turned(push, s1, c1)), s2, c2), s3, c3)
        f = -push[0], -push[1], -push[2]
        n = cross(foot, f)
        f3, n3 = newton_euler(mass[2], vector(first[2]), second[2], w3, dw3, a3)
        f, n = add(f, f3), add(n, n3)
        torque[leg, 2] = n[2]
        f, n = turned_back(f, s3, c3), turned_back(n, s3, c3)
        f2, n2 = newton_euler(mass[1], vector(first[1]), second[1], w2, dw2, a2)
        f, n = add(f, f2), add(add(n, cross(tibia, f)), n2)
        torque[leg, 1] = n[2]
        f, n = tilted_back(turned_back(f, s2, c2)), tilted_back(turned_back(n, s2, c2))
        f1, n1 = newton_euler(mass[0], vector(first[0]), second[0], w1, dw1, a1)
        f, n = add(f, f1), add(add(n, cross(femur, f)), n1)
        torque[leg, 0] = n[2]
        f, n = turned_back(f, s1, c1), turned_back(n, s1, c1)
        f, n = rotate(hip, f), rotate(hip, n)
        total_force = add(total_force, f)
        total_moment = add(total_moment, add(n, cross(p_hip, f)))
    force[0], force[1], force[2] = rotate(R_world_body, total_force)
    moment[0], moment[1], moment[2] = rotate(R_world_body, total_moment)


@gufunc(
    "(l,n),(l),(l,n),(l,n,n),(l,n,n,n),(l,n,n),(l,n),(),(n),(n,n),"
    "(n,n),(n),(n),(n),(l,n),(l,n),(l,n),(l,n)->(l,n),(n),(n)"
)
def inverse_dynamics_ufunc(
    lengths: np.ndarray,
    left: np.ndarray,
    mass: np.ndarray,
    first: np.ndarray,
    second: np.ndarray,
    R_body_hip: np.ndarray,
    p_body_hip: np.ndarray,
    trunk_mass: float,
    trunk_first: np.ndarray,
    trunk_second: np.ndarray,
    R_world_body: np.ndarray,
    w: np.ndarray,
    dw: np.ndarray,
    a: np.ndarray,
    q: np.ndarray,
    qd: np.ndarray,
    qdd: np.ndarray,
    foot_force: np.ndarray,
    torque: np.ndarray,
    force: np.ndarray,
    moment: np.ndarray,
) -> None:
    """Apply `inverse_dynamics` to each sample; arguments in its order."""
    trunk = trunk_mass, trunk_first, trunk_second
    robot = RobotMoments(lengths, left, mass, first, second, R_body_hip, p_body_hip, *trunk)
    motion = R_world_body, w, dw, a, q, qd, qdd
    inverse_dynamics(robot, *motion, foot_force, torque, force, moment)
