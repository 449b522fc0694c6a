"""Robot parameters and state of the feed-forward stage, as records for compiled functions.

See `phasmid.control.types` for how classes become records.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.control.feed_forward.settings import FeedForwardSettings
from phasmid.control.records import record_of
from phasmid.dynamics.inertia import moments_about_origin
from phasmid.dynamics.matrices import link_moments
from phasmid.kinematics.arguments import geometry
from phasmid.robot import Robot
from phasmid.units import STANDARD_GRAVITY


@dataclass(eq=False)
class Parameters:
    """Masses of a robot with L legs, limits of its servos, and how feet share the load.

    Attributes:
        lengths: Link lengths, and the foot's offset to the left of the leg's plane [m],
            shape (L, 4).
        link_mass: Masses of the links [kg], shape (L, 3).
        link_moment: First moments of mass about the links' origins [kg·m], shape (L, 3, 3).
        link_inertia: Inertias about these origins [kg·m²], shape (L, 3, 3, 3).
        R_body_hip: Rotations of the hips, shape (L, 3, 3).
        p_body_hip: Hips [m], shape (L, 3).
        trunk_mass: Mass of the trunk [kg].
        trunk_moment: First moment of mass about the body's origin [kg·m], shape (3,).
        trunk_inertia: Inertia about the body's origin [kg·m²], shape (3, 3).
        armature: Inertia of each joint's rotor, seen at the joint [kg·m²].
        gravity: Acceleration of free fall [m/s²].
        stall_torque: Torque of a servo at rest that may be used [N·m].
        torque_drop: Loss of that torque per joint speed [N·m·s/rad].
        friction: Coefficient of friction that foot forces may use.
        cost: `MINIMUM_NORM`, `WEIGHTED` or `MINIMUM_TORQUE`.
        cost_option: Tangential weight, or lever [m], of that cost.
        load_transfer: Time in which a foot takes on or gives up its load [s].
        update_period: Time from one update to the next [s].
        leg_count: Number of legs.
    """

    lengths: Float[np.ndarray, "legs 4"]
    link_mass: Float[np.ndarray, "legs 3"]
    link_moment: Float[np.ndarray, "legs 3 3"]
    link_inertia: Float[np.ndarray, "legs 3 3 3"]
    R_body_hip: Float[np.ndarray, "legs 3 3"]
    p_body_hip: Float[np.ndarray, "legs 3"]
    trunk_mass: float
    trunk_moment: Float[np.ndarray, "3"]
    trunk_inertia: Float[np.ndarray, "3 3"]
    armature: float
    gravity: float
    stall_torque: float
    torque_drop: float
    friction: float
    cost: int
    cost_option: float
    load_transfer: float
    update_period: float
    leg_count: int


@dataclass(eq=False)
class Motion:
    """Motion of the robot at one instant, in world axes; L legs.

    Attributes:
        R_world_body: Rotation of the trunk, shape (3, 3).
        angular_velocity: Of the trunk [rad/s], shape (3,).
        angular_acceleration: Of the trunk [rad/s²], shape (3,).
        acceleration: Of the body's origin, without gravity [m/s²], shape (3,).
        q: Joint angles [rad], shape (L, 3).
        qd: Joint speeds [rad/s], shape (L, 3).
        qdd: Joint accelerations [rad/s²], shape (L, 3).
    """

    R_world_body: Float[np.ndarray, "3 3"]
    angular_velocity: Float[np.ndarray, "3"]
    angular_acceleration: Float[np.ndarray, "3"]
    acceleration: Float[np.ndarray, "3"]
    q: Float[np.ndarray, "legs 3"]
    qd: Float[np.ndarray, "legs 3"]
    qdd: Float[np.ndarray, "legs 3"]


@dataclass(eq=False)
class InverseDynamics:
    """Forces that a motion requires at one instant, without the ground.

    Attributes:
        torque: Joint torques [N·m], shape (L, 3).
        wrench: Force [N] and moment about the body's origin [N·m] that the feet must give, in world
            axes, shape (6,).
        foot: Feet from the body's origin, world axes [m], shape (L, 3).
        jacobian: d foot / d q in these axes [m/rad], shape (L, 3, 3).
    """

    torque: Float[np.ndarray, "legs 3"]
    wrench: Float[np.ndarray, "6"]
    foot: Float[np.ndarray, "legs 3"]
    jacobian: Float[np.ndarray, "legs 3 3"]


@dataclass(eq=False)
class State:
    """State of the feed-forward stage and its result; L legs.

    Attributes:
        motion: Motion of this instant.
        pose: The same pose at rest; filled where limits count.
        load_share: Part of its full share of the load that each foot carries, 0 to 1, shape (L,).
        time_since_touchdown: Time for which each foot has stood [s], shape (L,).
        normals: Ground normals under the feet, world axes, shape (L, 3).
        required: Forces that the motion requires.
        at_rest: Forces that this pose requires.
        inverse_cost: Inverse of each foot's cost matrix times its share, shape (L, 3, 3).
        cost_gradient: Linear part of each foot's cost, shape (L, 3).
        torque_limits: Lowest and highest joint torques at these speeds [N·m], shape (2, L, 3).
        foot_force: Force of the ground on the feet, world axes [N], shape (L, 3).
        joint_torque: Joint torques [N·m], shape (L, 3).
        missing: Part of the load that the stance feet cannot give.
        friction: Coefficient of friction that the forces need.
        torque_utilisation: Largest torque as a part of what its servo gives at its speed.
        motion_scale: Part of the motion that limits allow: 1 all of it, 0 rest at most.
        leg_count: Number of legs.
    """

    motion: Motion
    pose: Motion
    load_share: Float[np.ndarray, " legs"]
    time_since_touchdown: Float[np.ndarray, " legs"]
    normals: Float[np.ndarray, "legs 3"]
    required: InverseDynamics
    at_rest: InverseDynamics
    inverse_cost: Float[np.ndarray, "legs 3 3"]
    cost_gradient: Float[np.ndarray, "legs 3"]
    torque_limits: Float[np.ndarray, "2 legs 3"]
    foot_force: Float[np.ndarray, "legs 3"]
    joint_torque: Float[np.ndarray, "legs 3"]
    missing: float
    friction: float
    torque_utilisation: float
    motion_scale: float
    leg_count: int


PARAMETERS, STATE = record_of(Parameters), record_of(State)
"""Records of these classes."""


def parameters_of(robot: Robot, settings: FeedForwardSettings, update_period: float) -> Parameters:
    """Return the parameters of a robot, with force model and limits of the settings."""
    arrays, body, servo = robot.arrays, robot.body, robot.servo
    stall_torque = settings.torque_used * servo.stall_torque
    cost, cost_option = settings.cost()
    return Parameters(
        np.column_stack(geometry(arrays)),
        *link_moments(arrays),
        arrays.R_body_hip,
        arrays.p_body_hip,
        body.mass,
        *moments_about_origin(np.array(body.mass), body.com, body.inertia),
        servo.armature,
        STANDARD_GRAVITY,
        stall_torque,
        stall_torque / servo.no_load_speed,
        settings.friction * settings.friction_used,
        cost,
        cost_option,
        settings.load_transfer,
        update_period,
        len(robot.legs),
    )
