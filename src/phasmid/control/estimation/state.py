"""What feeling is told, remembers and is tuned by: arrays, as views into a few rows.

As the engine's `Memory`, and for the same reason: a compiled loop is handed on a few rows sooner
than sixty arrays.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.compiled import internal
from phasmid.control.estimation import contact
from phasmid.control.estimation.admittance import transition
from phasmid.control.estimation.attitude import MEMORY as ATTITUDE
from phasmid.control.estimation.body_levelling import MEMORY as LEVEL
from phasmid.control.estimation.settings import EstimatorSettings
from phasmid.control.views import take
from phasmid.robot import Robot
from phasmid.units import STANDARD_GRAVITY

SWITCH, FORCE, LOAD, ANGLE = range(4)
"""Rows of the feet's sensors."""

UPDATES, SOURCE, JOINTS_HEARD, LATE, LAG = range(5)
"""Columns of the counts."""


class EstimatorState(NamedTuple):
    """What is told, felt and remembered; L legs.

    Attributes:
        joint_position: Told angles [rad], shape (L, 3).
        joint_load: Told shares of the servos' largest output, NaN: none, shape (L, 3).
        contact: Told by the switches, 0 or 1, NaN: none, shape (L,).
        normal_force: Told by the feet's force sensors [N], NaN: none, shape (L,).
        orientation: Told of the body, w x y z, NaN: none, shape (4,).
        angular_velocity: Told by the gyro [rad/s], NaN: none, shape (3,).
        acceleration: Told by the accelerometer [m/s²], NaN: none, shape (3,).
        sensors: Memory of `detect_contact` for each sensor, shape (L, 4, 10).
        legs: The same for each leg, shape (L, 5).
        reading: Of each sensor of each foot, shape (4, L).
        attitude: Memory of `estimate_attitude`, shape (17,).
        up: Upwards in body axes, shape (3,).
        level: Memory of `level_body`, shape (9,).
        planes: The ground's plane, and after one lag and both, as in `fit_plane`, shape (3, 5).
        stood: Where feet stood last, as there, shape (L, 4).
        give: By how much each foot gives way, upwards [m], and how fast [m/s], shape (L, 2).
        wanted: Normal forces that admittance wants [N], shape (L,).
        sag: How much lower each foot in the air is than it shall be, or was as it landed [m], (L,).
        sunk: How much lower the body is than it shall be, smoothed [m], shape (1,).
        correction: Of the body in the path's axes: ahead, left, up [m], roll, pitch [rad], (5,).
        progress: Share of its swing that each foot has done, shape (L,).
        known: Hits of each foot that have been told of, shape (L,).
        steps: Height of a step that is asked, and what was made of it [m], shape (2,).
        past: Joint angles that were asked for at the last updates [rad], in turn, shape (N, L, 3).
        turned: The body's attitudes that were, in turn, shape (M, 3, 3).
        news: What is new of each sensor, as in `detect_contact`, shape (4, L).
        touch: 1 on the ground, 0 in the air, -1 unknown: trust the plan, shape (L,).
        standing: Which feet stand by the plan, 1 or 0, shape (L,).
        stood_before: The same at the last update, -1 before the first, shape (L,).
        bearing: Those of the standing feet that feel the ground, or are trusted to, shape (L,).
        present: Which kinds of sensors the robot has, 1 or 0, shape (4,).
        heard: Which of them are listened to now, shape (4,).
        counts: Updates until now; what the attitude is by, -1 before the first; whether joints are
            listened to; N; M; shape (5,).
    """

    joint_position: np.ndarray
    joint_load: np.ndarray
    contact: np.ndarray
    normal_force: np.ndarray
    orientation: np.ndarray
    angular_velocity: np.ndarray
    acceleration: np.ndarray
    sensors: np.ndarray
    legs: np.ndarray
    reading: np.ndarray
    attitude: np.ndarray
    up: np.ndarray
    level: np.ndarray
    planes: np.ndarray
    stood: np.ndarray
    give: np.ndarray
    wanted: np.ndarray
    sag: np.ndarray
    sunk: np.ndarray
    correction: np.ndarray
    progress: np.ndarray
    known: np.ndarray
    steps: np.ndarray
    past: np.ndarray
    turned: np.ndarray
    news: np.ndarray
    touch: np.ndarray
    standing: np.ndarray
    stood_before: np.ndarray
    bearing: np.ndarray
    present: np.ndarray
    heard: np.ndarray
    counts: np.ndarray


