"""What a controller knows of the ground by its senses, from update to update."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Shaped

from phasmid.compiled import internal
from phasmid.control.estimation.admittance import give_way, share_weight
from phasmid.control.estimation.attitude import NONE, estimate_attitude
from phasmid.control.estimation.body_levelling import CORRECTION, RISE, level_body
from phasmid.control.estimation.contact import (
    DEAD_TIME,
    DOUBTED,
    SILENCE,
    detect_contact,
    detect_sensor_faults,
)
from phasmid.control.estimation.foot_force import foot_forces
from phasmid.control.estimation.ground_plane import HEIGHT, fit_plane
from phasmid.control.estimation.joint_compliance import fit_joint_compliance
from phasmid.control.estimation.state import (
    ANGLE,
    FORCE,
    JOINTS_HEARD,
    LAG,
    LATE,
    LOAD,
    SOURCE,
    SWITCH,
    UPDATES,
    EstimatorParameters,
    EstimatorState,
)
from phasmid.units import STANDARD_GRAVITY

SENSOR_NEWS, ATTITUDE_NEWS = 1, 2
"""What is new: something of a foot's sensor, or what tells of the body's attitude; or both."""


class Intent(NamedTuple):
    """What a controller has asked of the robot until now.

    Attributes:
        standing: Which feet stand by the plan, 1 or 0, shape (L,).
        progress: Share of its swing that each foot has done, shape (L,).
        p_odom_foot: Where the feet are, or were set down [m], shape (L, 3).
        p_odom_path: The place above which the body walks; its x and y are used [m], shape (2+,).
        p_odom_body: The body's origin [m], shape (3,).
        R_odom_body: Its attitude, shape (3, 3).
        R_odom_path: The axes of the path, in which corrections are told, shape (3, 3).
        joint_position: Angles that the joints shall have [rad], shape (L, 3).
        walking: Whether a foot swings or the body moves.
    """

    standing: Shaped[np.ndarray, " legs"]
    progress: Float[np.ndarray, " legs"]
    p_odom_foot: Float[np.ndarray, "legs 3"]
    p_odom_path: Float[np.ndarray, " place"]
    p_odom_body: Float[np.ndarray, "3"]
    R_odom_body: Float[np.ndarray, "3 3"]
    R_odom_path: Float[np.ndarray, "3 3"]
    joint_position: Float[np.ndarray, "legs 3"]
    walking: bool


@internal
def feel(senses: EstimatorState, tuning: EstimatorParameters, intent: Intent) -> int:
    """Make out of what is told what is felt now.

    Args:
        senses: What is told, and what is remembered and felt, which is changed.
        tuning: Thresholds, time constants and limits.
        intent: What was asked of the robot until now.

    Returns:
        What is new: the sum of `SENSOR_NEWS`, for which `news` is to be read and cleared,
        and `ATTITUDE_NEWS`.
    """
    told = SENSOR_NEWS if feel_feet(senses, tuning, intent) else 0
    if feel_attitude_of(senses, tuning, intent):
        told += ATTITUDE_NEWS
    feel_ground_and_body(senses, tuning, intent)
    if tuning.admittance != 0.0:
        give_feet_way(senses, tuning, intent)
    return told


@internal
def feel_feet(senses: EstimatorState, tuning: EstimatorParameters, intent: Intent) -> bool:
    """Write which feet are on the ground; whether there is news of a sensor."""
    count, reading, present, heard = senses.counts, senses.reading, senses.present, senses.heard
    reading[SWITCH] = senses.contact
    reading[FORCE] = senses.normal_force
    row = count[UPDATES] % count[LATE]
    count[UPDATES] += 1
    if count[JOINTS_HEARD] != 0:
        # Angles that do not give way tell nothing; they are heard where loads are not told.
        if present[LOAD] != 0:
            torque = tuning.stall_torque * senses.joint_load
            find_forces(senses, tuning, torque, reading[LOAD])
        elif count[UPDATES] > count[LATE]:
            torque = tuning.stiffness * (senses.past[row] - senses.joint_position)
            find_forces(senses, tuning, torque, reading[ANGLE])
    else:
        reading[LOAD:] = math.nan
    senses.past[row] = intent.joint_position
    told, changes = 0, False
    for leg in range(len(intent.standing)):
        changes = changes or senses.stood_before[leg] != intent.standing[leg]
        senses.stood_before[leg] = intent.standing[leg]
    if changes:
        told = detect_sensor_faults(
            intent.standing, tuning.implausible_steps, senses.sensors, senses.legs, senses.news
        )
    told += detect_contact(
        tuning.dt,
        reading,
        tuning.threshold,
        heard,
        intent.standing,
        intent.progress,
        tuning.touch,
        senses.sensors,
        senses.legs,
        senses.touch,
        senses.news,
    )
    if told or count[UPDATES] == 1:
        # While a switch or a force sensor is heard at every foot, joints need not be.
        needed = False
        for leg in range(len(intent.standing)):
            good = False
            for s in (SWITCH, FORCE):
                memory = senses.sensors[leg, s]
                lives = memory[DOUBTED] < 0.5 and memory[SILENCE] < tuning.touch[DEAD_TIME]
                good = good or (lives and present[s] != 0)
            needed = needed or not good
        for s in (LOAD, ANGLE):
            heard[s] = present[s] if needed else 0
        # Feet that give way need to know by how much, which a switch does not tell.
        gives_way = tuning.admittance != 0.0 and present[FORCE] == 0 and present[LOAD] != 0
        count[JOINTS_HEARD] = 1 if needed or gives_way else 0
    return told > 0


@internal
def find_forces(
    senses: EstimatorState, tuning: EstimatorParameters, torque: np.ndarray, force: np.ndarray
) -> None:
    """Write what each foot carries by its joints' torques."""
    lengths, mass, com = tuning.lengths, tuning.mass, tuning.com
    foot_forces(senses.joint_position, torque, lengths, mass, com, STANDARD_GRAVITY, force)


