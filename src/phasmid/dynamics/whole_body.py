"""Inverse dynamics and energies of the whole robot, for one sample or millions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.arguments import explained
from phasmid.dynamics.body_motion import BodyMotion
from phasmid.dynamics.matrices import link_moments, moments_about_origin
from phasmid.kinematics import centre_of_mass, link_frames
from phasmid.kinematics.leg import geometry
from phasmid.robot import Robot


class JointTorqueAndWrench(NamedTuple):
    """Joint torques and wrench on the trunk that a motion requires.

    Attributes:
        joint_torque: Torques of coxa, femur and tibia [N·m], shape (..., L, 3).
        wrench: Force [N] and moment [N·m] on the trunk in world axes, the moment about the
            body frame's origin, shape (..., 6).
    """

    joint_torque: Float[np.ndarray, "*batch legs 3"]
    wrench: Float[np.ndarray, "*batch 6"]


@explained
def inverse_dynamics(
    robot: Robot,
    body: BodyMotion,
    q: Float[np.ndarray, "*#batch legs 3"],
    qd: Float[np.ndarray, "*#batch legs 3"],
    qdd: Float[np.ndarray, "*#batch legs 3"],
    *,
    foot_force: Float[np.ndarray, "*#batch legs 3"] | None = None,
    gravity: float,
) -> JointTorqueAndWrench:
    """Joint torques and wrench on the trunk for a motion of trunk and legs.

    Args:
        robot: The robot, L legs.
        body: Pose and motion of the trunk; its leading axes broadcast against those of q.
        q: Joint angles [rad], shape (..., L, 3).
        qd: Joint speeds [rad/s], shape (..., L, 3).
        qdd: Joint accelerations [rad/s²], shape (..., L, 3).
        foot_force: Force of the ground on each foot in world axes [N], shape (..., L, 3);
            none by default.
        gravity: Acceleration of free fall, downwards along the world's z [m/s²].

    Returns:
        Joint torques, and the wrench on the trunk besides the foot forces. Without foot forces
        it is the wrench that all feet together must give.

    Source: the recursive Newton-Euler algorithm (Luh, Walker, Paul 1980) on a moving base;
    gravity enters as an acceleration of the base upwards. For one leg on a base at rest it
    equals Eq. 11, corrected.
    """
    from phasmid.dynamics.whole_body_kernels import inverse_dynamics_ufunc

    # Gravity acts as if everything accelerated upwards.
    free_fall = body.acceleration + np.array([0.0, 0.0, gravity])
    trunk = np.array(robot.body.mass)
    torque, force, moment = inverse_dynamics_ufunc(
        *geometry(robot.arrays),
        *link_moments(robot.arrays),
        robot.arrays.R_body_hip,
        robot.arrays.p_body_hip,
        trunk,
        *moments_about_origin(trunk, robot.body.com, robot.body.inertia),
        body.rotation,
        body.angular_velocity,
        body.angular_acceleration,
        free_fall,
        q,
        qd,
        qdd,
        np.zeros((len(robot.legs), 3)) if foot_force is None else foot_force,
    )
    return JointTorqueAndWrench(torque, np.concatenate([force, moment], axis=-1))


@explained
def kinetic_energy(
    robot: Robot,
    body: BodyMotion,
    q: Float[np.ndarray, "*#batch legs 3"],
    qd: Float[np.ndarray, "*#batch legs 3"],
) -> Float[np.ndarray, "*batch"]:
    """Kinetic energy of trunk and legs; arguments as of `inverse_dynamics`.

    Returns:
        Energy [J], shape (...).
    """
    arrays, (R, p) = robot.arrays, link_frames(robot, q)
    R_body_world = np.swapaxes(body.rotation, -1, -2)
    w, v = (_apply(R_body_world, each) for each in (body.angular_velocity, body.velocity))
    # Each link turns as the one before it and about its own axis, which is its z.
    own = R[..., :, 2] * qd[..., None]
    w_link = w[..., None, None, :] + np.cumsum(own, axis=-2)
    steps = np.cross(w_link - own, np.diff(p, axis=-2, prepend=0.0))
    velocity = v[..., None, None, :] + np.cumsum(steps, axis=-2)
    velocity = velocity + np.cross(w_link, _apply(R, arrays.com))
    w_link = _apply(np.swapaxes(R, -1, -2), w_link)
    legs = _rigid_energy(arrays.mass, arrays.inertia, velocity, w_link).sum(axis=(-2, -1))
    trunk = robot.body
    v = v + np.cross(w, trunk.com)
    return np.asarray(_rigid_energy(np.array(trunk.mass), trunk.inertia, v, w) + legs)


def _apply(matrix: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.asarray((matrix @ v[..., None])[..., 0])


def _rigid_energy(
    mass: np.ndarray, inertia: np.ndarray, velocity: np.ndarray, w: np.ndarray
) -> np.ndarray:
    """Return the kinetic energy of rigid bodies from the velocities of their centres of mass."""
    linear = mass * np.sum(velocity**2, axis=-1)
    return np.asarray((linear + np.sum(w * _apply(inertia, w), axis=-1)) / 2)


@explained
def potential_energy(
    robot: Robot,
    body: BodyMotion,
    q: Float[np.ndarray, "*#batch legs 3"],
    *,
    gravity: float,
) -> Float[np.ndarray, "*batch"]:
    """Potential energy of trunk and legs, zero at the world's z = 0; arguments as above.

    Returns:
        Energy [J], shape (...).
    """
    lift = np.sum(body.rotation[..., 2, :] * centre_of_mass(robot, q), axis=-1)
    return np.asarray(robot.mass * gravity * (body.position[..., 2] + lift))