class EstimatorParameters(NamedTuple):
    """The settings, and what is known of the robot, as numbers; units as in `EstimatorSettings`.

    Attributes:
        lengths: Of the links [m], shape (L, 3).
        mass: Of the links [kg], shape (L, 3).
        com: Centres of mass in the links' frames [m], shape (L, 3, 3).
        threshold: From which each kind of sensor feels the ground, and below which no more, (4, 2).
        touch: Settings of `detect_contact`, shape (5,).
        attitude: Settings of `estimate_attitude`, shape (6,).
        level: Settings of `level_body`, shape (8,).
        swing_law: Of the admittance of swinging feet, as in `give_way`, shape (2, 3).
        stance_law: Of standing ones, shape (2, 3).
        dt: From one update to the next [s].
        weight: Of the robot [N].
        stall_torque: Of a servo [N·m].
        stiffness: Of a servo [N·m/rad].
        implausible_steps: As set; so are all that follow, `admittance` as 1 or 0.
    """

    lengths: np.ndarray
    mass: np.ndarray
    com: np.ndarray
    threshold: np.ndarray
    touch: np.ndarray
    attitude: np.ndarray
    level: np.ndarray
    swing_law: np.ndarray
    stance_law: np.ndarray
    dt: float
    weight: float
    stall_torque: float
    stiffness: float
    implausible_steps: float
    forgetting_time: float
    plane_spread: float
    plane_rate: float
    plane_time: float
    height_time: float
    height_limit: float
    admittance: float
    admittance_limit: float
    hit_rise: float
    landing_sink: float
    step_rise: float
    body_rise: float
    least_roughness: float


@internal
def state_at(numbers: np.ndarray, codes: np.ndarray, legs: int) -> EstimatorState:
    """The senses that a row of numbers and a row of codes hold; the counts are the first codes."""
    a = 0
    joint_position, a = take(numbers, a, (legs, 3))
    joint_load, a = take(numbers, a, (legs, 3))
    switch, a = take(numbers, a, (legs,))
    normal_force, a = take(numbers, a, (legs,))
    orientation, a = take(numbers, a, (4,))
    angular_velocity, a = take(numbers, a, (3,))
    acceleration, a = take(numbers, a, (3,))
    sensors, a = take(numbers, a, (legs, 4, 10))
    by_leg, a = take(numbers, a, (legs, 5))
    reading, a = take(numbers, a, (4, legs))
    attitude, a = take(numbers, a, (ATTITUDE,))
    up, a = take(numbers, a, (3,))
    level, a = take(numbers, a, (LEVEL,))
    planes, a = take(numbers, a, (3, 5))
    stood, a = take(numbers, a, (legs, 4))
    give, a = take(numbers, a, (legs, 2))
    wanted, a = take(numbers, a, (legs,))
    sag, a = take(numbers, a, (legs,))
    sunk, a = take(numbers, a, (1,))
    correction, a = take(numbers, a, (5,))
    progress, a = take(numbers, a, (legs,))
    known, a = take(numbers, a, (legs,))
    steps, a = take(numbers, a, (2,))
    past, a = take(numbers, a, (int(codes[LATE]), legs, 3))
    turned, a = take(numbers, a, (int(codes[LAG]), 3, 3))
    counts, b = take(codes, 0, (5,))
    news, b = take(codes, b, (4, legs))
    touch, b = take(codes, b, (legs,))
    standing, b = take(codes, b, (legs,))
    stood_before, b = take(codes, b, (legs,))
    bearing, b = take(codes, b, (legs,))
    present, b = take(codes, b, (4,))
    heard, b = take(codes, b, (4,))
    return EstimatorState(
        joint_position,
        joint_load,
        switch,
        normal_force,
        orientation,
        angular_velocity,
        acceleration,
        sensors,
        by_leg,
        reading,
        attitude,
        up,
        level,
        planes,
        stood,
        give,
        wanted,
        sag,
        sunk,
        correction,
        progress,
        known,
        steps,
        past,
        turned,
        news,
        touch,
        standing,
        stood_before,
        bearing,
        present,
        heard,
        counts,
    )


