"""Ground estimator of the locomotion engine: contact, ground plane, attitude, corrections.

The engine writes each observation by `GroundEstimator.measure`; the compiled update begins with
`estimate_ground`. Sensor readings and the engine's state go in; contact, ground plane, landing
heights and corrections go into its reference.
"""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled
from phasmid.control.body_motion import ground_height
from phasmid.control.estimation.attitude import estimate_attitude
from phasmid.control.estimation.body_levelling import level_body
from phasmid.control.estimation.contact import estimate_contact
from phasmid.control.estimation.ground_plane import estimate_plane
from phasmid.control.estimation.leg_statics import estimate_compliance
from phasmid.control.estimation.odometry_alignment import align_odometry
from phasmid.control.estimation.settings import EstimatorSettings
from phasmid.control.estimation.state import (
    MEASURED,
    AttitudeSource,
    EstimatorEvent,
    EstimatorParameters,
    EstimatorState,
    Measurements,
    SensorEvent,
    SensorKind,
    clear,
    parameters_of,
)
from phasmid.control.estimation.terrain_adaptation import MOST_BODY_RISE, adapt_to_terrain
from phasmid.control.records import fill, view_of
from phasmid.control.types import Contact, LegPhase, Model, Reference, State
from phasmid.experiment.observation import Observation
from phasmid.robot import Robot

HIT_RISE, MOST_RAISES = 0.02, 3
"""Height that the expected landing gains for each obstacle hit in a swing [m], and most hits."""

PLANNED_WEIGHT = 0.5
"""Weight of a planned foothold in the ground plane, where a standing foot has 1."""

PROBED_DEPTH = 0.01
"""Depth below the ground plane from which a foot without contact lowers it [m]."""

SAG_LIMIT = 0.02
"""Largest height by which the body is raised over compliant legs [m]."""

TIPPING, ROUGH_TIPPING = 0.09, 1.0
"""Tilt above which the body tips over, a sine, and its increase by the roughness [1/m] up to
`MOST_BODY_RISE`: on high blocks feet slip off edges and stand again."""

HEIGHT_TIME = 1.0
"""Time constant with which the body is raised by the legs' deflection [s]."""

SENSORS = {
    SensorKind.SWITCH: "contact switch",
    SensorKind.FORCE: "force sensor",
    SensorKind.LOAD: "load sensing",
    SensorKind.ANGLE: "angle sensing",
}

SENSOR_EVENTS = {
    SensorEvent.DEAD: "sends no readings; it is not used",
    SensorEvent.STUCK_ON: "indicates contact all through swings; it is not trusted",
    SensorEvent.STUCK_OFF: "never indicates contact while its leg stands; it is not trusted",
    SensorEvent.FLICKERING: "flickers while its leg swings; it is not trusted",
    SensorEvent.RECOVERED: "fits the leg's motion again; it is trusted",
}

SOURCES = {
    AttitudeSource.NONE: "no inertial sensor can be trusted; levelling eases out",
    AttitudeSource.ORIENTATION: "the inertial sensor's orientation is used",
    AttitudeSource.ACCELEROMETER: "no orientation can be trusted; gyro and accelerometer are used",
}


