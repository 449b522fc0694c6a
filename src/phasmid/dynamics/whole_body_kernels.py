"""Compiled inverse dynamics of the whole robot at one instant, and over arrays of samples.

`dynamics.whole_body` validates and calls the function over arrays. Vectors are tuples of three
numbers, so that the compiler keeps them in registers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from phasmid.compiled import broadcasting, compiled, internal
from phasmid.kinematics.leg_kernels import sincos

Vector = tuple[float, float, float]


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


@internal
def vector(a: np.ndarray) -> Vector:
    """Return an array of three numbers as a vector."""
    return a[0], a[1], a[2]


@internal
def add(a: Vector, b: Vector) -> Vector:
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@internal
def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@internal
def rotate(R: np.ndarray, v: Vector) -> Vector:
    """Return R v."""
    return (
        R[0, 0] * v[0] + R[0, 1] * v[1] + R[0, 2] * v[2],
        R[1, 0] * v[0] + R[1, 1] * v[1] + R[1, 2] * v[2],
        R[2, 0] * v[0] + R[2, 1] * v[1] + R[2, 2] * v[2],
    )


@internal
def rotate_back(R: np.ndarray, v: Vector) -> Vector:
    """Return the transpose of R times v."""
    return (
        R[0, 0] * v[0] + R[1, 0] * v[1] + R[2, 0] * v[2],
        R[0, 1] * v[0] + R[1, 1] * v[1] + R[2, 1] * v[2],
        R[0, 2] * v[0] + R[1, 2] * v[1] + R[2, 2] * v[2],
    )


@internal
def relative_acceleration(p: Vector, w: Vector, dw: Vector) -> Vector:
    """Return the acceleration of a point p of a turning body relative to the body's origin."""
    return add(cross(dw, p), cross(w, cross(w, p)))


@internal
def tip_acceleration(length: float, w: Vector, dw: Vector) -> Vector:
    """Return `relative_acceleration` of the point (length, 0, 0)."""
    return (
        -length * (w[1] * w[1] + w[2] * w[2]),
        length * (dw[2] + w[0] * w[1]),
        length * (w[0] * w[2] - dw[1]),
    )


@internal
def tip_moment(length: float, force: Vector) -> Vector:
    """Return the moment about the origin of a force at the point (length, 0, 0)."""
    return 0.0, -length * force[2], length * force[1]


@internal
def newton_euler(
    mass: float, first: Vector, second: np.ndarray, w: Vector, dw: Vector, a: Vector
) -> tuple[Vector, Vector]:
    """Return force, and moment about the frame's origin, that give a rigid body its motion."""
    force = add((mass * a[0], mass * a[1], mass * a[2]), relative_acceleration(first, w, dw))
    moment = add(rotate(second, dw), cross(w, rotate(second, w)))
    return force, add(moment, cross(first, a))


@internal
def into_link(k: int, v: Vector, c: float, s: float) -> Vector:
    """Return a vector of the previous link's axes in those of link k, turned by its joint."""
    # The femur's axis is the coxa's -y (Table 1's alpha of 90 degrees).
    x, y, z = (v[0], v[2], -v[1]) if k == 1 else v
    return c * x + s * y, c * y - s * x, z


@internal
def out_of_link(k: int, v: Vector, c: float, s: float) -> Vector:
    """Return the inverse of `into_link`."""
    x, y, z = c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]
    return (x, -z, y) if k == 1 else (x, y, z)


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
    forces, moments, turns = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 2))
    for leg in range(len(q)):
        hip, p_hip = robot.R_body_hip[leg], vector(robot.p_body_hip[leg])
        w, dw = rotate_back(hip, w_body), rotate_back(hip, dw_body)
        a = rotate_back(hip, add(a_body, relative_acceleration(p_hip, w_body, dw_body)))
        foot = rotate_back(hip, rotate_back(R_world_body, vector(foot_force[leg])))
        for k in range(3):
            # Motion outwards, from the hip to the tibia.
            if k > 0:
                a = add(a, tip_acceleration(robot.lengths[leg, k - 1], w, dw))
            s, c = sincos(q[leg, k])
            a, foot = into_link(k, a, c, s), into_link(k, foot, c, s)
            (wx, wy, wz), (dx, dy, dz) = into_link(k, w, c, s), into_link(k, dw, c, s)
            w = wx, wy, wz + qd[leg, k]
            dw = dx + wy * qd[leg, k], dy - wx * qd[leg, k], dz + qdd[leg, k]
            link = robot.mass[leg, k], vector(robot.first[leg, k]), robot.second[leg, k]
            forces[k], moments[k] = newton_euler(*link, w, dw, a)
            turns[k] = s, c
        f = -foot[0], -foot[1], -foot[2]
        n = cross((robot.lengths[leg, 2], 0.0, -robot.left[leg]), f)
        for k in range(2, -1, -1):
            # Forces inwards, from the foot to the hip.
            s, c = turns[k]
            f, n = add(f, vector(forces[k])), add(n, vector(moments[k]))
            torque[leg, k] = n[2]
            f, n = out_of_link(k, f, c, s), out_of_link(k, n, c, s)
            if k > 0:
                n = add(n, tip_moment(robot.lengths[leg, k - 1], f))
        f, n = rotate(hip, f), rotate(hip, n)
        total_force = add(total_force, f)
        total_moment = add(total_moment, add(n, cross(p_hip, f)))
    force[0], force[1], force[2] = rotate(R_world_body, total_force)
    moment[0], moment[1], moment[2] = rotate(R_world_body, total_moment)


@broadcasting(
    "(l,n),(l),(l,n),(l,n,n),(l,n,n,n),(l,n,n),(l,n),(),(n),(n,n),"
    "(n,n),(n),(n),(n),(l,n),(l,n),(l,n),(l,n)->(l,n),(n),(n)"
)
def each_inverse_dynamics(
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
    """Apply `inverse_dynamics` to each sample."""
    trunk = trunk_mass, trunk_first, trunk_second
    robot = RobotMoments(lengths, left, mass, first, second, R_body_hip, p_body_hip, *trunk)
    inverse_dynamics(
        robot,
        R_world_body,
        angular_velocity,
        angular_acceleration,
        acceleration,
        q,
        qd,
        qdd,
        foot_force,
        torque,
        force,
        moment,
    )