def leg_margin(legs: int, late: int, lag: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows of zeros for a robot's senses.

    Args:
        legs: L.
        late: N, how many updates old the told joint angles are.
        lag: M, how many the body's attitude is.
    """
    numbers = np.zeros(36 + ATTITUDE + LEVEL + (67 + 3 * late) * legs + 9 * lag)
    codes = np.zeros(13 + 8 * legs, dtype=np.int64)
    codes[LATE], codes[LAG] = late, lag
    return numbers, codes


def forget(senses: EstimatorState) -> None:
    """Make senses those of a robot of which nothing is known yet, but for its sensors' kinds."""
    for name, values in zip(EstimatorState._fields, senses, strict=True):
        if name not in ("present", "heard", "counts"):
            values[:] = 0
    senses.legs[:, contact.WAS_STANDING] = 1.0
    senses.legs[:, contact.CODE] = -1.0
    senses.reading[:] = math.nan
    senses.touch[:] = senses.stood_before[:] = -1
    senses.up[2] = 1.0
    senses.planes[:, 0] = math.nan
    senses.counts[: JOINTS_HEARD + 1] = 0, -1, 1


@internal
def parameters_at(row: np.ndarray, legs: int) -> EstimatorParameters:
    """The settings that a row of numbers holds."""
    lengths, a = take(row, 0, (legs, 3))
    mass, a = take(row, a, (legs, 3))
    com, a = take(row, a, (legs, 3, 3))
    threshold, a = take(row, a, (4, 2))
    touch, a = take(row, a, (5,))
    attitude, a = take(row, a, (6,))
    level, a = take(row, a, (8,))
    swing_law, a = take(row, a, (2, 3))
    stance_law, a = take(row, a, (2, 3))
    b, a = take(row, a, (18,))
    return EstimatorParameters(
        lengths,
        mass,
        com,
        threshold,
        touch,
        attitude,
        level,
        swing_law,
        stance_law,
        b[0],
        b[1],
        b[2],
        b[3],
        b[4],
        b[5],
        b[6],
        b[7],
        b[8],
        b[9],
        b[10],
        b[11],
        b[12],
        b[13],
        b[14],
        b[15],
        b[16],
        b[17],
    )


def parameters_row(robot: Robot, s: EstimatorSettings, dt: float) -> Float[np.ndarray, " numbers"]:
    """The settings, and what is known of the robot, as one row of numbers.

    Args:
        robot: The robot, L legs.
        s: Thresholds, time constants and limits.
        dt: From one update to the next [s].
    """
    arrays, weight = robot.arrays, robot.mass * STANDARD_GRAVITY
    own = weight / len(robot.legs)
    laws = [
        np.column_stack(transition(s.admittance_mass, k, s.damping_ratio, dt))
        for k in (s.swing_stiffness, s.stance_stiffness)
    ]
    force, load = [s.force_on * own, s.force_off * own], [s.load_on * own, s.load_off * own]
    tuning = EstimatorParameters(
        arrays.lengths,
        arrays.mass,
        arrays.com,
        np.array([[0.5, 0.5], force, load, load]),
        np.array([s.touch_time, s.release_time, s.release_by, s.hit_by, s.dead_time]),
        np.array(
            [
                s.orientation_time,
                s.accelerometer_time,
                s.bias_time,
                s.imu_delay,
                s.gate,
                s.quarrel_time,
            ]
        ),
        np.array(
            [
                s.level,
                s.level_time,
                s.level_rate,
                s.level_limit,
                s.shift,
                s.shift_rate,
                s.shift_limit,
                s.ease_time,
            ]
        ),
        laws[0],
        laws[1],
        dt,
        weight,
        robot.servo.stall_torque,
        robot.servo.stiffness,
        s.implausible_steps,
        s.forgetting_time,
        s.plane_spread,
        s.plane_rate,
        s.plane_time,
        s.height_time,
        s.height_limit,
        float(s.admittance),
        s.admittance_limit,
        s.hit_rise,
        s.landing_sink,
        s.step_rise,
        s.body_rise,
        s.least_roughness,
    )
    return np.concatenate([np.ravel(np.asarray(values)) for values in tuning])
