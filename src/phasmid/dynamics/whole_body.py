"""Inverse dynamics and energies of the whole robot, for all times and legs at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.arguments import check_type
from phasmid.dynamics.body_motion import BodyMotion
from phasmid.dynamics.components import apply, carried, components, cross
from phasmid.dynamics.recursion import (
    Moments,
    energy_of,
    leg_energies,
    leg_needs,
    link_moments,
    newton_euler,
    trunk_moments,
)
from phasmid.kinematics import centre_of_mass
from phasmid.kinematics.arguments import check_robot, lead, number, numbers, shared_axes
from phasmid.robot import Robot
from phasmid.units import STANDARD_GRAVITY


class JointTorqueAndWrench(NamedTuple):
    """What a motion needs.

    Attributes:
        joint_torque: Torques of coxa, femur and tibia [N·m], shape (..., L, 3).
        wrench: Force [N] and moment [N·m] on the trunk in world axes, the moment about the
            body frame's origin, shape (..., 6).
    """

    joint_torque: Float[np.ndarray, "*batch legs 3"]
    wrench: Float[np.ndarray, "*batch 6"]


def inverse_dynamics(
    robot: Robot,
    body: BodyMotion,
    q: Float[np.ndarray, "*#batch legs 3"],
    qd: Float[np.ndarray, "*#batch legs 3"],
    qdd: Float[np.ndarray, "*#batch legs 3"],
    *,
    foot_force: Float[np.ndarray, "*#batch legs 3"] | None = None,
    gravity: float = STANDARD_GRAVITY,
) -> JointTorqueAndWrench:
    """Joint torques, and what must hold the trunk, for a given motion of trunk and legs.

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
        Joint torques, and the wrench that something must exert on the trunk besides the given
        foot forces. Without foot forces it is what all feet together have to give.

    Raises:
        InvalidInput: It is no robot or no motion of a trunk, an array does not fit, or gravity is
            no finite number.

    Source: the recursive Newton-Euler algorithm (Luh, Walker, Paul 1980) on a moving base;
    gravity enters as an acceleration of the base upwards. For one leg on a base at rest it
    equals Eq. 11, corrected.
    """
    loads = {} if foot_force is None else {"foot_force": foot_force}
    batch, (q, qd, qdd, *force) = joint_arrays(robot, body, q=q, qd=qd, qdd=qdd, **loads)
    gravity = number("gravity", gravity)
    forces = force[0] if force else np.zeros((len(robot.legs), 3))
    legs = (*batch, len(robot.legs))
    R_world_body = components(body.rotation, 2, batch)
    # Gravity acts as if everything accelerated upwards.
    felt = body.acceleration + np.array([0.0, 0.0, gravity])
    motion, needs = trunk_share(
        trunk_moments(robot),
        R_world_body,
        components(body.angular_velocity, 1, batch),
        components(body.angular_acceleration, 1, batch),
        components(felt, 1, batch),
    )
    torque, *from_legs = leg_share(
        Mount(components(robot.arrays.R_body_hip, 2), components(robot.arrays.p_body_hip)),
        components(robot.arrays.lengths),
        link_moments(robot),
        R_world_body[..., None],
        *(v[..., None] for v in motion),
        *(components(v, 1, legs) for v in (forces, q, qd, qdd)),
    )
    total = (ours + theirs.sum(axis=-1) for ours, theirs in zip(needs, from_legs, strict=True))
    wrench = [entry for v in total for entry in apply(R_world_body, v)]
    return JointTorqueAndWrench(np.stack(torque, axis=-1), np.stack(wrench, axis=-1))


class Mount(NamedTuple):
    """Where legs sit on the trunk: rotation (3, 3, L) and position (3, L) of the hip frames."""

    R_body_hip: np.ndarray
    p_body_hip: np.ndarray


def trunk_share(
    trunk: Moments, R_world_body: np.ndarray, w: np.ndarray, dw: np.ndarray, felt: np.ndarray
) -> tuple[tuple[np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """The trunk's motion (w, dw, a), and force and moment for itself, in body axes.

    Vectors come in world axes; ``felt`` is the acceleration of the origin minus gravity's.
    """
    R_body_world = np.swapaxes(R_world_body, 0, 1)
    w, dw, a = (apply(R_body_world, v) for v in (w, dw, felt))
    return (w, dw, a), newton_euler(*trunk, w, dw, a)


def leg_share(
    mount: Mount,
    lengths: np.ndarray,
    links: Sequence[Moments],
    R_world_body: np.ndarray,
    w: np.ndarray,
    dw: np.ndarray,
    a: np.ndarray,
    foot_force: np.ndarray,
    q: np.ndarray,
    qd: np.ndarray,
    qdd: np.ndarray,
) -> tuple[list[np.ndarray], np.ndarray, np.ndarray]:
    """Joint torques, and force and moment that legs need from the trunk, in body axes.

    The trunk's motion w, dw, a comes in body axes, the force on the foot in world axes.
    """
    R_body_hip, p_body_hip = mount
    R_hip_body = np.swapaxes(R_body_hip, 0, 1)
    foot = apply(np.swapaxes(R_world_body, 0, 1), foot_force)
    a = a + carried(p_body_hip, w, dw)
    w, dw, a, foot = (apply(R_hip_body, v) for v in (w, dw, a, foot))
    torque, force, moment = leg_needs(lengths, links, w, dw, a, foot, q, qd, qdd)
    force, moment = apply(R_body_hip, force), apply(R_body_hip, moment)
    return torque, force, moment + cross(p_body_hip, force)


def kinetic_energy(
    robot: Robot,
    body: BodyMotion,
    q: Float[np.ndarray, "*#batch legs 3"],
    qd: Float[np.ndarray, "*#batch legs 3"],
) -> Float[np.ndarray, "*batch"]:
    """Kinetic energy of trunk and legs.

    Args:
        robot: The robot, L legs.
        body: Pose and motion of the trunk.
        q: Joint angles [rad], shape (..., L, 3).
        qd: Joint speeds [rad/s], shape (..., L, 3).

    Returns:
        Energy [J], shape (...).

    Raises:
        InvalidInput: It is no robot or no motion of a trunk, or an array does not fit.
    """
    batch, (q, qd) = joint_arrays(robot, body, q=q, qd=qd)
    legs = (*batch, len(robot.legs))
    R_body_world = np.swapaxes(components(body.rotation, 2, batch), 0, 1)
    R_hip_body = np.swapaxes(components(robot.arrays.R_body_hip, 2), 0, 1)
    w = apply(R_body_world, components(body.angular_velocity, 1, batch))
    v = apply(R_body_world, components(body.velocity, 1, batch))
    energy = energy_of(*trunk_moments(robot), w, v)

    w, v = w[..., None], v[..., None]
    v = apply(R_hip_body, v + cross(w, components(robot.arrays.p_body_hip)))
    w = apply(R_hip_body, w)
    angles, speeds = components(q, 1, legs), components(qd, 1, legs)
    return np.asarray(energy + leg_energies(robot, w, v, angles, speeds).sum(axis=-1))


def potential_energy(
    robot: Robot,
    body: BodyMotion,
    q: Float[np.ndarray, "*#batch legs 3"],
    *,
    gravity: float = STANDARD_GRAVITY,
) -> Float[np.ndarray, "*batch"]:
    """Potential energy of trunk and legs, zero at the world's z = 0.

    Args:
        robot: The robot, L legs.
        body: Pose of the trunk.
        q: Joint angles [rad], shape (..., L, 3).
        gravity: Acceleration of free fall, downwards along the world's z [m/s²].

    Returns:
        Energy [J], shape (...).

    Raises:
        InvalidInput: It is no robot or no motion of a trunk, the angles do not fit, or gravity is
            no finite number.
    """
    _, (q,) = joint_arrays(robot, body, q=q)
    gravity = number("gravity", gravity)
    lift = np.sum(body.rotation[..., 2, :] * centre_of_mass(robot, q), axis=-1)
    return np.asarray(robot.mass * gravity * (body.position[..., 2] + lift))


def joint_arrays(
    robot: Robot, body: BodyMotion, **arrays: object
) -> tuple[tuple[int, ...], list[np.ndarray]]:
    """The leading axes that trunk and legs share, and the legs' arrays as floats.

    Raises:
        InvalidInput: It is no robot or no motion of a trunk, or an array does not fit.
    """
    check_robot(robot)
    check_type("body", body, (BodyMotion,), "a BodyMotion", "dynamics.BodyMotion.at_rest()")
    given = numbers(**arrays)
    tail = (len(robot.legs), 3)
    leads = {name: lead(name, array, tail) for name, array in given.items()}
    return shared_axes({"body": body.position.shape[:-1], **leads}), list(given.values())
