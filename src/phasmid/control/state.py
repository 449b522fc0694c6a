"""What the engine knows of the robot, what it is to do, and where it is in doing it: arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from phasmid.control.bounds import reach_bounds
from phasmid.control.settings import EngineSettings
from phasmid.kinematics import neutral_feet
from phasmid.robot import Robot

STANCE, SWING, HELD, SETTLING, PROBING = 0, 1, 2, 3, 4
"""What a leg does: it stands, it swings to its next place, it is held in the air, it comes to rest
where it has met the ground early, or it goes on down where it has not met it."""

OBSTACLE = 2
"""What is felt at a foot that has just met something on its way."""

RISES = 0.5
"""`State.retreat` of a foot that comes up from where it has found no ground."""

LOWERED = -1.0
"""`State.retreat` of a stance foot that goes down to the ground, with which it has lost contact."""

STILL, WALKING = 0, 1
"""What the clock does: it rests, or it runs."""

REACH, SPEED, SUPPORT = 1, 2, 3
"""What may keep a walk from being faster."""

DIRECTIONS = 16
"""Half-planes that bound where a foot may stand."""


class Model(NamedTuple):
    """The robot's numbers; L legs.

    Attributes:
        lengths: Link lengths [m], shape (L, 3).
        R_body_hip: Rotations of the hips, shape (L, 3, 3).
        p_body_hip: Hips [m], shape (L, 3).
        limits: Lowest and highest joint angles [rad], shape (L, 3, 2).
        neutral: Neutral feet in the body frame [m], shape (L, 3).
        folded: Joint angles of a leg that is held in the air [rad], shape (L, 3).
        link_mass: Masses of the links [kg], shape (L, 3).
        link_com: Their centres of mass in their frames [m], shape (L, 3, 3).
        reach: What each leg reaches with the margins, see `reach_bounds`, shape (2, L, 8).
        body_moment: Mass of the trunk times the place of its centre [kg·m], shape (3,).
        mass: Of the whole robot [kg].
        height: Of the body's origin over the neutral feet [m].
        radius: Mean distance of the neutral feet from the body's vertical axis [m].
        joint_speed: Largest speed of a joint's target [rad/s].
    """

    lengths: np.ndarray
    R_body_hip: np.ndarray
    p_body_hip: np.ndarray
    limits: np.ndarray
    neutral: np.ndarray
    folded: np.ndarray
    link_mass: np.ndarray
    link_com: np.ndarray
    reach: np.ndarray
    body_moment: np.ndarray
    mass: float
    height: float
    radius: float
    joint_speed: float


class Order(NamedTuple):
    """What is to be done at this update, admissible as it stands; written anew where it changes.

    Attributes:
        velocity: Of the body, ahead, left [m/s] and turn [rad/s], shape (3,).
        pose: Of the body beside its path and its neutral height, six degrees [m, rad], shape (6,).
        correction: To be added to it, by who feels the ground, shape (6,).
        offsets: Phases at which the legs lift; of legs not in use anything, shape (L,).
        gait: Duty factor, period [s], sway, and 1 where a change of gait is wanted, shape (4,).
        step: Height of a step [m], shape (1,).
        used: Whether each leg is walked on, 1 or 0, shape (L,).
        touch: What is felt under each foot: -1 nothing known, 0 air, 1 ground, 2 an obstacle that
            it has just met on its way, shape (L,).
        plane: Of the ground in odom: its normal, and its height at the origin [m], shape (4,).
        landing: Height at which each foot shall find the ground [m], NaN: that of the plane, (L,).
        foot_offset: Added to the feet's targets in odom [m], shape (L, 3).
        sag: How much lower each foot in the air is than it is told to be, or was as it landed [m],
            shape (L,).
    """

    velocity: np.ndarray
    pose: np.ndarray
    correction: np.ndarray
    offsets: np.ndarray
    gait: np.ndarray
    step: np.ndarray
    used: np.ndarray
    touch: np.ndarray
    plane: np.ndarray
    landing: np.ndarray
    foot_offset: np.ndarray
    sag: np.ndarray


class State(NamedTuple):
    """Where the engine is; every array is a view into one of the last two.

    Attributes:
        path: Place on the ground and heading in odom [m, rad], shape (3,).
        speed: Three stages of the filter of the velocity, the last is the path's, shape (3, 3).
        pose: Four stages of the filter of the body's pose, the last is the pose, shape (4, 6).
        sway: Four stages of the filter of the body's way aside, shape (4, 2).
        clock: Phase of the gait; time [s]; share of the sway; slow-down; time a lift has waited
            [s]; support margin [m]; share of the commanded velocity; lean ahead and left [m];
            joint speed over the limit, shape (10,).
        foot: Feet in odom [m], shape (L, 3).
        line: Of each foot its place without the lift, its velocity and acceleration, (3, L, 3).
        swing: Of each foot time since its lift, time of its swing [s], height [m], shape (L, 3).
        landing: Where each foot lands, or has, in odom [m], shape (L, 3).
        motion: Velocity and acceleration of the feet in odom, shape (2, L, 3).
        q: Joint angles, speeds and accelerations [rad, s], shape (3, L, 3).
        retreat: 1 while a swinging foot draws back from an obstacle, 2 or more where it was stopped
            on that way, `RISES` while it comes up from a hole, `LOWERED` while a stance foot is
            lowered to the ground, 0 else, shape (L,).
        search: 0; while a foot looks elsewhere for the ground that it has not found, for how many
            times it does; else what `phasmid.control.elsewhere` says, shape (L,).
        sought: Where it looks, where it found none first, and where it last stood and felt the
            ground, in odom [m], shape (3, L, 3).
        body: Rotation of the body in odom, shape (3, 3).
        trunk: Its place, velocity, angular velocity, and their rates, in odom, shape (5, 3).
        com: Centre of mass in the body frame [m], shape (3,).
        region: Half-planes about the neutral feet: normals ahead and left, and distance (L, K, 3).
        posed: For which pose, slope ahead and left of the ground, and height of the foot above it,
            shape (L, 9).
        ground: Four stages of the filter of the ground's height at the origin of odom and of its
            slopes along x and y, shape (4, 3).
        offset: What is added to the feet's targets in odom [m], shape (L, 3).
        leg: What each leg does, shape (L,).
        mode: What the clock does; leg whose region is next; 1 while a foot that is due would
            hardly rise before the pose is where it goes to; changes of `search`, shape (4,).
        numbers: All of the former as one row.
        codes: The last two.
    """

    path: np.ndarray
    speed: np.ndarray
    pose: np.ndarray
    sway: np.ndarray
    clock: np.ndarray
    foot: np.ndarray
    line: np.ndarray
    swing: np.ndarray
    landing: np.ndarray
    motion: np.ndarray
    q: np.ndarray
    retreat: np.ndarray
    search: np.ndarray
    sought: np.ndarray
    body: np.ndarray
    trunk: np.ndarray
    com: np.ndarray
    region: np.ndarray
    posed: np.ndarray
    ground: np.ndarray
    offset: np.ndarray
    leg: np.ndarray
    mode: np.ndarray
    numbers: np.ndarray
    codes: np.ndarray


class Tuning(NamedTuple):
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


def model_of(robot: Robot, joint_speed_share: float, stretch: float, joint_margin: float) -> Model:
    """The numbers of a robot.

    Args:
        robot: The robot.
        joint_speed_share: Share of its servos' no-load speed that targets may use.
        stretch: Share of its full length to which a leg may be stretched.
        joint_margin: Distance from the joints' limits that targets keep [rad].
    """
    arrays = robot.arrays
    neutral = neutral_feet(robot)
    limits = np.array(arrays.joint_limits)
    folded = np.clip(
        [[0.0, 1.2, -2.2]] * len(robot.legs), limits[..., 0] + 0.1, limits[..., 1] - 0.1
    )
    return Model(
        np.array(arrays.lengths),
        np.array(arrays.R_body_hip),
        np.array(arrays.p_body_hip),
        limits,
        neutral,
        folded,
        np.array(arrays.mass),
        np.array(arrays.com),
        reach_bounds(np.asarray(arrays.lengths), limits, stretch, joint_margin),
        robot.body.mass * np.asarray(robot.body.com),
        robot.mass,
        -float(neutral[:, 2].mean()),
        float(np.hypot(neutral[:, 0], neutral[:, 1]).mean()),
        joint_speed_share * robot.servo.no_load_speed,
    )


def tuning_of(settings: EngineSettings, sway_bandwidth: float) -> Tuning:
    """The settings as numbers."""
    return Tuning(
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
