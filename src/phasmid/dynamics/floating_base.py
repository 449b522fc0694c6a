"""The whole robot's equation of motion in matrix form: mass matrix, bias, momentum, Jacobians.

The 6 + 3 L generalised speeds of a robot with L legs are (v, w, q'): velocity of the body frame's
origin and angular velocity of the trunk, both in world axes, then the joint speeds leg by leg.
Generalised forces are force and moment on the trunk about that origin in world axes [N, N·m], then
joint torques [N·m]. All follow from `inverse_dynamics`, linear in accelerations and forces.

Accelerations of the trunk do not count.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.arguments import explained
from phasmid.dynamics.body_motion import BodyMotion
from phasmid.dynamics.whole_body import JointTorqueAndWrench, inverse_dynamics
from phasmid.kinematics import centre_of_mass
from phasmid.robot import Robot


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


@explained
def mass_matrix(
    robot: Robot, body: BodyMotion, q: Float[np.ndarray, "*#batch legs 3"]
) -> Float[np.ndarray, "*batch dof dof"]:
    """Mass matrix of the robot on its floating base; arguments as of `inverse_dynamics`.

    Returns:
        The matrix M of the kinetic energy, half the form (v, w, q') M (v, w, q') [kg, kg·m,
        kg·m²], shape (..., 6 + 3 L, 6 + 3 L).

    Source: column j is the force of a unit acceleration j, without velocity and gravity (Walker
    and Orin 1982, method 1).
    """
    legs = len(robot.legs)
    unit, zero = np.eye(6 + 3 * legs), np.zeros(3)
    R_world_body = np.asarray(body.rotation)[..., None, :, :]
    accelerated = BodyMotion(zero, R_world_body, zero, zero, unit[:, :3], unit[:, 3:6])
    joints = q[..., None, :, :], np.zeros((legs, 3)), unit[:, 6:].reshape(-1, legs, 3)
    columns = _generalised(inverse_dynamics(robot, accelerated, *joints, gravity=0.0))
    return np.swapaxes(columns, -1, -2)


@explained
def bias_force(
    robot: Robot,
    body: BodyMotion,
    q: Float[np.ndarray, "*#batch legs 3"],
    qd: Float[np.ndarray, "*#batch legs 3"],
    *,
    gravity: float,
) -> Float[np.ndarray, "*batch dof"]:
    """Generalised forces of velocities and gravity: h in M a + h = force; arguments as above.

    Returns:
        Force [N] and moment [N·m] on the trunk, then joint torques [N·m], shape (..., 6 + 3 L).
    """
    qdd = np.zeros((len(robot.legs), 3))
    return _generalised(inverse_dynamics(robot, _coasting(body), q, qd, qdd, gravity=gravity))


@explained
def gravity_force(
    robot: Robot,
    body: BodyMotion,
    q: Float[np.ndarray, "*#batch legs 3"],
    *,
    gravity: float,
) -> Float[np.ndarray, "*batch dof"]:
    """Gravity term g(q): generalised forces that balance gravity at rest.

    It is the gradient of `potential_energy`. Arguments as of `inverse_dynamics`.

    Returns:
        Force [N] and moment [N·m] on the trunk, then joint torques [N·m], shape (..., 6 + 3 L).
    """
    at_rest = BodyMotion.at_rest(body.position, body.rotation)
    return bias_force(robot, at_rest, q, np.zeros((len(robot.legs), 3)), gravity=gravity)


@explained
def momentum(
    robot: Robot,
    body: BodyMotion,
    q: Float[np.ndarray, "*#batch legs 3"],
    qd: Float[np.ndarray, "*#batch legs 3"],
) -> Momentum:
    """Momentum of the robot; arguments as of `inverse_dynamics`."""
    # The impulse that sets the robot in motion: the force of accelerations equal to the velocities.
    zero = np.zeros(3)
    started = BodyMotion(
        zero,
        body.rotation,
        zero,
        zero,
        acceleration=body.velocity,
        angular_acceleration=body.angular_velocity,
    )
    impulse = inverse_dynamics(robot, started, q, np.zeros_like(q), qd, gravity=0.0).wrench
    linear, about_origin = impulse[..., :3], impulse[..., 3:]
    com = (body.rotation @ centre_of_mass(robot, q)[..., None])[..., 0]
    return Momentum(linear, about_origin - np.cross(com, linear))


@explained
def foot_jacobian(
    robot: Robot, body: BodyMotion, q: Float[np.ndarray, "*#batch legs 3"]
) -> Float[np.ndarray, "*batch legs 3 dof"]:
    """Jacobians of the feet in the world; arguments as of `inverse_dynamics`.

    Returns:
        Velocities of each foot for unit generalised speeds, shape (..., L, 3, 6 + 3 L). The
        transpose times a force on the foot in world axes is its share of the generalised forces.
    """
    # A unit force on a foot is balanced by minus its row of the Jacobian.
    legs = len(robot.legs)
    still, force = np.zeros((legs, 3)), np.eye(3 * legs).reshape(-1, legs, 3)
    body = BodyMotion.at_rest(rotation=np.asarray(body.rotation)[..., None, :, :])
    joints = q[..., None, :, :], still, still
    rows = -_generalised(inverse_dynamics(robot, body, *joints, foot_force=force, gravity=0.0))
    return rows.reshape(*rows.shape[:-2], legs, 3, -1)


@explained
def forward_dynamics(
    robot: Robot,
    body: BodyMotion,
    q: Float[np.ndarray, "*#batch legs 3"],
    qd: Float[np.ndarray, "*#batch legs 3"],
    torque: Float[np.ndarray, "*#batch legs 3"],
    *,
    foot_force: Float[np.ndarray, "*#batch legs 3"] | None = None,
    gravity: float,
) -> Accelerations:
    """Accelerations by joint torques and foot forces; arguments as of `inverse_dynamics`."""
    qdd = np.zeros((len(robot.legs), 3))
    h = inverse_dynamics(robot, _coasting(body), q, qd, qdd, foot_force=foot_force, gravity=gravity)
    unbalanced = _generalised(JointTorqueAndWrench(torque - h.joint_torque, -h.wrench))
    a = np.linalg.solve(mass_matrix(robot, body, q), unbalanced[..., None])[..., 0]
    return Accelerations(a[..., :3], a[..., 3:6], a[..., 6:].reshape(*a.shape[:-1], -1, 3))


def _generalised(force: JointTorqueAndWrench) -> Float[np.ndarray, "*batch dof"]:
    """Return wrench and joint torques as one vector."""
    torque, wrench = force
    joints = torque.reshape(*torque.shape[:-2], -1)
    batch = np.broadcast_shapes(joints.shape[:-1], wrench.shape[:-1])
    parts = (np.broadcast_to(part, (*batch, part.shape[-1])) for part in (wrench, joints))
    return np.concatenate(list(parts), axis=-1)


def _coasting(body: BodyMotion) -> BodyMotion:
    """Return the same pose and velocity without acceleration."""
    return replace(body, acceleration=np.zeros(3), angular_acceleration=np.zeros(3))
