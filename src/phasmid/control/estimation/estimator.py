"""The stage of the locomotion engine in which the ground is felt."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled, internal
from phasmid.control.estimation import attitude, contact
from phasmid.control.estimation.contact import HITS
from phasmid.control.estimation.feeling import ATTITUDE_NEWS, SENSOR_NEWS, Intent, feel
from phasmid.control.estimation.odometry_alignment import align_odometry
from phasmid.control.estimation.settings import EstimatorSettings
from phasmid.control.estimation.state import (
    SOURCE,
    EstimatorParameters,
    EstimatorState,
    forget,
    leg_margin,
    state_at,
)
from phasmid.control.memory import Memory, unwrapped
from phasmid.control.observation import Observation
from phasmid.control.types import Contact, LegPhase, Reference, State
from phasmid.robot import Robot

SOURCES = {
    attitude.NONE: "no inertial sensor is to be believed; levelling eases out",
    attitude.ORIENTATION: "the inertial sensor's orientation is heard",
    attitude.ACCELEROMETER: "no orientation is to be believed; gyro and accelerometer are heard",
}
"""What tells of the body's attitude, in words."""


class GroundEstimator:
    """Puts what is felt into the engine's reference: touch, plane, corrections, landing heights.

    Args:
        robot: The robot, L legs.
        settings: How it feels.
        dt: From one update to the next [s].

    Attributes:
        senses: What is told, felt and remembered.
        tuning: How it feels, as numbers, to be read.
        rows: Numbers and codes of the senses, and the tuning's numbers.
    """

    def __init__(self, robot: Robot, settings: EstimatorSettings, dt: float) -> None:
        self.robot = robot
        legs = len(robot.legs)
        late, lag = max(1, round(settings.joint_delay / dt)), 1 + round(settings.motion_lag / dt)
        numbers, codes = leg_margin(legs, late, lag)
        self.rows = numbers, codes, parameters_row(robot, settings, dt)
        # Plain Python's own views: what is compiled would give Python the same ones.
        self.senses: EstimatorState = unwrapped(state_at)(numbers, codes, legs)
        self.tuning: EstimatorParameters = unwrapped(parameters_at)(self.rows[2], legs)
        forget(self.senses)

    def reset(self, observation: Observation) -> None:
        """Forget all; the sensors that this observation holds are those that the robot has."""
        forget(self.senses)
        o = observation
        has = o.contact is not None, o.foot_normal_force is not None, o.joint_load is not None
        # Angles that do not give way tell nothing; they are heard where loads are not told.
        self.senses.present[:] = self.senses.heard[:] = (*has, o.joint_load is None)

    def update(self, observation: Observation, memory: Memory) -> list[str]:
        """Feel, and write the reference.

        Args:
            observation: What the sensors told.
            memory: State of the engine, and its reference, which is changed.

        Returns:
            What is new of the sensors, a sentence each.
        """
        self.hear(observation)
        news = estimate_ground(memory.states, memory.references, *self.rows)
        return self.tell(news) if news else []

    def hear(self, observation: Observation) -> None:
        """Note what the sensors told."""
        o, senses, nothing = observation, self.senses, math.nan
        senses.joint_position[:] = o.joint_position
        senses.joint_load[:] = nothing if o.joint_load is None else o.joint_load
        senses.contact[:] = nothing if o.contact is None else o.contact
        force = o.foot_normal_force
        senses.normal_force[:] = nothing if force is None else force
        senses.orientation[:] = nothing if o.orientation is None else o.orientation
        gyro = o.angular_velocity
        senses.angular_velocity[:] = nothing if gyro is None else gyro
        senses.acceleration[:] = nothing if o.acceleration is None else o.acceleration

    def tell(self, news: int) -> list[str]:
        """Put news in words, one sentence for each sensor and kind; it is then told.

        Args:
            news: As `feel` returned it.
        """
        told = []
        if news & SENSOR_NEWS:
            for s, i in np.argwhere(self.senses.news):
                name, kind = self.robot.legs[i].name, int(self.senses.news[s, i])
                told.append(f"{contact.SENSORS[s]} of leg {name} {contact.TOLD[kind]}")
            self.senses.news[:] = 0
        if news & ATTITUDE_NEWS:
            told.append(SOURCES[int(self.senses.counts[SOURCE])])
        return told


