"""Mass matrix and momentum of the whole robot.

The 6 + 3 L generalised speeds of a robot with L legs are (v, w, q'): velocity of the body frame's
origin and angular velocity of the trunk, both in world axes, then the joint speeds leg by leg. Both
follow from `inverse_dynamics`, which is linear in accelerations.
"""

from __future__ import annotations

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


def _generalised(force: JointTorqueAndWrench) -> Float[np.ndarray, "*batch dof"]:
    """Return wrench and joint torques as one vector."""
    torque, wrench = force
    joints = torque.reshape(*torque.shape[:-2], -1)
    batch = np.broadcast_shapes(joints.shape[:-1], wrench.shape[:-1])
    parts = (np.broadcast_to(part, (*batch, part.shape[-1])) for part in (wrench, joints))
    return np.concatenate(list(parts), axis=-1)
