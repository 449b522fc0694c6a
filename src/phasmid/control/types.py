"""Robot model, reference and state of the locomotion engine.

Each class names the fields of a NumPy record (`records.record_of`); compiled functions take arrays
of records. Records hold `MAX_LEGS` legs, so that one compilation serves every robot; Python works
on views of the legs that a robot has (`records.view_of`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from jaxtyping import Float, Int

from phasmid.control.records import record_of
from phasmid.control.settings import EngineSettings
from phasmid.dynamics.matrices import in_plane
from phasmid.kinematics import neutral_feet
from phasmid.kinematics.leg import geometry
from phasmid.robot import Robot


class LegPhase(IntEnum):
    """Phase of a leg: it stands, swings, is held in the air, comes to rest after contact, or goes
    on down where it has no contact yet.
    """

    STANCE = 0
    SWING = 1
    HELD = 2
    SETTLING = 3
    PROBING = 4


class LegUse(IntEnum):
    """Use of a leg: lost, in use, or lost and needed: without it the robot would fall."""

    LOST = 0
    IN_USE = 1
    NEEDED = 2


class Contact(IntEnum):
    """Contact of a foot; obstacle: contact during a swing, at this update."""

    UNKNOWN = -1
    AIR = 0
    GROUND = 1
    OBSTACLE = 2


class Manoeuvre(IntEnum):
    """Deviation of a foot from swing or stance: it draws back from an obstacle, was stopped while
    drawing back, rises where it has found no ground, or is lowered after a lost contact.
    """

    NONE = 0
    DRAW_BACK = 1
    STOPPED = 2
    RISE = 3
    LOWER = 4


class SearchStage(IntEnum):
    """Stage of a foot's search for ground: at a point ahead, at one behind, returning to the last
    foothold, returned, without ground there either, or landing without a search.
    """

    NONE = 0
    AHEAD = 1
    BEHIND = 2
    RETURNING = 3
    RETURNED = 4
    GAVE_UP = 5
    LAND_HERE = 6


DIRECTIONS = 16
"""Half-planes of a foothold region."""

JOINT_SPEED_SHARE = 0.95
"""Share of the servo's no-load speed that joint targets may use."""

SUPPORT_MARGIN = 0.004
"""Least support margin with which a foot may lift [m]."""


@dataclass(eq=False)
class Model:
    """Numbers of a robot, and settings of its engine."""

    lengths: Float[np.ndarray, "legs 4"]  # Links, and lateral offset of the foot [m]
    R_body_hip: Float[np.ndarray, "legs 3 3"]  # Rotations of the hips
    p_body_hip: Float[np.ndarray, "legs 3"]  # Places of the hips [m]
    limits: Float[np.ndarray, "legs 3 2"]  # Least and largest joint angles [rad]
    nominal: Float[np.ndarray, "legs 3"]  # Neutral feet on level ground in the body frame [m]
    neutral: Float[np.ndarray, "legs 3"]  # The same, narrower on rough or steep ground [m]
    folded: Float[np.ndarray, "legs 3"]  # Joint angles of a leg that is held in the air [rad]
    link_mass: Float[np.ndarray, "legs 3"]  # Masses of the links [kg]
    link_com: Float[np.ndarray, "legs 3 3"]  # Centres of mass of the links in the leg plane [m]
    body_moment: Float[np.ndarray, "3"]  # Mass of the trunk times the place of its centre [kg·m]
    mass: float  # Mass of the robot [kg]
    height: float  # Height of the body's origin over the neutral feet [m]
    foot_radius: float  # Of the ball of each foot, whose centre is the foot; 0: a point [m]
    radius: float  # Mean distance of the neutral feet from the body's vertical axis [m]
    joint_speed: Float[np.ndarray, "legs 3"]  # Largest speeds of the joints' targets [rad/s]
    acceleration: float  # Largest acceleration of the body [m/s²]
    landing_depth: float  # Depth to which a foot without contact goes on down on even ground [m]
    trunk: Float[np.ndarray, "2 3"]  # Lowest and highest corner of the trunk's box [m]
    leg_count: int  # Number of legs


