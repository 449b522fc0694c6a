"""The whole robot's equation of motion in matrix form: mass matrix, bias, momentum, Jacobians.

The 6 + 3 L generalised speeds of a robot with L legs are (v, w, q'): velocity of the body frame's
origin and angular velocity of the trunk, both in world axes, then the joint speeds leg by leg.
Generalised forces are force and moment on the trunk about that origin in world axes [N, N·m], then
joint torques [N·m].

Accelerations of the trunk do not count.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.dynamics.body_motion import BodyMotion
from phasmid.dynamics.matrices import moments_about_origin
from phasmid.dynamics.whole_body import inverse_dynamics, joint_arrays
from phasmid.kinematics import body_from_hip, foot_position, jacobian, link_frames
from phasmid.robot import Robot
from phasmid.units import STANDARD_GRAVITY


class Momentum(NamedTuple):
    """Momentum of the whole robot.

    Attributes:
        linear: Mass times velocity of the centre of mass, world axes [kg·m/s], shape (..., 3).
        angular: About the centre of mass, world axes [kg·m²/s], shape (..., 3).
    """

    linear: Float[np.ndarray, "*batch 3"]
    angular: Float[np.ndarray, "*batch 3"]


class Accelerations(NamedTuple):
    """Accelerations of trunk and joints.

    Attributes:
        acceleration: Of the body frame's origin, world axes [m/s²], shape (..., 3).
        angular_acceleration: Of the trunk, world axes [rad/s²], shape (..., 3).
        qdd: Of the joints [rad/s²], shape (..., L, 3).
    """

    acceleration: Float[np.ndarray, "*batch 3"]
    angular_acceleration: Float[np.ndarray, "*batch 3"]
    qdd: Float[np.ndarray, "*batch legs 3"]


def mass_matrix(
    robot: Robot, body: BodyMotion, q: Float[np.ndarray, "*#batch legs 3"]
) -> Float[np.ndarray, "*batch dof dof"]:
    """Mass matrix of the robot on its floating base; arguments as of `inverse_dynamics`.

    Returns:
        The matrix M of the kinetic energy, half the form (v, w, q') M (v, w, q') [kg, kg·m,
        kg·m²], shape (..., 6 + 3 L, 6 + 3 L).

    Source: composite rigid bodies (Walker and Orin 1982), in body axes about the body's origin.
    """
    batch, (q,) = joint_arrays(robot, body, q=q)
    count = len(robot.legs)
    frames = link_frames(robot, q)
    axis, at = frames.rotation[..., :, 2], frames.position
    # A joint moves the body's origin, taken as a point of the link, by p x axis.
    slide = np.cross(at, axis)
    mass, first, second = _composites(robot, q)

    trunk_first, trunk_second = moments_about_origin(
        np.array(robot.body.mass), robot.body.com, robot.body.inertia
    )
    M = np.zeros((*q.shape[:-2], 6 + 3 * count, 6 + 3 * count))
    whole = trunk_first + first[..., 0, :].sum(axis=-2)
    M[..., :3, :3] = robot.mass * np.eye(3)
    M[..., 3:6, :3] = _skew(whole)
    M[..., :3, 3:6] = -M[..., 3:6, :3]
    M[..., 3:6, 3:6] = trunk_second + second[..., 0, :, :].sum(axis=-3)

    # Momentum of everything beyond each joint while that joint alone turns at unit speed.
    linear = mass[..., None] * slide + np.cross(axis, first)
    angular = np.cross(first, slide) + (second @ axis[..., None])[..., 0]
    joints = np.concatenate([linear, angular], axis=-1).reshape(*q.shape[:-2], 3 * count, 6)
    M[..., :6, 6:] = np.swapaxes(joints, -1, -2)
    M[..., 6:, :6] = joints
    within = np.einsum("...ja,...ka->...jk", slide, linear)
    within += np.einsum("...ja,...ka->...jk", axis, angular)
    # Of two joints of a leg the outer one's composite counts.
    upper = np.triu(within)
    within = upper + np.swapaxes(np.triu(within, 1), -1, -2)
    for i in range(count):
        rows = slice(6 + 3 * i, 9 + 3 * i)
        M[..., rows, rows] = within[..., i, :, :]
    return _into_world(np.broadcast_to(M, (*batch, *M.shape[-2:])).copy(), body.rotation)


def bias_force(
    robot: Robot,
    body: BodyMotion,
    q: Float[np.ndarray, "*#batch legs 3"],
    qd: Float[np.ndarray, "*#batch legs 3"],
    *,
    gravity: float = STANDARD_GRAVITY,
) -> Float[np.ndarray, "*batch dof"]:
    """Generalised forces of velocities and gravity: h in M a + h = force; arguments as above.

    Returns:
        Force [N] and moment [N·m] on the trunk, then joint torques [N·m], shape (..., 6 + 3 L).
    """
    still = np.zeros((len(robot.legs), 3))
    torque, wrench = inverse_dynamics(robot, _coasting(body), q, qd, still, gravity=gravity)
    return np.concatenate([wrench, torque.reshape(*torque.shape[:-2], -1)], axis=-1)


def gravity_force(
    robot: Robot,
    body: BodyMotion,
    q: Float[np.ndarray, "*#batch legs 3"],
    *,
    gravity: float = STANDARD_GRAVITY,
) -> Float[np.ndarray, "*batch dof"]:
    """Generalised forces that hold the robot still; arguments as of `inverse_dynamics`.

    Returns:
        Force [N] and moment [N·m] on the trunk, then joint torques [N·m], shape (..., 6 + 3 L).
        It is the gradient of `potential_energy`.
    """
    still = BodyMotion.at_rest(body.position, body.rotation)
    return bias_force(robot, still, q, np.zeros((len(robot.legs), 3)), gravity=gravity)


def momentum(
    robot: Robot,
    body: BodyMotion,
    q: Float[np.ndarray, "*#batch legs 3"],
    qd: Float[np.ndarray, "*#batch legs 3"],
) -> Momentum:
    """Momentum of the robot; arguments as of `inverse_dynamics`."""
    batch, (q, qd) = joint_arrays(robot, body, q=q, qd=qd)
    M = mass_matrix(robot, body, q)
    flat = np.broadcast_to(qd, (*batch, len(robot.legs), 3)).reshape(*batch, -1)
    twist = (np.broadcast_to(v, (*batch, 3)) for v in (body.velocity, body.angular_velocity))
    speeds = np.concatenate([*twist, flat], axis=-1)
    about_origin = (M[..., :6, :] @ speeds[..., None])[..., 0]
    linear, angular = about_origin[..., :3], about_origin[..., 3:]
    # Rows 3 to 5 against columns 0 to 2 hold mass times the cross matrix of the centre of mass.
    c = np.stack([M[..., 5, 1], M[..., 3, 2], M[..., 4, 0]], axis=-1) / robot.mass
    return Momentum(linear, angular - np.cross(c, linear))


def foot_jacobian(
    robot: Robot, body: BodyMotion, q: Float[np.ndarray, "*#batch legs 3"]
) -> Float[np.ndarray, "*batch legs 3 dof"]:
    """Jacobians of the feet in the world; arguments as of `inverse_dynamics`.

    Returns:
        Velocities of each foot for unit generalised speeds, shape (..., L, 3, 6 + 3 L). The
        transpose times a force on the foot in world axes is its share of the generalised forces.
    """
    batch, (q,) = joint_arrays(robot, body, q=q)
    count = len(robot.legs)
    R = body.rotation[..., None, :, :]
    arm = (R @ body_from_hip(robot, foot_position(robot.arrays, q))[..., None])[..., 0]
    own = R @ robot.arrays.R_body_hip @ jacobian(robot.arrays, q)
    J = np.zeros((*batch, count, 3, 6 + 3 * count))
    J[..., :3] = np.eye(3)
    J[..., 3:6] = -_skew(arm)
    for i in range(count):
        J[..., i, :, 6 + 3 * i : 9 + 3 * i] = own[..., i, :, :]
    return J


def forward_dynamics(
    robot: Robot,
    body: BodyMotion,
    q: Float[np.ndarray, "*#batch legs 3"],
    qd: Float[np.ndarray, "*#batch legs 3"],
    torque: Float[np.ndarray, "*#batch legs 3"],
    *,
    foot_force: Float[np.ndarray, "*#batch legs 3"] | None = None,
    gravity: float = STANDARD_GRAVITY,
) -> Accelerations:
    """Accelerations by joint torques and foot forces; arguments as of `inverse_dynamics`."""
    still = np.zeros((len(robot.legs), 3))
    force = still if foot_force is None else foot_force
    batch, (q, qd, torque, force) = joint_arrays(
        robot, body, q=q, qd=qd, torque=torque, foot_force=force
    )
    h = inverse_dynamics(robot, _coasting(body), q, qd, still, foot_force=force, gravity=gravity)
    wrench = np.broadcast_to(-h.wrench, (*batch, 6))
    joints = np.broadcast_to(torque - h.joint_torque, (*batch, *still.shape)).reshape(*batch, -1)
    unbalanced = np.concatenate([wrench, joints], axis=-1)
    a = np.linalg.solve(mass_matrix(robot, body, q), unbalanced[..., None])[..., 0]
    return Accelerations(a[..., :3], a[..., 3:6], a[..., 6:].reshape(*batch, -1, 3))


def _composites(robot: Robot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return mass, first and second moments of each link with all links beyond it.

    In body axes about the body's origin; shapes (L, 3), (..., L, 3, 3), (..., L, 3, 3, 3).
    """
    arrays = robot.arrays
    frames = link_frames(robot, q)
    com = frames.position + (frames.rotation @ arrays.com[..., None])[..., 0]
    inertia = frames.rotation @ arrays.inertia @ np.swapaxes(frames.rotation, -1, -2)
    first, second = moments_about_origin(np.broadcast_to(arrays.mass, com.shape[:-1]), com, inertia)

    def from_the_foot(values: np.ndarray, axis: int) -> np.ndarray:
        return np.flip(np.cumsum(np.flip(values, axis), axis), axis)

    return from_the_foot(arrays.mass, -1), from_the_foot(first, -2), from_the_foot(second, -3)


def _coasting(body: BodyMotion) -> BodyMotion:
    """Return the same pose and velocity without acceleration."""
    return replace(body, acceleration=np.zeros(3), angular_acceleration=np.zeros(3))


def _into_world(M: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Rotate the first six rows and columns from body axes to world axes."""
    for part in (slice(0, 3), slice(3, 6)):
        M[..., part, :] = rotation @ M[..., part, :]
        M[..., :, part] = M[..., :, part] @ np.swapaxes(rotation, -1, -2)
    return M


def _skew(v: np.ndarray) -> np.ndarray:
    """Return the matrix of the vector product with v from the left, shape (..., 3, 3)."""
    x, y, z = np.moveaxis(v, -1, 0)
    matrix = np.zeros((*x.shape, 3, 3))
    matrix[..., 0, 1], matrix[..., 0, 2] = -z, y
    matrix[..., 1, 0], matrix[..., 1, 2] = z, -x
    matrix[..., 2, 0], matrix[..., 2, 1] = -y, x
    return matrix
