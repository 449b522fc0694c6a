"""Robot model, reference, state and settings of the locomotion engine.

Each class names the fields of a NumPy record (`records.record_of`); compiled functions take arrays
of records. Records hold `MAX_LEGS` legs, so that one compilation serves every robot; Python works
on views of the legs that a robot has (`records.view_of`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from phasmid.control.bounds import reach_bounds
from phasmid.control.records import record_of
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


@dataclass(eq=False)
class Model:
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
        leg_count: Number of legs.
    """

    lengths: Float[np.ndarray, "legs 3"]
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
class Order:
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

    velocity: Float[np.ndarray, "3"]
    pose: Float[np.ndarray, "6"]
    correction: Float[np.ndarray, "6"]
    offsets: Float[np.ndarray, " legs"]
    gait: Float[np.ndarray, "4"]
    step: Float[np.ndarray, "1"]
    used: Int[np.ndarray, " legs"]
    touch: Int[np.ndarray, " legs"]
    plane: Float[np.ndarray, "4"]
    landing: Float[np.ndarray, " legs"]
    foot_offset: Float[np.ndarray, "legs 3"]
    sag: Float[np.ndarray, " legs"]


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
        joint_speed_ratio: Fastest joint's speed divided by the largest that is allowed.
        mode: `STILL` or `WALKING`.
        region_leg: Leg whose region is bounded next.
        pose_hinders: 1 while a foot that is due would hardly rise before the pose is reached.
        search_changes: How often `State.search` has changed.
    """

    phase: float
    time: float
    sway_share: float
    time_scale: float
    lift_wait: float
    support_margin: float
    velocity_share: float
    lean: Float[np.ndarray, "2"]
    joint_speed_ratio: float
    mode: int
    region_leg: int
    pose_hinders: int
    search_changes: int


@dataclass(eq=False)
class State:
    """Where the engine is.

    Attributes:
        path: Place on the ground and heading in odom [m, rad], shape (3,).
        speed: Three stages of the filter of the velocity, the last is the path's, shape (3, 3).
        pose: Four stages of the filter of the body's pose, the last is the pose, shape (4, 6).
        sway: Four stages of the filter of the body's way aside, shape (4, 2).
        clock: The gait's clock, and what slows it down.
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
        leg_count: Number of legs.
    """

    path: Float[np.ndarray, "3"]
    speed: Float[np.ndarray, "3 3"]
    pose: Float[np.ndarray, "4 6"]
    sway: Float[np.ndarray, "4 2"]
    clock: GaitClock
    foot: Float[np.ndarray, "legs 3"]
    line: Float[np.ndarray, "3 legs 3"]
    swing: Float[np.ndarray, "legs 3"]
    landing: Float[np.ndarray, "legs 3"]
    motion: Float[np.ndarray, "2 legs 3"]
    q: Float[np.ndarray, "3 legs 3"]
    retreat: Float[np.ndarray, " legs"]
    search: Float[np.ndarray, " legs"]
    sought: Float[np.ndarray, "3 legs 3"]
    body: Float[np.ndarray, "3 3"]
    trunk: Float[np.ndarray, "5 3"]
    com: Float[np.ndarray, "3"]
    region: Float[np.ndarray, "legs 16 3"]
    posed: Float[np.ndarray, "legs 9"]
    ground: Float[np.ndarray, "4 3"]
    offset: Float[np.ndarray, "legs 3"]
    leg: Int[np.ndarray, " legs"]
    leg_count: int


@dataclass(eq=False)
class Tuning:
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


MODEL, ORDER, STATE, TUNING = (record_of(kind) for kind in (Model, Order, State, Tuning))
"""Records of these classes."""


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
        len(robot.legs),
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