@dataclass(eq=False)
class Reference:
    """Feasible reference of the engine, and the estimate of the ground."""

    velocity: Float[np.ndarray, "3"]  # Velocity of the body, vx, vy [m/s] and wz [rad/s]
    pose: Float[np.ndarray, "6"]  # Pose of the body relative to its path [m, rad]
    pose_correction: Float[np.ndarray, "6"]  # Addition to it by ground estimation
    lift_phase: Float[np.ndarray, " legs"]  # Phases at which the legs in use lift
    used: Int[np.ndarray, " legs"]  # 1 for legs in use, 0 for lost ones
    walks: int  # 1 where the legs in use can walk, 0 where they only stand
    duty_factor: float  # Duty factor of the gait
    period: float  # Time of a cycle [s]
    sway: float  # Sway of the gait
    gait_pending: int  # 1 while a change of gait is pending
    step_height: float  # Height of a step [m]
    contact: Int[np.ndarray, " legs"]  # `Contact` of each foot
    ground_normal: Float[np.ndarray, "3"]  # Normal of the ground plane in odom
    ground_height: float  # Height of that plane at the origin [m]
    touchdown_height: Float[np.ndarray, " legs"]  # Expected ground [m]; NaN: the plane
    obstacle_hits: Int[np.ndarray, " legs"]  # Obstacles that each foot has met in its swing
    swing_height: Float[np.ndarray, " legs"]  # Least height of each next swing [m]
    least_rise: float  # Least height of the body over its neutral one, for its clearance [m]
    landing_depth: float  # Depth to which a foot without contact goes on down [m]
    foot_sag: Float[np.ndarray, " legs"]  # Depth of each foot in the air below its target [m]
    tipping: int  # 1 while the body tips over


@dataclass(eq=False)
class GaitClock:
    """Clock of the gait."""

    phase: float  # Phase of the cycle, 0 to 1
    time: float  # Time of the controller [s]
    sway_share: float  # Part of the gait's sway that the body makes
    time_scale: float  # Rate of the engine's time; below 1 where a joint would be too fast
    lift_wait: float  # Time for which a lift has waited [s]
    support_margin: float  # Present support margin [m]
    velocity_share: float  # Part of the commanded velocity that feet and support allow
    lean: Float[np.ndarray, "2"]  # Displacement of the body while a lift waits [m]
    gait_running: int  # 1 while the gait advances, 0 at rest
    region_leg: int  # Leg whose region is bounded next
    pose_hinders: int  # 1 while a foot that is due would hardly rise before the pose is reached
    search_changes: int  # Number of changes of `State.search_stage`


