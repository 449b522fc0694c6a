"""What holds a robot at rest, on those of its feet that stand."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from phasmid.forces.analysis import chosen_model
from phasmid.forces.contacts import Contacts, JointLoad
from phasmid.forces.sharing import share_load
from phasmid.kinematics import jacobian, link_frames
from phasmid.robot import Robot
from phasmid.scenario import Scenario
from phasmid.terrain import Ground


class Held(NamedTuple):
    """What holds a robot.

    Attributes:
        force: Of the ground on the feet, world axes [N], shape (L, 3).
        torque: Of the joints [N·m], shape (L, 3).
    """

    force: Float[np.ndarray, "legs 3"]
    torque: Float[np.ndarray, "legs 3"]


def holding_forces(
    scenario: Scenario,
    robot: Robot,
    position: Float[np.ndarray, "3"],
    rotation: Float[np.ndarray, "3 3"],
    q: Float[np.ndarray, "legs 3"],
    feet: Float[np.ndarray, "legs 3"],
    stance: Bool[np.ndarray, " legs"],
    ground: Ground,
) -> Held:
    """Foot forces and joint torques of a robot that rests in a pose.

    Args:
        scenario: Its gravity, its force model and that model's options.
        robot: The robot, L legs.
        position: Of the trunk in the world [m], shape (3,).
        rotation: ``R_world_body``, shape (3, 3).
        q: Joint angles [rad], shape (L, 3).
        feet: In the world [m], shape (L, 3).
        stance: Which feet stand, shape (L,).
        ground: Under the feet.

    Raises:
        InvalidInput: Torque limits shall count for a force model that knows none.
        InfeasibleLoad: The standing feet cannot hold the robot within the model's limits.
    """
    free, wrench = _weight(robot, rotation, q, scenario.model.gravity)
    x, y = feet[:, 0], feet[:, 1]
    counted = scenario.model.torque_limits == "counted"
    joints = JointLoad(
        jacobian=rotation @ robot.arrays.R_body_hip @ jacobian(robot.arrays, q),
        torque=free,
        limit=robot.servo.stall_torque if counted else np.inf,
    )
    contacts = Contacts(
        feet=feet - position,
        share=stance,
        normals=ground.normal(x, y),
        friction=ground.friction(x, y),
        leg_names=robot.leg_names,
    )
    force = share_load(contacts, wrench, chosen_model(scenario), joints=joints)
    return Held(force, joints.with_ground(force))


def _weight(
    robot: Robot, rotation: np.ndarray, q: np.ndarray, gravity: float
) -> tuple[np.ndarray, np.ndarray]:
    """What bears all links and the trunk: joint torques, and force and moment about the trunk.

    It is `inverse_dynamics` of a robot at rest, without what a motion takes besides.
    """
    frames, arrays = link_frames(robot, q), robot.arrays
    centre = frames.position + (frames.rotation @ arrays.com[..., None])[..., 0]
    # Of each link with all links beyond it.
    mass = np.cumsum(arrays.mass[:, ::-1], axis=1)[:, ::-1, None]
    moment = np.cumsum((arrays.mass[..., None] * centre)[:, ::-1], axis=1)[:, ::-1]
    lift = gravity * rotation[2]
    axis = frames.rotation[..., :, 2]
    torque = np.sum(axis * np.cross(moment - mass * frames.position, lift), axis=-1)
    force = np.array([0.0, 0.0, gravity * robot.mass])
    first = robot.body.mass * robot.body.com + moment[:, 0].sum(axis=0)
    return torque, np.concatenate([force, np.cross(rotation @ first, [0.0, 0.0, gravity])])
