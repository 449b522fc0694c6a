"""What a controller knows of the ground by its senses, from update to update."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from phasmid.control.feel import attitude, level, touch
from phasmid.control.feel.admittance import give_way, share_weight, transition
from phasmid.control.feel.attitude import feel_attitude
from phasmid.control.feel.foot_force import foot_forces
from phasmid.control.feel.level import level_body
from phasmid.control.feel.plane import fit_plane
from phasmid.control.feel.sag import fit_sag
from phasmid.control.feel.settings import FeelSettings
from phasmid.control.feel.touch import feel_touch, judge_sensors
from phasmid.control.feel.upright import set_engine_upright
from phasmid.control.observation import Observation
from phasmid.control.state import State
from phasmid.robot import Robot
from phasmid.units import STANDARD_GRAVITY

SWITCH, FORCE, LOAD, ANGLE = range(4)
"""Rows of the feet's sensors."""


class Intent(NamedTuple):
    """What a controller has asked of the robot until now.

    Attributes:
        standing: Which feet stand by the plan, shape (L,).
        progress: Share of its swing that each foot has done, shape (L,).
        p_odom_foot: Where the feet are, or were set down [m], shape (L, 3).
        p_odom_path: The place above which the body walks; its x and y are used [m], shape (2+,).
        p_odom_body: The body's origin [m], shape (3,).
        R_odom_body: Its attitude, shape (3, 3).
        R_odom_path: The axes of the path, in which corrections are told, shape (3, 3).
        joint_position: Angles that the joints shall have [rad], shape (L, 3).
        walking: Whether a foot swings or the body moves.
    """

    standing: Bool[np.ndarray, " legs"]
    progress: Float[np.ndarray, " legs"]
    p_odom_foot: Float[np.ndarray, "legs 3"]
    p_odom_path: Float[np.ndarray, " place"]
    p_odom_body: Float[np.ndarray, "3"]
    R_odom_body: Float[np.ndarray, "3 3"]
    R_odom_path: Float[np.ndarray, "3 3"]
    joint_position: Float[np.ndarray, "legs 3"]
    walking: bool


class Felt(NamedTuple):
    """What is felt; the arrays are the feeling's own and change with its next update.

    Attributes:
        touch: 1 on the ground, 0 in the air, -1 unknown: trust the plan, shape (L,).
        hits: How many obstacles each foot has met in this swing, shape (L,).
        correction: Of the body in the path's axes: ahead, left, up [m], roll, pitch [rad], (5,).
        plane: Of the ground, smoothed: height [m] at a place, slopes along x and y, and the place
            [m], shape (5,).
        up: Upwards in body axes, shape (3,).
        attitude: What that is by: 0 nothing to be believed, 1 orientation, 2 gyro, accelerometer.
        foot_offset: By how much each foot gives way, upwards [m], shape (L,).
        sag: How much lower each foot in the air is than it shall be, or was as it landed [m], (L,).
    """

    touch: Int[np.ndarray, " legs"]
    hits: Float[np.ndarray, " legs"]
    correction: Float[np.ndarray, "5"]
    plane: Float[np.ndarray, "5"]
    up: Float[np.ndarray, "3"]
    attitude: int
    foot_offset: Float[np.ndarray, " legs"]
    sag: Float[np.ndarray, " legs"]