@dataclass(eq=False)
class State:
    """State of the engine; odom is the world frame, with its origin below the first pose."""

    path: Float[np.ndarray, "3"]  # Place on the ground and heading in odom [m, rad]
    velocity_filter: Float[np.ndarray, "3 3"]  # Stages; the last is the velocity of the path
    pose_filter: Float[np.ndarray, "4 6"]  # Stages; the last is the pose of the body
    sway_filter: Float[np.ndarray, "4 2"]  # Stages; the last is the sway of the body
    ground_filter: Float[np.ndarray, "4 3"]  # Stages of the ground's height and slopes
    clock: GaitClock  # Clock of the gait
    R_odom_body: Float[np.ndarray, "3 3"]  # Rotation of the body
    body_position: Float[np.ndarray, "3"]  # Origin of the body in odom [m]
    body_velocity: Float[np.ndarray, "3"]  # In odom [m/s]
    body_acceleration: Float[np.ndarray, "3"]  # In odom [m/s²]
    angular_velocity: Float[np.ndarray, "3"]  # Of the body in odom [rad/s]
    angular_acceleration: Float[np.ndarray, "3"]  # Of the body in odom [rad/s²]
    com: Float[np.ndarray, "3"]  # Centre of mass in the body frame [m]
    leg_phase: Int[np.ndarray, " legs"]  # `LegPhase` of each leg
    needed: Int[np.ndarray, " legs"]  # 1 for lost legs without which the robot would fall
    manoeuvre: Int[np.ndarray, " legs"]  # `Manoeuvre` of each foot
    foot: Float[np.ndarray, "legs 3"]  # Feet in odom [m]
    foot_velocity: Float[np.ndarray, "legs 3"]  # Velocities of the feet in odom [m/s]
    foot_acceleration: Float[np.ndarray, "legs 3"]  # Accelerations of the feet in odom [m/s²]
    line_position: Float[np.ndarray, "legs 3"]  # Feet without lift and lateral displacement [m]
    line_velocity: Float[np.ndarray, "legs 3"]  # Its velocity [m/s]
    line_acceleration: Float[np.ndarray, "legs 3"]  # Its acceleration [m/s²]
    touchdown: Float[np.ndarray, "legs 3"]  # Next or last landing of each foot in odom [m]
    next_foothold: Float[np.ndarray, "legs 3"]  # Planned on the height map [m]; NaN: none
    swing_elapsed: Float[np.ndarray, " legs"]  # Time since lift-off [s]
    swing_duration: Float[np.ndarray, " legs"]  # Time of the swing [s]
    swing_height: Float[np.ndarray, " legs"]  # Height of the swing [m]
    swing_lateral: Float[np.ndarray, "legs 2"]  # Lateral displacement at mid-swing, in odom [m]
    time_without_contact: Float[np.ndarray, " legs"]  # Of stance feet [s]
    q: Float[np.ndarray, "legs 3"]  # Joint angles [rad]
    qd: Float[np.ndarray, "legs 3"]  # Joint speeds [rad/s]
    qdd: Float[np.ndarray, "legs 3"]  # Joint accelerations [rad/s²]
    search_stage: Int[np.ndarray, " legs"]  # `SearchStage` of each foot
    return_attempts: Int[np.ndarray, " legs"]  # Attempts to step back to the last foothold
    search_goal: Float[np.ndarray, "legs 3"]  # Next foothold of each foot's search, in odom [m]
    missed_foothold: Float[np.ndarray, "legs 3"]  # Where it first found no ground, in odom [m]
    last_foothold: Float[np.ndarray, "legs 3"]  # Its last foothold with contact, in odom [m]
    region: Float[np.ndarray, "legs 16 3"]  # Foothold regions: normals and distances of half-planes
    region_pose: Float[np.ndarray, "legs 9"]  # Pose, slopes and foot height for which they hold
    leg_count: int  # Number of legs


MODEL, REFERENCE, STATE = record_of(Model), record_of(Reference), record_of(State)
"""Records of these classes."""


STANDING = np.zeros(1, REFERENCE)
"""Reference of standing on level ground without contact sensing, shape (1,)."""

STANDING["used"] = STANDING["walks"] = STANDING["duty_factor"] = STANDING["period"] = 1
STANDING["contact"], STANDING["touchdown_height"] = Contact.UNKNOWN, np.nan
STANDING["ground_normal"] = 0.0, 0.0, 1.0
STANDING["least_rise"] = -math.inf


def model_of(robot: Robot, settings: EngineSettings) -> Model:
    """Return the numbers of a robot with its engine's settings."""
    arrays = robot.arrays
    lengths, neutral = np.column_stack(geometry(arrays)), neutral_feet(robot)
    limits = np.array(arrays.joint_limits)
    folded = np.clip(
        [[0.0, 1.2, -2.2]] * len(robot.legs), limits[..., 0] + 0.1, limits[..., 1] - 0.1
    )
    return Model(
        lengths=lengths,
        R_body_hip=np.array(arrays.R_body_hip),
        p_body_hip=np.array(arrays.p_body_hip),
        limits=limits,
        nominal=neutral,
        neutral=neutral,
        folded=folded,
        link_mass=np.array(arrays.mass),
        link_com=arrays.com - in_plane(arrays),
        body_moment=robot.body.mass * np.asarray(robot.body.com),
        mass=robot.mass,
        height=-float(neutral[:, 2].mean()),
        foot_radius=robot.foot_radius,
        radius=float(np.hypot(neutral[:, 0], neutral[:, 1]).mean()),
        joint_speed=JOINT_SPEED_SHARE * arrays.no_load_speed,
        acceleration=settings.acceleration,
        landing_depth=settings.landing_depth,
        trunk=robot.body.box,
        leg_count=len(robot.legs),
    )
