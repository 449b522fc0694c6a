"""Contact of the feet, and faults of their sensors."""

from __future__ import annotations

import math

from phasmid.compiled import compiled
from phasmid.control.estimation.leg_statics import normal_force
from phasmid.control.estimation.state import (
    ContactSensor,
    EstimatorParameters,
    EstimatorState,
    FootEstimate,
    Measurements,
    SensorEvent,
    SensorKind,
)
from phasmid.control.types import Contact, State

MID_SWING = (0.35, 0.85)
"""Part of a swing in which a foot over level ground is surely in the air."""

SCUFF = 0.1
"""Share of a swing up to which a foot that touches again has not left yet."""

CLEAR = 0.25
"""Share of a swing up to which a foot that has left may still bounce."""

MOST_CHANGES = 4
"""Changes of an indication in mid-swing that an obstacle may cause."""

FEWEST = 5
"""Readings of a swing or a stance by which a sensor is rated."""

SURE = 0.95
"""Share of those that counts as all."""

IMPLAUSIBLE_STEPS = 2.0
"""Fault score, in steps that contradict the leg's motion, from which a sensor is distrusted."""

RECOVERY = 0.5
"""Decrease of the fault score by each plausible step."""

DEAD_TIME = 0.1
"""Duration without a reading after which a sensor is dead [s]."""

RELEASE_TIME = 0.015
"""Duration of readings without contact before its loss is detected [s]."""

RELEASE_BY = 0.35
"""Share of a swing by which a sensor must have lost contact, or it is ignored for the rest of the
swing."""

HIT_BY = 0.65
"""Share of a swing before which a contact is an obstacle."""


@compiled
def estimate_contact(
    state: State,
    estimator: EstimatorState,
    parameters: EstimatorParameters,
    measured: Measurements,
) -> bool:
    """Estimate the contact of all feet; return whether a sensor has failed or recovered."""
    read_sensors(state, estimator, parameters, measured)
    event = detect_sensor_faults(estimator, parameters)
    event = detect_contact(estimator, parameters) or event
    if event or estimator.updates == 1:
        select_sensors(estimator, parameters)
    return event


@compiled
def read_sensors(
    state: State,
    estimator: EstimatorState,
    parameters: EstimatorParameters,
    measured: Measurements,
) -> None:
    """Write the readings of all contact sensors."""
    targets = estimator.joint_targets[estimator.updates % parameters.joint_delay]
    delayed = estimator.updates >= parameters.joint_delay
    estimator.updates += 1
    for leg in range(parameters.leg_count):
        sensors, q = estimator.feet[leg].sensors, measured.joint_position[leg]
        load_force = angle_force = math.nan
        if estimator.used[SensorKind.LOAD] != 0:
            torque = parameters.full_torque[leg] * measured.joint_load[leg]
            load_force = normal_force(parameters, leg, q, torque)
        elif estimator.used[SensorKind.ANGLE] != 0 and delayed:
            torque = parameters.stiffness[leg] * (targets[leg] - q)
            angle_force = normal_force(parameters, leg, q, torque)
        sensors[SensorKind.SWITCH].reading = measured.contact[leg]
        sensors[SensorKind.FORCE].reading = measured.foot_normal_force[leg]
        sensors[SensorKind.LOAD].reading = load_force
        sensors[SensorKind.ANGLE].reading = angle_force
        targets[leg] = state.q[leg]


@compiled
def select_sensors(estimator: EstimatorState, parameters: EstimatorParameters) -> None:
    """Use joint loads and angles only while a foot has no working switch or force sensor."""
    needed = False
    for leg in range(parameters.leg_count):
        works = False
        for kind in (SensorKind.SWITCH, SensorKind.FORCE):
            sensor = estimator.feet[leg].sensors[kind]
            alive = sensor.distrusted == 0 and sensor.silence < DEAD_TIME
            works = works or (alive and estimator.available[kind] != 0)
        needed = needed or not works
    for kind in (SensorKind.LOAD, SensorKind.ANGLE):
        estimator.used[kind] = estimator.available[kind] if needed else 0