@internal
def feel_attitude_of(senses: EstimatorState, tuning: EstimatorParameters, intent: Intent) -> bool:
    """Write where up is; whether it is known by something else than before."""
    source = estimate_attitude(
        tuning.dt,
        STANDARD_GRAVITY,
        senses.orientation,
        senses.angular_velocity,
        senses.acceleration,
        not intent.walking,
        tuning.attitude,
        senses.attitude,
        senses.up,
    )
    before = senses.counts[SOURCE]
    senses.counts[SOURCE] = source
    return source != before and (before >= 0 or source == NONE)


@internal
def feel_ground_and_body(
    senses: EstimatorState, tuning: EstimatorParameters, intent: Intent
) -> None:
    """Write the ground's plane, how far the legs give way, and the body's corrections."""
    count, standing, bearing = senses.counts, intent.standing, senses.bearing
    for leg in range(len(standing)):
        # A foot that stands on nothing tells nothing of the ground.
        airy = count[UPDATES] > 1 and senses.touch[leg] == 0
        bearing[leg] = 0 if airy else standing[leg]
    fit_plane(
        tuning.dt,
        intent.p_odom_foot,
        bearing,
        intent.p_odom_path,
        tuning.forgetting_time,
        tuning.plane_spread,
        tuning.plane_rate,
        tuning.plane_time,
        senses.stood,
        senses.planes,
    )
    plane = senses.planes[2]
    if math.isnan(plane[HEIGHT]):
        # No foot has stood yet.
        senses.planes[:] = 0.0
    # What the body does now was asked a while ago.
    row = count[UPDATES] % count[LAG]
    if count[UPDATES] == 1:
        for k in range(count[LAG]):
            senses.turned[k] = intent.R_odom_body
    senses.turned[row] = intent.R_odom_body
    level_body(
        tuning.dt,
        count[SOURCE] != NONE,
        senses.up,
        senses.turned[(row + 1) % count[LAG]],
        intent.R_odom_path,
        plane,
        intent.p_odom_body[2] - plane[HEIGHT],
        tuning.level,
        senses.level,
    )
    sunk = fit_joint_compliance(
        intent.joint_position,
        senses.joint_position,
        tuning.lengths,
        standing,
        bearing,
        intent.p_odom_foot,
        senses.sag,
    )
    senses.sunk[0] += min(tuning.dt / tuning.height_time, 1.0) * (sunk - senses.sunk[0])
    senses.correction[:] = senses.level[CORRECTION]
    senses.correction[RISE] += min(max(senses.sunk[0], 0.0), tuning.height_limit)


@internal
def give_feet_way(senses: EstimatorState, tuning: EstimatorParameters, intent: Intent) -> None:
    """Write by how much the feet give way to what they carry."""
    measured = senses.reading[FORCE if senses.present[FORCE] != 0 else LOAD]
    share_weight(
        tuning.weight, intent.p_odom_body, intent.p_odom_foot, intent.standing, senses.wanted
    )
    give_way(
        measured,
        senses.wanted,
        intent.standing,
        tuning.swing_law,
        tuning.stance_law,
        tuning.admittance_limit,
        senses.give,
    )