@compiled
def estimate_ground(
    states: np.ndarray,
    references: np.ndarray,
    own_numbers: np.ndarray,
    own_codes: np.ndarray,
    row: np.ndarray,
) -> int:
    """Feel, and write the reference; see `feel`.

    Args:
        states: Of the engine's `Memory`.
        references: The same.
        own_numbers: Of the `EstimatorState`.
        own_codes: The same.
        row: Of the `EstimatorParameters`.
    """
    state, reference = states[0], references[0]
    legs = state.leg_count
    senses, tuning = state_at(own_numbers, own_codes, legs), parameters_at(row, legs)
    intent = intent_of(state, senses)
    if math.isfinite(senses.planes[0, 0]):
        align_odometry(tuning.dt, state, senses.level, senses.stood, senses.planes, senses.turned)
    news = feel(senses, tuning, intent)
    write_order(senses, tuning, state, reference)
    return news


@internal
def intent_of(state: State, senses: EstimatorState) -> Intent:
    """What an engine has asked: which feet stand, how far the others have swung, and the rest.

    Args:
        state: Where the engine is.
        senses: Their `standing` and `progress` are written.
    """
    leg, standing, progress = state.leg_phase, senses.standing, senses.progress
    for i in range(len(standing)):
        doing = leg[i]
        standing[i] = 1 if doing in (LegPhase.STANCE, LegPhase.SETTLING) else 0
        progress[i] = 0.0
        if doing == LegPhase.SWING and state.manoeuvre[i] == 0.0:
            progress[i] = min(max(state.swing_elapsed[i] / state.swing_duration[i], 0.0), 1.0)
        elif doing in (LegPhase.PROBING, LegPhase.HELD):
            progress[i] = 1.0
    c, s = math.cos(state.path[2]), math.sin(state.path[2])
    R_path = np.zeros((3, 3))
    R_path[0, 0], R_path[0, 1] = c, -s
    R_path[1, 0], R_path[1, 1] = s, c
    R_path[2, 2] = 1.0
    return Intent(
        standing,
        progress,
        state.foot[: len(standing)],
        state.path,
        state.body_position,
        state.R_odom_body,
        R_path,
        state.q[: len(standing)],
        state.clock.gait_running != 0,
    )


@internal
def write_order(
    senses: EstimatorState, tuning: EstimatorParameters, state: State, reference: Reference
) -> None:
    """Write what is felt where the engine's loops read it.

    Args:
        senses: What is felt; what has been told of it is noted there.
        tuning: How it is taken.
        state: Where the engine is.
        reference: Is changed.
    """
    plane, steps, correction = senses.planes[2], senses.steps, reference.pose_correction
    for i in range(5):
        correction[i] = senses.correction[i]
    n = 1.0 / math.sqrt(1.0 + plane[1] ** 2 + plane[2] ** 2)
    reference.ground_normal[0], reference.ground_normal[1] = -plane[1] * n, -plane[2] * n
    reference.ground_normal[2] = n
    height = reference.ground_height = plane[0] - plane[1] * plane[3] - plane[2] * plane[4]
    low, high = 0.0, 0.0
    for i in range(state.leg_count):
        if state.leg_phase[i] == LegPhase.STANCE:
            foot = state.foot[i]
            z = foot[2] - height - plane[1] * foot[0] - plane[2] * foot[1]
            low, high = min(low, z), max(high, z)
    # Legs that step higher need more room.
    rough = max(high - low - tuning.least_roughness, 0.0)
    correction[2] += tuning.body_rise * min(rough, 0.05)
    if reference.step_height != steps[1]:
        steps[0] = reference.step_height
    # Ground that is as rough as what the feet stand on is stepped over.
    steps[1] = steps[0] + min(tuning.step_rise * rough, steps[0])
    reference.step_height = steps[1]
    for i in range(state.leg_count):
        hits = senses.legs[i, HITS]
        reference.contact[i] = senses.touch[i]
        if hits > senses.known[i] and senses.touch[i] == 1:
            reference.contact[i] = Contact.OBSTACLE
        senses.known[i] = hits
        reference.foot_offset[i, 2] = senses.give[i, 0]
        # A leg that is limp sags by more than any that gives way.
        reference.foot_sag[i] = min(senses.sag[i], tuning.height_limit)
        reference.touchdown_height[i] = math.nan
        if senses.touch[i] >= 0:
            landing = state.touchdown[i]
            z = height + plane[1] * landing[0] + plane[2] * landing[1]
            # Where a foot has met an obstacle on its way it looks for the ground on top of it.
            reference.touchdown_height[i] = (
                z - tuning.landing_sink + min(hits, 3.0) * tuning.hit_rise
            )