class GroundEstimator:
    """Estimates contact, ground and attitude, and writes them into the engine's reference.

    Args:
        robot: The robot.
        settings: Levelling and delays.
        dt: Update period [s].
        memory: Record of one engine, shape (1,).

    Attributes:
        state: Estimates.

    Raises:
        InvalidInput: A delay is too long for the update period.
    """

    def __init__(
        self,
        robot: Robot,
        settings: EstimatorSettings,
        dt: float,
        memory: np.ndarray,
        gravity: float,
    ) -> None:
        self._leg_names = robot.leg_names
        legs = len(robot.legs)
        parameters = view_of(memory["estimator_parameters"], EstimatorParameters, legs)
        fill(parameters, parameters_of(robot, settings, dt, gravity))
        self._states = memory["estimator"]
        self.state = view_of(self._states, EstimatorState, legs)
        self._measured = view_of(memory["measurements"], Measurements, legs)
        clear(self._states)

    def reset(self, observation: Observation) -> None:
        """Reset all estimates.

        Args:
            observation: Its contact sensors are those of the robot.
        """
        clear(self._states)
        loads = observation.joint_load is not None
        for kind, available in (
            (SensorKind.SWITCH, observation.contact is not None),
            (SensorKind.FORCE, observation.foot_normal_force is not None),
            (SensorKind.LOAD, loads),
            # Position errors of stiff servos show little; they are used where loads are absent.
            (SensorKind.ANGLE, not loads),
        ):
            self.state.available[kind] = self.state.used[kind] = available

    def measure(self, observation: Observation) -> None:
        """Write an observation into the record of the measurements."""
        for name in MEASURED:
            value = getattr(observation, name)
            getattr(self._measured, name)[:] = math.nan if value is None else value

    def describe(self, events: int) -> list[str]:
        """Return a sentence for each event, and clear the events of the sensors.

        Args:
            events: `EstimatorEvent` bits of an update.
        """
        sentences = []
        if events & EstimatorEvent.SENSOR:
            new = self._states["feet"]["sensors"]["event"][0]
            for kind, leg in np.argwhere(new.T):
                sentences.append(
                    f"{SENSORS[SensorKind(kind)]} of leg {self._leg_names[leg]} "
                    f"{SENSOR_EVENTS[SensorEvent(new[leg, kind])]}"
                )
            new[:] = SensorEvent.NONE
        if events & EstimatorEvent.ATTITUDE:
            sentences.append(SOURCES[AttitudeSource(self.state.attitude.source)])
        return sentences


@compiled
def estimate_ground(
    state: State,
    reference: Reference,
    estimator: EstimatorState,
    parameters: EstimatorParameters,
    measured: Measurements,
    model: Model,
) -> int:
    """Advance the estimator by one update period, and write the engine's reference.

    Args:
        state: State of the engine; alignment with gravity changes it.
        reference: Written.
        estimator: Changed.
        parameters: Settings and robot.
        measured: Sensor readings.
        model: The robot; its neutral feet are changed.

    Returns:
        `EstimatorEvent` bits.
    """
    if estimator.updates > 0:
        align_odometry(state, estimator, parameters)
    events = update_estimates(state, estimator, parameters, measured)
    write_reference(state, model, reference, estimator, parameters)
    return events


@compiled
def update_estimates(
    state: State,
    estimator: EstimatorState,
    parameters: EstimatorParameters,
    measured: Measurements,
) -> int:
    """Update all estimates; return `EstimatorEvent` bits."""
    read_plan(state, estimator)
    attitude, events = estimator.attitude, 0
    if estimate_contact(state, estimator, parameters, measured):
        events |= EstimatorEvent.SENSOR.value
    is_first, before = estimator.updates == 1, attitude.source
    estimate_attitude(measured, state.clock.gait_running == 0, attitude, parameters)
    is_lost = attitude.source == AttitudeSource.NONE
    if is_lost if is_first else attitude.source != before:
        events |= EstimatorEvent.ATTITUDE.value
    for leg in range(parameters.leg_count):
        # A foot that stands in the air shows nothing of the ground.
        foot = estimator.feet[leg]
        in_air = not is_first and foot.contact == Contact.AIR
        foot.bearing = 0 if in_air else foot.standing
        planned = math.isfinite(state.next_foothold[leg, 0])
        if state.leg_phase[leg] == LegPhase.SWING and planned:
            # The body follows the ground ahead.
            foot.foothold[:] = state.next_foothold[leg]
            foot.foothold_weight = PLANNED_WEIGHT
        elif in_air and state.leg_phase[leg] == LegPhase.PROBING and not planned:
            # The ground lies lower; on rough ground the body follows the foot.
            x, y, z = state.foot[leg]
            if z < ground_height(state, x, y) - PROBED_DEPTH:
                foot.foothold[:] = state.foot[leg]
                foot.foothold_weight = min(estimator.roughness / MOST_BODY_RISE, 1.0)
    estimate_plane(state.foot, state.path, estimator, parameters)
    height = state.body_position[2] - estimator.ground_plane.height
    R_odom_body = delayed_attitude(state, estimator, parameters)
    level_body(R_odom_body, state.path[2], height, estimator, parameters)
    sag = estimate_compliance(state.q, measured.joint_position, state.foot, estimator, parameters)
    estimator.body_sag += min(parameters.dt / HEIGHT_TIME, 1.0) * (sag - estimator.body_sag)
    return events


