"""Robot parameters and state of the feed-forward stage, as records for compiled functions.

See `phasmid.control.types` for how classes become records.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.control.feed_forward.settings import FeedForwardSettings
from phasmid.control.records import record_of
from phasmid.dynamics.matrices import link_moments, moments_about_origin
from phasmid.kinematics.leg import geometry
from phasmid.robot import Robot


@dataclass(eq=False)
class Parameters:
    """Masses of a robot with L legs, limits of its servos, and how feet share the load.

    The first fields are those of `dynamics.whole_body_kernels.RobotMoments`.
    """

    lengths: Float[np.ndarray, "legs 3"]  # of the links [m]
    left: Float[np.ndarray, " legs"]  # offset of the foot from the leg's plane [m]
    mass: Float[np.ndarray, "legs 3"]  # of the links [kg]
    first: Float[np.ndarray, "legs 3 3"]  # first moments, as in `link_moments` [kg·m]
    second: Float[np.ndarray, "legs 3 3 3"]  # inertias about the links' origins [kg·m²]
    R_body_hip: Float[np.ndarray, "legs 3 3"]
    p_body_hip: Float[np.ndarray, "legs 3"]  # [m]
    trunk_mass: float  # [kg]
    trunk_first: Float[np.ndarray, "3"]  # first moment about the body's origin [kg·m]
    trunk_second: Float[np.ndarray, "3 3"]  # about the body's origin [kg·m²]
    foot_radius: float  # of the ball of each foot; 0: a point [m]
    armature: Float[np.ndarray, "legs 3"]  # of the joints' rotors, seen at the joints [kg·m²]
    gravity: float  # acceleration of free fall [m/s²]
    stall_torque: Float[np.ndarray, "legs 3"]  # of the servos at rest that may be used [N·m]
    torque_drop: Float[np.ndarray, "legs 3"]  # loss of that torque per joint speed [N·m·s/rad]
    friction: float  # coefficient of friction that foot forces may use
    load_transfer: float  # time in which a foot takes on or gives up its load [s]
    update_period: float  # [s]
    leg_count: int


@dataclass(eq=False)
class Motion:
    """Motion of the robot at one instant, in world axes; L legs."""

    R_world_body: Float[np.ndarray, "3 3"]
    angular_velocity: Float[np.ndarray, "3"]  # of the trunk [rad/s]
    angular_acceleration: Float[np.ndarray, "3"]  # of the trunk [rad/s²]
    acceleration: Float[np.ndarray, "3"]  # of the body's origin, without gravity [m/s²]
    q: Float[np.ndarray, "legs 3"]  # [rad]
    qd: Float[np.ndarray, "legs 3"]  # [rad/s]
    qdd: Float[np.ndarray, "legs 3"]  # [rad/s²]


@dataclass(eq=False)
class InverseDynamics:
    """Forces that a motion requires at one instant, without the ground; world axes."""

    torque: Float[np.ndarray, "legs 3"]  # of the joints [N·m]
    wrench: Float[np.ndarray, "6"]  # of the feet: force [N], moment about the body's origin [N·m]
    foot: Float[np.ndarray, "legs 3"]  # contact points, from the body's origin [m]
    jacobian: Float[np.ndarray, "legs 3 3"]  # d contact point / d q [m/rad]


@dataclass(eq=False)
class State:
    """State of the feed-forward stage and its result; L legs, world axes."""

    motion: Motion
    pose: Motion  # same pose at rest; filled where limits count
    load_share: Float[np.ndarray, " legs"]  # part of its full share that a foot carries
    time_since_touchdown: Float[np.ndarray, " legs"]  # [s]
    normals: Float[np.ndarray, "legs 3"]  # of the ground under the feet
    required: InverseDynamics  # by the motion
    at_rest: InverseDynamics  # by its pose; filled where limits count
    torque_limits: Float[np.ndarray, "2 legs 3"]  # lowest and highest at these speeds [N·m]
    foot_force: Float[np.ndarray, "legs 3"]  # of the ground on the feet [N]
    joint_torque: Float[np.ndarray, "legs 3"]  # [N·m]
    missing: float  # part of the load that the stance feet cannot give
    friction: float  # coefficient of friction that the forces need
    torque_utilisation: float  # largest torque over what its servo gives at its speed
    motion_scale: float  # part of the motion that limits allow: 1 all of it, 0 rest at most
    leg_count: int


PARAMETERS, STATE = record_of(Parameters), record_of(State)
"""Records of these classes."""


def parameters_of(
    robot: Robot, settings: FeedForwardSettings, update_period: float, gravity: float
) -> Parameters:
    """Return the parameters of a robot, with the limits of the settings."""
    arrays, body = robot.arrays, robot.body
    stall_torque = settings.torque_used * arrays.stall_torque
    return Parameters(
        *geometry(arrays),
        *link_moments(arrays),
        arrays.R_body_hip,
        arrays.p_body_hip,
        body.mass,
        *moments_about_origin(np.array(body.mass), body.com, body.inertia),
        robot.foot_radius,
        arrays.armature,
        gravity,
        stall_torque,
        stall_torque / arrays.no_load_speed,
        settings.friction * settings.friction_used,
        settings.load_transfer,
        update_period,
        len(robot.legs),
    )
