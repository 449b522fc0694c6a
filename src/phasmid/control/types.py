"""Robot model, reference, state and settings of the locomotion engine.

Each class names the fields of a NumPy record (`records.record_of`); compiled functions take arrays
of records. Records hold `MAX_LEGS` legs, so that one compilation serves every robot; Python works
on views of the legs that a robot has (`records.view_of`).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from jaxtyping import Float, Int

from phasmid.control.records import record_of
from phasmid.control.settings import EngineSettings
from phasmid.dynamics.matrices import in_plane
from phasmid.kinematics import neutral_feet
from phasmid.kinematics.arguments import geometry
from phasmid.robot import Robot


class LegPhase(IntEnum):
    """Phase of a leg: it stands, swings, is held in the air, comes to rest after an early contact,
    or goes on down where it has no contact yet.
    """

    STANCE = 0
    SWING = 1
    HELD = 2
    SETTLING = 3
    PROBING = 4


class Contact(IntEnum):
    """Contact of a foot; obstacle: contact on the way of a swing, at this update."""

    UNKNOWN = -1
    AIR = 0
    GROUND = 1
    OBSTACLE = 2


class Manoeuvre(IntEnum):
    """Deviation of a foot from its swing or stance: it draws back from an obstacle, was stopped on
    that way, rises where it has found no ground, or is lowered after a lost contact.
    """

    NONE = 0
    DRAW_BACK = 1
    STOPPED = 2
    RISE = 3
    LOWER = 4


class SearchStage(IntEnum):
    """Stage of a foot's search for ground: at a point ahead, at one behind, on the way back to the
    last foothold, there again, without ground there either, or landing wherever it comes down.
    """

    NONE = 0
    AHEAD = 1
    BEHIND = 2
    RETURNING = 3
    RETURNED = 4
    GAVE_UP = 5
    LAND_HERE = 6


REACH, SPEED, SUPPORT = 1, 2, 3
"""Constraints that may limit a velocity."""

DIRECTIONS = 16
"""Half-planes of a foothold region."""


@dataclass(eq=False)
class Model:
    """The robot's numbers; L legs.

    Attributes:
        lengths: Link lengths, and the foot's offset to the left of the leg's plane [m],
            shape (L, 4).
        R_body_hip: Rotations of the hips, shape (L, 3, 3).
        p_body_hip: Hips [m], shape (L, 3).
        limits: Lowest and highest joint angles [rad], shape (L, 3, 2).
        neutral: Neutral feet in the body frame [m], shape (L, 3).
        folded: Joint angles of a leg that is held in the air [rad], shape (L, 3).
        link_mass: Masses of the links [kg], shape (L, 3).
        link_com: Their centres of mass in their frames in the leg's plane [m], shape (L, 3, 3).
        reach: What each leg reaches with the margins, see `reach_bounds`, shape (2, L, 8).
        body_moment: Mass of the trunk times the place of its centre [kg·m], shape (3,).
        mass: Of the whole robot [kg].
        height: Of the body's origin over the neutral feet [m].
        radius: Mean distance of the neutral feet from the body's vertical axis [m].
        joint_speed: Largest speed of a joint's target [rad/s].
        leg_count: Number of legs.
    """

    lengths: Float[np.ndarray, "legs 4"]
    R_body_hip: Float[np.ndarray, "legs 3 3"]
    p_body_hip: Float[np.ndarray, "legs 3"]
    limits: Float[np.ndarray, "legs 3 2"]
    neutral: Float[np.ndarray, "legs 3"]
    folded: Float[np.ndarray, "legs 3"]
    link_mass: Float[np.ndarray, "legs 3"]
    link_com: Float[np.ndarray, "legs 3 3"]
    reach: Float[np.ndarray, "2 legs 8"]
    body_moment: Float[np.ndarray, "3"]
    mass: float
    height: float
    radius: float
    joint_speed: float
    leg_count: int


@dataclass(eq=False)
class Reference:
    """Feasible reference of the engine, and the estimate of the ground; L legs.

    Attributes:
        velocity: Velocity of the body, vx, vy [m/s] and wz [rad/s], shape (3,).
        pose: Pose of the body relative to its path and neutral height [m, rad], shape (6,).
        pose_correction: Addition to the pose by ground estimation, shape (6,).
        lift_phase: Phases at which the legs lift; any value for legs not in use, shape (L,).
        used: 1 for legs that the robot walks on, 0 for others, shape (L,).
        duty_factor: Duty factor of the gait.
        period: Time of a cycle [s].
        sway: Sway of the gait.
        gait_pending: 1 while a change of gait is pending.
        step_height: Height of a step [m].
        contact: `Contact` of each foot, shape (L,).
        ground_normal: Normal of the ground plane in odom, shape (3,).
        ground_height: Height of that plane at the origin [m].
        touchdown_height: Height at which each foot expects ground [m], NaN for that of the plane,
            shape (L,).
        foot_offset: Addition to the feet's targets in odom [m], shape (L, 3).
        foot_sag: Distance of each foot below its target while in the air, or at its touchdown [m],
            shape (L,).
    """

    velocity: Float[np.ndarray, "3"]
    pose: Float[np.ndarray, "6"]
    pose_correction: Float[np.ndarray, "6"]
    lift_phase: Float[np.ndarray, " legs"]
    used: Int[np.ndarray, " legs"]
    duty_factor: float
    period: float
    sway: float
    gait_pending: int
    step_height: float
    contact: Int[np.ndarray, " legs"]
    ground_normal: Float[np.ndarray, "3"]
    ground_height: float
    touchdown_height: Float[np.ndarray, " legs"]
    foot_offset: Float[np.ndarray, "legs 3"]
    foot_sag: Float[np.ndarray, " legs"]


@dataclass(eq=False)
class GaitClock:
    """Clock of the gait.

    Attributes:
        phase: Of the cycle, 0 to 1.
        time: On the controller's clock [s].
        sway_share: Part of the gait's sway that the body makes.
        time_scale: Rate of the engine's time, 1 or less: slower where a joint would be too fast.
        lift_wait: Time for which a lift has waited [s].
        support_margin: Of the whole robot now [m].
        velocity_share: Part of the commanded velocity that feet and support allow.
        lean: Of the body ahead and left [m], shape (2,).
        gait_running: 1 while the gait advances, 0 at rest.
        region_leg: Leg whose region is bounded next.
        pose_hinders: 1 while a foot that is due would hardly rise before the pose is reached.
        search_changes: Number of changes of `State.search_stage`.
    """

    phase: float
    time: float
    sway_share: float
    time_scale: float
    lift_wait: float
    support_margin: float
    velocity_share: float
    lean: Float[np.ndarray, "2"]
    gait_running: int
    region_leg: int
    pose_hinders: int
    search_changes: int


@dataclass(eq=False)
class State:
    """State of the engine; L legs. Odom is the frame of the path, its origin below the first pose.

    Attributes:
        path: Place on the ground and heading in odom [m, rad], shape (3,).
        velocity_filter: Stages of the velocity filter; the last is the path's, shape (3, 3).
        pose_filter: Stages of the pose filter; the last is the body's pose, shape (4, 6).
        sway_filter: Stages of the filter of the body's sway, shape (4, 2).
        ground_filter: Stages of the filter of the ground's height at the origin of odom and its
            slopes along x and y, shape (4, 3).
        clock: Clock of the gait.
        R_odom_body: Rotation of the body, shape (3, 3).
        body_position: Origin of the body in odom [m], shape (3,).
        body_velocity: Its velocity [m/s], shape (3,).
        body_acceleration: Its acceleration [m/s²], shape (3,).
        angular_velocity: Of the body in odom [rad/s], shape (3,).
        angular_acceleration: Of the body in odom [rad/s²], shape (3,).
        com: Centre of mass in the body frame [m], shape (3,).
        leg_phase: `LegPhase` of each leg, shape (L,).
        manoeuvre: `Manoeuvre` of each foot, shape (L,).
        foot: Feet in odom [m], shape (L, 3).
        foot_velocity: Velocities of the feet in odom [m/s], shape (L, 3).
        foot_acceleration: Accelerations of the feet in odom [m/s²], shape (L, 3).
        foot_offset: Addition to the feet's targets in odom [m], shape (L, 3).
        line_position: Position of each foot without the lift of its swing [m], shape (L, 3).
        line_velocity: Its velocity [m/s], shape (L, 3).
        line_acceleration: Its acceleration [m/s²], shape (L, 3).
        touchdown: Place where each foot lands, or has landed, in odom [m], shape (L, 3).
        swing_elapsed: Time since lift-off [s], shape (L,).
        swing_duration: Time of the swing [s], shape (L,).
        swing_height: Height of the swing [m], shape (L,).
        time_without_contact: Time for which a stance foot has had no contact [s], shape (L,).
        q: Joint angles [rad], shape (L, 3).
        qd: Joint speeds [rad/s], shape (L, 3).
        qdd: Joint accelerations [rad/s²], shape (L, 3).
        search_stage: `SearchStage` of each foot, shape (L,).
        return_attempts: Attempts of each foot to step back to its last foothold, shape (L,).
        search_goal: Place where each foot looks for ground, in odom [m], shape (L, 3).
        missed_foothold: Place where it found none first, in odom [m], shape (L, 3).
        last_foothold: Place where it last stood with contact, in odom [m], shape (L, 3).
        region: Foothold region of each leg: half-planes by normal ahead and left, and distance from
            the neutral foot [m], shape (L, K, 3).
        region_pose: Pose, slopes of the ground and height of the foot above it for which the region
            holds, shape (L, 9).
        leg_count: Number of legs.
    """

    path: Float[np.ndarray, "3"]
    velocity_filter: Float[np.ndarray, "3 3"]
    pose_filter: Float[np.ndarray, "4 6"]
    sway_filter: Float[np.ndarray, "4 2"]
    ground_filter: Float[np.ndarray, "4 3"]
    clock: GaitClock
    R_odom_body: Float[np.ndarray, "3 3"]
    body_position: Float[np.ndarray, "3"]
    body_velocity: Float[np.ndarray, "3"]
    body_acceleration: Float[np.ndarray, "3"]
    angular_velocity: Float[np.ndarray, "3"]
    angular_acceleration: Float[np.ndarray, "3"]
    com: Float[np.ndarray, "3"]
    leg_phase: Int[np.ndarray, " legs"]
    manoeuvre: Int[np.ndarray, " legs"]
    foot: Float[np.ndarray, "legs 3"]
    foot_velocity: Float[np.ndarray, "legs 3"]
    foot_acceleration: Float[np.ndarray, "legs 3"]
    foot_offset: Float[np.ndarray, "legs 3"]
    line_position: Float[np.ndarray, "legs 3"]
    line_velocity: Float[np.ndarray, "legs 3"]
    line_acceleration: Float[np.ndarray, "legs 3"]
    touchdown: Float[np.ndarray, "legs 3"]
    swing_elapsed: Float[np.ndarray, " legs"]
    swing_duration: Float[np.ndarray, " legs"]
    swing_height: Float[np.ndarray, " legs"]
    time_without_contact: Float[np.ndarray, " legs"]
    q: Float[np.ndarray, "legs 3"]
    qd: Float[np.ndarray, "legs 3"]
    qdd: Float[np.ndarray, "legs 3"]
    search_stage: Int[np.ndarray, " legs"]
    return_attempts: Int[np.ndarray, " legs"]
    search_goal: Float[np.ndarray, "legs 3"]
    missed_foothold: Float[np.ndarray, "legs 3"]
    last_foothold: Float[np.ndarray, "legs 3"]
    region: Float[np.ndarray, "legs 16 3"]
    region_pose: Float[np.ndarray, "legs 9"]
    leg_count: int


@dataclass(eq=False)
class Parameters:
    """The settings as numbers, and what follows from them; units as in `EngineSettings`.

    Attributes:
        acceleration: Of the body.
        velocity_bandwidth: Of the velocity's filter.
        pose_speed: Of the body's pose.
        pose_turn_speed: Of its angles.
        pose_bandwidth: Of its filter.
        sway_bandwidth: Of the filter of the body's way aside [1/s].
        stretch: Share of its length to which a leg may be stretched.
        joint_margin: Distance from the joints' limits.
        support_margin: Before a foot lifts.
        planned_margin: What a steady walk keeps beside that.
        planned_speed: Share of the joints' speed that a steady walk may use.
        lowest_lift: Part of the swing before which contact is no landing.
        landing_depth: How far a foot goes on down.
        landing_speed: How fast.
        patience: For which a lift waits.
    """

    acceleration: float
    velocity_bandwidth: float
    pose_speed: float
    pose_turn_speed: float
    pose_bandwidth: float
    sway_bandwidth: float
    stretch: float
    joint_margin: float
    support_margin: float
    planned_margin: float
    planned_speed: float
    lowest_lift: float
    landing_depth: float
    landing_speed: float
    patience: float


MODEL, REFERENCE, STATE, PARAMETERS = (
    record_of(kind) for kind in (Model, Reference, State, Parameters)
)
"""Records of these classes."""


def model_of(robot: Robot, joint_speed_share: float, stretch: float, joint_margin: float) -> Model:
    """The numbers of a robot.

    Args:
        robot: The robot.
        joint_speed_share: Share of its servos' no-load speed that targets may use.
        stretch: Share of its full length to which a leg may be stretched.
        joint_margin: Distance from the joints' limits that targets keep [rad].
    """
    # Lazy import: numba takes 0.6 s.
    from phasmid.control.reach_bounds import reach_bounds

    arrays = robot.arrays
    lengths, neutral = np.column_stack(geometry(arrays)), neutral_feet(robot)
    limits = np.array(arrays.joint_limits)
    folded = np.clip(
        [[0.0, 1.2, -2.2]] * len(robot.legs), limits[..., 0] + 0.1, limits[..., 1] - 0.1
    )
    return Model(
        lengths,
        np.array(arrays.R_body_hip),
        np.array(arrays.p_body_hip),
        limits,
        neutral,
        folded,
        np.array(arrays.mass),
        arrays.com - in_plane(arrays),
        reach_bounds(lengths, limits, stretch, joint_margin),
        robot.body.mass * np.asarray(robot.body.com),
        robot.mass,
        -float(neutral[:, 2].mean()),
        float(np.hypot(neutral[:, 0], neutral[:, 1]).mean()),
        joint_speed_share * robot.servo.no_load_speed,
        len(robot.legs),
    )


def parameters_of(settings: EngineSettings, sway_bandwidth: float) -> Parameters:
    """The settings as numbers."""
    return Parameters(
        settings.acceleration,
        settings.velocity_bandwidth,
        settings.pose_speed,
        settings.pose_turn_speed,
        settings.pose_bandwidth,
        sway_bandwidth,
        settings.stretch,
        settings.joint_margin,
        settings.support_margin,
        settings.planned_margin,
        settings.planned_speed_share,
        settings.lowest_lift,
        settings.landing_depth,
        settings.landing_speed,
        settings.patience,
    )