@compiled
def read_plan(state: State, estimator: EstimatorState) -> None:
    """Write which feet stand by the plan, and the progress of the others' swings."""
    for leg in range(state.leg_count):
        foot, phase = estimator.feet[leg], state.leg_phase[leg]
        foot.standing = 1 if phase in (LegPhase.STANCE, LegPhase.SETTLING) else 0
        foot.swing_progress = 0.0
        if phase == LegPhase.SWING and state.manoeuvre[leg] == 0:
            foot.swing_progress = min(
                max(state.swing_elapsed[leg] / state.swing_duration[leg], 0.0), 1.0
            )
        elif phase in (LegPhase.PROBING, LegPhase.HELD):
            foot.swing_progress = 1.0


@compiled
def delayed_attitude(
    state: State, estimator: EstimatorState, parameters: EstimatorParameters
) -> np.ndarray:
    """Return the attitude that was commanded as long ago as the body's motion lags."""
    attitudes, length = estimator.body_attitudes, parameters.attitude_delay
    now = estimator.updates % length
    if estimator.updates == 1:
        for k in range(length):
            attitudes[k] = state.R_odom_body
    attitudes[now] = state.R_odom_body
    return attitudes[(now + 1) % length]


@compiled
def write_reference(
    state: State,
    model: Model,
    reference: Reference,
    estimator: EstimatorState,
    parameters: EstimatorParameters,
) -> None:
    """Write contact, ground, corrections and landing heights into the engine's reference."""
    plane, legs = estimator.ground_plane, parameters.leg_count
    normal = np.array([-plane.slope_x, -plane.slope_y, 1.0])
    reference.ground_normal[:] = normal / math.sqrt(normal @ normal)
    reference.ground_height = plane.height - plane.slope_x * plane.x - plane.slope_y * plane.y
    correction, levelling = reference.pose_correction, estimator.levelling
    correction[:2], correction[3:5] = levelling.shift, levelling.lean
    correction[2] = levelling.rise + min(max(estimator.body_sag, 0.0), SAG_LIMIT)
    adapt_to_terrain(state, model, reference, estimator, parameters, normal)
    tipping = TIPPING + ROUGH_TIPPING * min(estimator.roughness, MOST_BODY_RISE)
    reference.tipping = int(levelling.tilt > tipping)
    for leg in range(legs):
        estimate = estimator.feet[leg]
        hits = estimate.obstacle_hits
        reference.contact[leg] = estimate.contact
        if hits > estimate.reported_hits and estimate.contact == Contact.GROUND:
            reference.contact[leg] = Contact.OBSTACLE
        estimate.reported_hits = reference.obstacle_hits[leg] = hits
        # The sag of a limp leg is no compliance.
        reference.foot_sag[leg] = min(estimate.sag, SAG_LIMIT)
        reference.touchdown_height[leg] = math.nan
        if estimate.contact >= 0:
            landing = state.touchdown[leg]
            z = reference.ground_height - normal[:2] @ landing[:2]
            # After a hit the foot expects the ground on top of the obstacle.
            reference.touchdown_height[leg] = z + min(hits, MOST_RAISES) * HIT_RISE