class Feeling:
    """The robot's senses: its feet, its joints, its inertial sensor.

    Args:
        robot: The robot, L legs.
        settings: Thresholds, time constants and limits.
        dt: From one update to the next [s].
    """

    def __init__(self, robot: Robot, settings: FeelSettings, dt: float) -> None:
        self.robot, self.settings, self.dt = robot, settings, dt
        self.weight = robot.mass * STANDARD_GRAVITY
        arrays, legs = robot.arrays, len(robot.legs)
        self._lengths, self._mass, self._com = (
            np.array(part) for part in (arrays.lengths, arrays.mass, arrays.com)
        )
        s, own = settings, self.weight / legs
        self._threshold = np.array(
            [[0.5, 0.5], [s.force_on, s.force_off], *[[s.load_on * own, s.load_off * own]] * 2]
        )
        self._touch_settings = np.array(
            [s.touch_time, s.release_time, s.release_by, s.hit_by, s.dead_time]
        )
        self._attitude_settings = np.array(
            [
                s.orientation_time,
                s.accelerometer_time,
                s.bias_time,
                s.imu_delay,
                s.gate,
                s.quarrel_time,
            ]
        )
        self._level_settings = np.array(
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
        )
        laws = [
            np.column_stack(transition(s.admittance_mass, k, s.damping_ratio, dt))
            for k in (s.swing_stiffness, s.stance_stiffness)
        ]
        self._swing_law, self._stance_law = laws
        self._stall, self._stiffness = robot.servo.stall_torque, robot.servo.stiffness
        self._late = max(1, round(s.joint_delay / dt))
        self._nothing = np.full(4, np.nan), np.full(3, np.nan), np.full(3, np.nan)
        self.events: list[str] = []
        self._forget(legs)

    def _forget(self, legs: int) -> None:
        self._sensors = np.zeros((legs, 4, 10))
        self._legs = np.zeros((legs, 5))
        self._legs[:, touch.WAS_STANDING] = 1.0
        self._legs[:, touch.CODE] = -1.0
        self._reading = np.full((4, legs), np.nan)
        self._news = np.zeros((4, legs), dtype=np.int64)
        self._code = np.full(legs, -1, dtype=np.int64)
        self._attitude = np.zeros(attitude.MEMORY)
        self._bears = np.ones(legs, dtype=bool)
        self._up = np.array([0.0, 0.0, 1.0])
        self._level = np.zeros(level.MEMORY)
        self._planes = np.array([[np.nan, 0.0, 0.0, 0.0, 0.0]] * 3)
        self._plane = self._planes[2]
        self._stood_at = np.zeros((legs, 4))
        self._feet = np.zeros((legs, 2))
        self._wanted = np.zeros(legs)
        self._correction = np.zeros(5)
        self._sag = 0.0
        self._sags = np.zeros(legs)
        self._source = -1
        self._stood = b""
        self._past = np.zeros((self._late, legs, 3))
        self._turned = np.zeros((1 + round(self.settings.motion_lag / self.dt), 3, 3))
        self._step = 0
        self._joints_heard = True
        self._fresh = True
        self.events.clear()

    def reset(self, observation: Observation) -> None:
        """Forget all; the sensors that this observation holds are those that the robot has."""
        self._forget(len(self.robot.legs))
        o = observation
        has = o.contact is not None, o.foot_normal_force is not None, o.joint_load is not None
        # Angles that do not give way tell nothing; they are heard where loads are not told.
        self._present = np.array([*has, o.joint_load is None])
        self._heard = self._present.copy()

    def update(self, observation: Observation, intent: Intent) -> Felt:
        """What is felt now.

        Args:
            observation: What the sensors told.
            intent: What was asked of the robot until now.
        """
        self._feel_touch(observation, intent)
        self._feel_body(observation, intent)
        if self.settings.admittance:
            self._give_way(intent)
        return Felt(
            self._code,
            self._legs[:, touch.HITS],
            self._correction,
            self._plane,
            self._up,
            self._source,
            self._feet[:, 0],
            self._sags,
        )

    def set_upright(self, state: State) -> None:
        """Turn what an engine knows in odom, and what is remembered of it, with the measured up.

        Args:
            state: Where the engine is, at its last update; is changed.
        """
        if math.isfinite(self._planes[0, 0]):
            set_engine_upright(
                self.dt,
                state.numbers,
                state.codes,
                self._level,
                self._stood_at,
                self._planes,
                self._turned,
            )

    def _feel_touch(self, o: Observation, intent: Intent) -> None:
        reading, present = self._reading, self._heard
        reading[SWITCH] = np.nan if o.contact is None else o.contact
        reading[FORCE] = np.nan if o.foot_normal_force is None else o.foot_normal_force
        row = self._step % self._late
        self._step += 1
        if self._joints_heard:
            reading[LOAD:] = np.nan
            if o.joint_load is not None:
                self._compute_forces(o.joint_position, self._stall * o.joint_load, reading[LOAD])
            elif self._step > self._late:
                error = self._past[row] - o.joint_position
                self._compute_forces(o.joint_position, self._stiffness * error, reading[ANGLE])
        self._past[row] = intent.joint_position
        news = 0
        stood = intent.standing.tobytes()
        if stood != self._stood:
            self._stood = stood
            bad = self.settings.implausible_steps
            news = judge_sensors(intent.standing, bad, self._sensors, self._legs, self._news)
        news += feel_touch(
            self.dt,
            reading,
            self._threshold,
            present,
            intent.standing,
            intent.progress,
            self._touch_settings,
            self._sensors,
            self._legs,
            self._code,
            self._news,
        )
        if news or self._fresh:
            self._tell()
            # While a switch or a force sensor is heard at every foot, joints need not be.
            heard = self._sensors[:, :2, touch.DOUBTED] < 0.5
            heard &= self._sensors[:, :2, touch.SILENCE] < self.settings.dead_time
            self._joints_heard = not (heard & present[:2]).any(axis=1).all()
            present[LOAD:] = self._present[LOAD:] & self._joints_heard
            self._fresh = False

    def _compute_forces(self, q: np.ndarray, torque: np.ndarray, force: np.ndarray) -> None:
        foot_forces(q, torque, self._lengths, self._mass, self._com, STANDARD_GRAVITY, force)

    def _tell(self) -> None:
        """Put the news in words, one sentence for each sensor and kind."""
        for s, i in np.argwhere(self._news):
            name, kind = self.robot.legs[i].name, int(self._news[s, i])
            self.events.append(f"{touch.SENSORS[s]} of leg {name} {touch.TOLD[kind]}")
        self._news[:] = 0

    def _feel_body(self, o: Observation, intent: Intent) -> None:
        s = self.settings
        none = self._nothing
        source = feel_attitude(
            self.dt,
            STANDARD_GRAVITY,
            none[0] if o.orientation is None else o.orientation,
            none[1] if o.angular_velocity is None else o.angular_velocity,
            none[2] if o.acceleration is None else o.acceleration,
            not intent.walking,
            self._attitude_settings,
            self._attitude,
            self._up,
        )
        if source != self._source:
            if self._source >= 0 or source == attitude.NONE:
                self.events.append(SOURCES[source])
            self._source = source
        standing = intent.standing
        if self._step > 1:
            # A foot that stands on nothing tells nothing of the ground.
            np.logical_and(standing, self._code, out=self._bears)
            standing = self._bears
        fit_plane(
            self.dt,
            intent.p_odom_foot,
            standing,
            intent.p_odom_path,
            s.forgetting_time,
            s.plane_spread,
            s.plane_rate,
            s.plane_time,
            self._stood_at,
            self._planes,
        )
        if math.isnan(self._plane[0]):
            # No foot has stood yet.
            self._planes[:] = 0.0
        # What the body does now was asked a while ago.
        row = self._step % len(self._turned)
        if self._step == 1:
            self._turned[:] = intent.R_odom_body
        self._turned[row] = intent.R_odom_body
        R_body = self._turned[row - len(self._turned) + 1]
        level_body(
            self.dt,
            source != attitude.NONE,
            self._up,
            R_body,
            intent.R_odom_path,
            self._plane,
            intent.p_odom_body[2] - self._plane[0],
            self._level_settings,
            self._level,
        )
        sag = fit_sag(
            intent.joint_position,
            o.joint_position,
            self._lengths,
            intent.standing,
            standing,
            intent.p_odom_foot,
            self._sags,
        )
        self._sag += min(self.dt / s.height_time, 1.0) * (sag - self._sag)
        self._correction[:] = self._level[level.CORRECTION]
        self._correction[level.RISE] += min(max(self._sag, 0.0), s.height_limit)

    def _give_way(self, intent: Intent) -> None:
        reading = self._reading
        measured = reading[FORCE] if self._present[FORCE] else reading[LOAD]
        share_weight(
            self.weight, intent.p_odom_body, intent.p_odom_foot, intent.standing, self._wanted
        )
        give_way(
            measured,
            self._wanted,
            intent.standing,
            self._swing_law,
            self._stance_law,
            self.settings.admittance_limit,
            self._feet,
        )


SOURCES = {
    attitude.NONE: "no inertial sensor is to be believed; levelling eases out",
    attitude.ORIENTATION: "the inertial sensor's orientation is heard",
    attitude.ACCELEROMETER: "no orientation is to be believed; gyro and accelerometer are heard",
}
"""What tells of the body's attitude, in words."""