@compiled
def detect_contact(estimator: EstimatorState, parameters: EstimatorParameters) -> bool:
    """Debounce the readings of the best trusted sensor of each foot.

    A sensor that has not left the ground early in a swing is ignored for the rest of it: it is
    stuck, or the foot drags, and neither shows when the foot lands.

    Returns:
        Whether a sensor has died or recovered.
    """
    event = False
    for leg in range(parameters.leg_count):
        foot = estimator.feet[leg]
        foot.was_standing = foot.standing
        evidence = -1
        for kind in range(len(foot.sensors)):
            if estimator.used[kind] == 0:
                continue
            sensor = foot.sensors[kind]
            event = update_sensor(parameters, foot, sensor, kind) or event
            valid = foot.standing != 0 or foot.swing_progress < RELEASE_BY
            valid = valid or sensor.air_time >= RELEASE_TIME
            alive = sensor.silence <= DEAD_TIME and sensor.distrusted == 0
            if evidence < 0 and alive and valid:
                evidence = sensor.contact
        if evidence == foot.contact:
            foot.contradiction_time = 0.0
        elif evidence < 0 or foot.contact < 0:
            # Unknown contact, and the first evidence after it, count at once.
            foot.contact = evidence
            foot.contradiction_time = 0.0
        else:
            foot.contradiction_time += parameters.dt
            # Half a nanosecond: a sum of time steps may end just short of its time.
            released = foot.contradiction_time >= RELEASE_TIME - 5e-10
            if evidence == Contact.GROUND or released:
                foot.contact = evidence
                foot.contradiction_time = 0.0
        count_hits(foot)
    return event


@compiled
def update_sensor(
    parameters: EstimatorParameters,
    foot: FootEstimate,
    sensor: ContactSensor,
    kind: int,
) -> bool:
    """Take a reading into a sensor's indication and statistics.

    Returns:
        Whether the sensor has died or recovered.
    """
    silence = sensor.silence
    if not math.isfinite(sensor.reading):
        # For a moment the last indication stands.
        sensor.silence = silence + parameters.dt
        if silence <= DEAD_TIME < sensor.silence:
            sensor.event = SensorEvent.DEAD
            return True
        return False
    sensor.silence = 0.0
    before = sensor.contact
    if sensor.reading >= parameters.contact_on[kind]:
        sensor.contact = 1
    elif sensor.reading < parameters.contact_off[kind]:
        sensor.contact = 0
    if foot.standing != 0:
        sensor.stance_count += 1
        sensor.stance_contacts += sensor.contact
    elif MID_SWING[0] <= foot.swing_progress < MID_SWING[1]:
        sensor.swing_count += 1
        sensor.swing_contacts += sensor.contact
        sensor.swing_changes += abs(sensor.contact - before)
    if sensor.contact == 0:
        sensor.air_time += parameters.dt
    if silence > DEAD_TIME:
        sensor.event = SensorEvent.RECOVERED
        return True
    return False


@compiled
def count_hits(foot: FootEstimate) -> None:
    """Count contacts in mid-swing, between which the foot has left the ground."""
    progress = foot.swing_progress
    if foot.contact == Contact.AIR and foot.standing == 0 and progress > SCUFF:
        foot.left_ground = 1
    elif foot.contact == Contact.GROUND and foot.left_ground != 0 and CLEAR <= progress < HIT_BY:
        foot.obstacle_hits += 1
        foot.left_ground = 0


@compiled
def detect_sensor_faults(estimator: EstimatorState, parameters: EstimatorParameters) -> bool:
    """Judge the sensors of feet that lift off now, by their last swing and stance.

    Returns:
        Whether the trust in a sensor has changed.
    """
    event = False
    for leg in range(parameters.leg_count):
        foot = estimator.feet[leg]
        if foot.standing != 0 or foot.was_standing == 0:
            continue
        foot.left_ground = foot.obstacle_hits = 0
        for kind in range(len(foot.sensors)):
            sensor = foot.sensors[kind]
            fault = sensor_fault(sensor)
            judged = sensor.swing_count >= FEWEST or sensor.stance_count >= FEWEST
            sensor.swing_count = sensor.swing_contacts = sensor.swing_changes = 0
            sensor.stance_count = sensor.stance_contacts = 0
            sensor.air_time = 0.0
            if fault != SensorEvent.NONE:
                sensor.fault_score = min(sensor.fault_score + 1.0, 2 * IMPLAUSIBLE_STEPS)
                if sensor.distrusted == 0 and sensor.fault_score >= IMPLAUSIBLE_STEPS:
                    sensor.distrusted = 1
                    sensor.event = fault
                    event = True
            elif judged:
                sensor.fault_score = max(sensor.fault_score - RECOVERY, 0.0)
                if sensor.distrusted != 0 and sensor.fault_score <= 0.0:
                    sensor.distrusted = 0
                    sensor.event = SensorEvent.RECOVERED
                    event = True
    return event


@compiled
def sensor_fault(sensor: ContactSensor) -> int:
    """Return the `SensorEvent` of a fault in the last swing and stance."""
    if sensor.swing_count >= FEWEST and sensor.swing_contacts >= SURE * sensor.swing_count:
        return SensorEvent.STUCK_ON
    if sensor.swing_changes > MOST_CHANGES:
        return SensorEvent.FLICKERING
    if sensor.stance_count >= FEWEST and sensor.stance_contacts <= (1 - SURE) * sensor.stance_count:
        return SensorEvent.STUCK_OFF
    return SensorEvent.NONE
