"""Kalman filter of the body's motion: inertial sensors predict it, feet that stand correct it.

`body_state.BodyStateEstimator` writes the measurements and calls `update_body_state`.

The error state holds position, velocity, attitude, biases of accelerometer and gyro, heading of
the orientation sensor, and the position of each foot. All its vectors are in odom; the attitude's
error is a rotation about axes of odom.

Source: Bloesch, Hutter, Hoepflinger, Leutenegger, Gehring, Remy, Siegwart, "State Estimation for
Legged Robots: Consistent Fusion of Leg Kinematics and IMU", RSS 2012.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from phasmid.compiled import compiled
from phasmid.control.estimation.leg_statics import normal_force
from phasmid.control.estimation.state import EstimatorParameters, Measurements, SensorKind
from phasmid.control.records import record_of
from phasmid.control.types import Contact
from phasmid.control.vectors import cross, rotate
from phasmid.kinematics.leg_kernels import forward_kinematics, sincos

POSITION, VELOCITY, ATTITUDE, FORCE_BIAS, RATE_BIAS, HEADING, FEET = 0, 3, 6, 9, 12, 15, 16
"""First components of the error state."""

INITIAL_TILT, INITIAL_FORCE_BIAS, INITIAL_RATE_BIAS = math.radians(1), 0.1, math.radians(0.3)
"""Standard deviations at the start: roll and pitch [rad], biases [m/s²] and [rad/s]."""

FORCE_BIAS_WALK, RATE_BIAS_WALK = 1e-3, 1e-5
"""Random walk of the biases [m/s²/√s] and [rad/s/√s]."""

UNKNOWN_FORCE, UNKNOWN_RATE = 0.3, 0.1
"""Noise of acceleration [m/s²/√Hz] and angular velocity [rad/s/√Hz] without their sensors."""

MOST_RATE, MOST_FORCE = 8.0, 50.0
"""Largest plausible angular velocity [rad/s] and specific force [m/s²] of a walking robot."""

READING_TIME = 0.02
"""Time after which joint angles that have not changed count as a new reading [s]."""

HEADING_TIME = 0.5
"""Time after which an orientation sensor that contradicts the estimate gets a new heading [s]."""

REST_TIME, REST_DISTANCE = 0.06, 0.003
"""A foot that has slipped counts as standing again if it moves no farther [m] in this time [s]."""

STILL_TIME, STILL_SPEED = 0.5, 0.05
"""Time without a standing foot after which the body counts as at rest [s], and its standard
deviation [m/s]."""

NEVER = -1.0
"""Rest time of a foot that is not observed for its rest."""


@dataclass(eq=False)
class FilterState:
    """State of the filter."""

    position: Float[np.ndarray, "3"]  # origin of the body frame in odom [m]
    velocity: Float[np.ndarray, "3"]  # in odom [m/s]
    R_odom_body: Float[np.ndarray, "3 3"]
    orientation: Float[np.ndarray, "4"]  # the same, w x y z
    force_bias: Float[np.ndarray, "3"]  # of the accelerometer, body axes [m/s²]
    rate_bias: Float[np.ndarray, "3"]  # of the gyro, body axes [rad/s]
    heading: float  # yaw of the orientation sensor's world seen from odom [rad]
    feet: Float[np.ndarray, "legs 3"]  # in odom [m]
    covariance: Float[np.ndarray, "40 40"]  # of the error state
    foothold: Int[np.ndarray, " legs"]  # 1 for feet in the error state
    spread: Float[np.ndarray, "legs legs 3"]  # between feet in odom, when the later one landed [m]
    slipping: Int[np.ndarray, " legs"]  # 1 for feet in contact that move
    contact: Int[np.ndarray, " legs"]  # Contact
    contact_time: Float[np.ndarray, " legs"]  # since touchdown [s]
    rest_time: Float[np.ndarray, " legs"]  # for which a foot is observed [s]; NEVER: it is not
    rest_position: Float[np.ndarray, "legs 3"]  # in odom where that began [m]
    joint_position: Float[np.ndarray, "legs 3"]  # last reading [rad]
    reading_time: float  # since that reading [s]
    orientation_reading: Float[np.ndarray, "4"]  # last one of the orientation sensor
    contradiction_time: float  # for which it has contradicted the estimate [s]
    has_heading: int  # 1 once the orientation sensor's heading is known
    flight_time: float  # without a standing foot [s]
    started: int  # 1 after the first update


@dataclass(eq=False)
class FilterParameters:
    """Robot and noise of the filter."""

    R_body_hip: Float[np.ndarray, "legs 3 3"]
    p_body_hip: Float[np.ndarray, "legs 3"]  # [m]
    gravity: float  # [m/s²]
    force_noise: float  # of the accelerometer [m/s²/√Hz]
    rate_noise: float  # of the gyro [rad/s/√Hz]
    orientation_noise: float  # of one orientation reading [rad]
    heading_walk: float  # random walk of its heading [rad/√s]
    foot_noise: float  # of a foot's position by joint angles [m]
    creep: float  # random walk of a standing foot [m/√s]
    gate: float  # largest Mahalanobis distance of an innovation
    settling_time: float  # from touchdown until a foot is used [s]


FILTER_STATE, FILTER_PARAMETERS = record_of(FilterState), record_of(FilterParameters)


@compiled
def update_body_state(
    state: FilterState,
    parameters: FilterParameters,
    robot: EstimatorParameters,
    measured: Measurements,
) -> None:
    """Advance the filter by one update period.

    Args:
        state: Changed.
        parameters: Noise, and hips of the robot.
        robot: Robot, update period, and thresholds of contact.
        measured: Sensor readings.
    """
    feet = np.empty((robot.leg_count, 3))
    for leg in range(robot.leg_count):
        q, lengths = measured.joint_position[leg], robot.lengths[leg]
        foot = np.array(forward_kinematics(lengths, lengths[3], q[0], q[1], q[2]))
        feet[leg] = parameters.p_body_hip[leg] + rotate(parameters.R_body_hip[leg], foot)
    detect_contacts(state, robot, measured)
    if state.started == 0:
        start(state, parameters, robot, measured, feet)
    else:
        predict(state, parameters, robot, measured)
    correct_attitude(state, parameters, robot, measured)
    state.reading_time += robot.dt
    changed = False
    for leg in range(robot.leg_count):
        for joint in range(3):
            q = measured.joint_position[leg, joint]
            changed = changed or (q != state.joint_position[leg, joint] and math.isfinite(q))
            state.joint_position[leg, joint] = q
    if changed or state.reading_time > READING_TIME - 1e-9:
        correct_by_feet(state, parameters, robot, feet)
        state.reading_time = 0.0
    write_orientation(state)


@compiled
def start(
    state: FilterState,
    parameters: FilterParameters,
    robot: EstimatorParameters,
    measured: Measurements,
    feet: np.ndarray,
) -> None:
    """Begin at rest over the feet, with yaw zero, upright as far as the sensors show."""
    up = np.array([0.0, 0.0, 1.0])
    if is_orientation(measured.orientation):
        up[:] = orientation_matrix(measured.orientation)[2]
    elif is_below(measured.acceleration, MOST_FORCE):
        force = math.sqrt(measured.acceleration @ measured.acceleration)
        if force > 0.0:
            up[:] = measured.acceleration / force
    pitch, roll = -math.asin(min(max(up[0], -1.0), 1.0)), math.atan2(up[1], up[2])
    (sr, cr), (sp, cp) = sincos(roll), sincos(pitch)
    state.R_odom_body[0] = cp, sp * sr, sp * cr
    state.R_odom_body[1] = 0.0, cr, -sr
    state.R_odom_body[2] = -sp, cp * sr, cp * cr
    height, count = 0.0, 0
    for leg in range(robot.leg_count):
        z = state.R_odom_body[2] @ feet[leg]
        if math.isfinite(z):
            height, count = height - z, count + 1
    state.position[2] = height / max(count, 1)
    P = state.covariance
    for k in range(3):
        P[VELOCITY + k, VELOCITY + k] = STILL_SPEED**2
        P[FORCE_BIAS + k, FORCE_BIAS + k] = INITIAL_FORCE_BIAS**2
        P[RATE_BIAS + k, RATE_BIAS + k] = INITIAL_RATE_BIAS**2
    for k in range(2):
        P[ATTITUDE + k, ATTITUDE + k] = INITIAL_TILT**2
    state.contact_time[:] = parameters.settling_time
    state.started = 1


# Contact ------------------------------------------------------------------------------------------


@compiled
def detect_contacts(state: FilterState, robot: EstimatorParameters, measured: Measurements) -> None:
    """Detect contact by the first of switch, force and joint load that has a reading."""
    for leg in range(robot.leg_count):
        kind, reading = SensorKind.SWITCH, measured.contact[leg]
        if not math.isfinite(reading):
            kind, reading = SensorKind.FORCE, measured.foot_normal_force[leg]
        if not math.isfinite(reading) and math.isfinite(measured.joint_load[leg].sum()):
            torque = robot.full_torque[leg] * measured.joint_load[leg]
            kind = SensorKind.LOAD
            reading = normal_force(robot, leg, measured.joint_position[leg], torque)
        if not math.isfinite(reading):
            state.contact[leg] = Contact.UNKNOWN
        elif reading >= robot.contact_on[kind]:
            state.contact[leg] = Contact.GROUND
        elif reading < robot.contact_off[kind] or state.contact[leg] == Contact.UNKNOWN:
            state.contact[leg] = Contact.AIR
        on_ground = state.contact[leg] != Contact.AIR
        state.contact_time[leg] = state.contact_time[leg] + robot.dt if on_ground else 0.0


# Prediction ---------------------------------------------------------------------------------------


@compiled
def predict(
    state: FilterState,
    parameters: FilterParameters,
    robot: EstimatorParameters,
    measured: Measurements,
) -> None:
    """Integrate the inertial sensors, and let the covariance grow.

    p' = v, v' = R (a - b_a) + g, R' = R [w - b_w]x. Without a sensor its quantity is zero with a
    larger noise.
    """
    dt, P, R = robot.dt, state.covariance, state.R_odom_body
    n = FEET + 3 * robot.leg_count
    has_force = is_below(measured.acceleration, MOST_FORCE)
    has_rate = is_below(measured.angular_velocity, MOST_RATE)
    force, turn = np.zeros(3), np.zeros(3)
    if has_rate:
        turn[:] = rotate(R, dt * (measured.angular_velocity - state.rate_bias))
    if has_force:
        force[:] = rotate(R, measured.acceleration - state.force_bias)
        # At half the turn of this period.
        force += 0.5 * cross(turn, force)
        gained = dt * force
        gained[2] -= dt * parameters.gravity
        state.position += dt * (state.velocity + 0.5 * gained)
        state.velocity += gained
    else:
        state.position += dt * state.velocity
    # P <- F P F' as F (F P)'; each block of rows needs the old values of those after it.
    for _ in range(2):
        for j in range(n):
            a, b, c = dt * P[ATTITUDE, j], dt * P[ATTITUDE + 1, j], dt * P[ATTITUDE + 2, j]
            u, v, w = dt * P[FORCE_BIAS, j], dt * P[FORCE_BIAS + 1, j], dt * P[FORCE_BIAS + 2, j]
            x, y, z = dt * P[RATE_BIAS, j], dt * P[RATE_BIAS + 1, j], dt * P[RATE_BIAS + 2, j]
            for k in range(3):
                P[POSITION + k, j] += dt * P[VELOCITY + k, j]
                if has_force:
                    P[VELOCITY + k, j] -= R[k, 0] * u + R[k, 1] * v + R[k, 2] * w
                if has_rate:
                    P[ATTITUDE + k, j] -= R[k, 0] * x + R[k, 1] * y + R[k, 2] * z
            P[VELOCITY, j] += b * force[2] - c * force[1]
            P[VELOCITY + 1, j] += c * force[0] - a * force[2]
            P[VELOCITY + 2, j] += a * force[1] - b * force[0]
        transpose(P, n)
    force_noise = parameters.force_noise if has_force else UNKNOWN_FORCE
    rate_noise = parameters.rate_noise if has_rate else UNKNOWN_RATE
    for k in range(3):
        P[VELOCITY + k, VELOCITY + k] += force_noise**2 * dt
        P[ATTITUDE + k, ATTITUDE + k] += rate_noise**2 * dt
        P[FORCE_BIAS + k, FORCE_BIAS + k] += FORCE_BIAS_WALK**2 * dt
        P[RATE_BIAS + k, RATE_BIAS + k] += RATE_BIAS_WALK**2 * dt
    P[HEADING, HEADING] += parameters.heading_walk**2 * dt
    for leg in range(robot.leg_count):
        if state.foothold[leg] != 0:
            for k in range(FEET + 3 * leg, FEET + 3 * leg + 3):
                P[k, k] += parameters.creep**2 * dt
    turn_body(state, turn)


# Corrections --------------------------------------------------------------------------------------


@compiled
def correct_attitude(
    state: FilterState,
    parameters: FilterParameters,
    robot: EstimatorParameters,
    measured: Measurements,
) -> None:
    """Correct the attitude by a new reading of the orientation sensor.

    Its world is turned against odom by a heading that is a part of the state, since yaw may drift.
    The first reading, and one after a lasting contradiction, determine the heading alone.
    """
    q, P = measured.orientation, state.covariance
    if not is_orientation(q) or (q == state.orientation_reading).all():
        return
    state.orientation_reading[:] = q
    E = orientation_matrix(q) @ state.R_odom_body.T
    noise = parameters.orientation_noise**2
    if state.has_heading == 0:
        state.heading = math.atan2(E[1, 0] - E[0, 1], E[0, 0] + E[1, 1])
        n = FEET + 3 * robot.leg_count
        P[HEADING, :n] = -P[ATTITUDE + 2, :n]
        P[:n, HEADING] = P[HEADING, :n]
        P[HEADING, HEADING] = P[ATTITUDE + 2, ATTITUDE + 2] + noise
        state.has_heading, state.contradiction_time = 1, 0.0
    c, s = math.cos(state.heading), math.sin(state.heading)
    E = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ E
    innovation = 0.5 * np.array([E[2, 1] - E[1, 2], E[0, 2] - E[2, 0], E[1, 0] - E[0, 1]])
    H = np.zeros((3, 4))
    H[0, 0] = H[1, 1] = H[2, 2] = H[2, 3] = 1.0
    columns = np.array([ATTITUDE, ATTITUDE + 1, ATTITUDE + 2, HEADING])
    if correct(state, parameters, robot, innovation, H, columns, noise):
        state.contradiction_time = 0.0
    else:
        state.contradiction_time += robot.dt
        if state.contradiction_time > HEADING_TIME:
            state.has_heading = 0


@compiled
def correct_by_feet(
    state: FilterState,
    parameters: FilterParameters,
    robot: EstimatorParameters,
    feet: np.ndarray,
) -> None:
    """Correct the state by the feet that stand, beginning with those that fit the prediction.

    A foot's innovation is R s - (f - p), with its position s in the body frame and f in odom. Each
    foot that is used narrows the gate for the next, so that a foot must agree with the others. A
    foot beyond the gate slips, as does one that has moved against the others. It is left out until
    it rests. Feet that have touched down get their positions in odom from the corrected body.

    Args:
        state: Changed.
        parameters: Noise and gate.
        robot: The robot.
        feet: Feet by joint angles, body frame [m], shape (L, 3).
    """
    legs, R, reading_time = robot.leg_count, state.R_odom_body, state.reading_time
    distance = np.full(legs, math.inf)
    slipped = slipped_foot(state, parameters, robot, feet)
    while slipped >= 0:
        leave_out(state, robot, slipped, feet[slipped])
        slipped = slipped_foot(state, parameters, robot, feet)
    for leg in range(legs):
        if state.contact[leg] == Contact.AIR:
            lift(state, robot, leg)
            state.slipping[leg], state.rest_time[leg] = 0, NEVER
        if state.foothold[leg] != 0 and math.isfinite(feet[leg].sum()):
            d = state.feet[leg] - state.position
            distance[leg] = math.sqrt(((rotate(R, feet[leg]) - d) ** 2).sum())
    columns, H = np.empty(9, dtype=np.int64), np.zeros((3, 9))
    noise, standing = parameters.foot_noise**2, 0
    for _ in range(np.isfinite(distance).sum()):
        leg = int(np.argmin(distance))
        distance[leg] = math.inf
        d = state.feet[leg] - state.position
        for k in range(3):
            columns[k], columns[3 + k] = POSITION + k, ATTITUDE + k
            columns[6 + k] = FEET + 3 * leg + k
            H[k, k], H[k, 6 + k] = -1.0, 1.0
        H[0, 4], H[0, 5], H[1, 3] = -d[2], d[1], d[2]
        H[1, 5], H[2, 3], H[2, 4] = -d[0], -d[1], d[0]
        innovation = rotate(R, feet[leg]) - d
        if correct(state, parameters, robot, innovation, H, columns, noise):
            standing += 1
        else:
            leave_out(state, robot, leg, feet[leg])
    for leg in range(legs):
        foot = state.position + rotate(R, feet[leg])
        if state.foothold[leg] != 0 or state.contact[leg] == Contact.AIR:
            continue
        if not math.isfinite(foot.sum()):
            continue
        if state.rest_time[leg] == NEVER:
            rests = state.contact_time[leg] >= parameters.settling_time - 1e-9
        else:
            state.rest_time[leg] += reading_time
            if state.rest_time[leg] < REST_TIME - 1e-9:
                continue
            moved = foot - state.rest_position[leg]
            rests = math.sqrt(moved @ moved) < REST_DISTANCE
            state.rest_time[leg], state.rest_position[leg] = 0.0, foot
        if rests:
            place(state, robot, leg, foot, noise)
            for other in range(legs):
                apart = rotate(R, feet[leg] - feet[other])
                state.spread[leg, other], state.spread[other, leg] = apart, -apart
    state.flight_time = 0.0 if standing > 0 else state.flight_time + reading_time
    if state.flight_time > STILL_TIME:
        # A robot that does not jump lies on its trunk then.
        rest = np.zeros((3, 3))
        rest[0, 0] = rest[1, 1] = rest[2, 2] = 1.0
        at = np.array([VELOCITY, VELOCITY + 1, VELOCITY + 2])
        correct(state, parameters, robot, -state.velocity, rest, at, STILL_SPEED**2)


@compiled
def slipped_foot(
    state: FilterState,
    parameters: FilterParameters,
    robot: EstimatorParameters,
    feet: np.ndarray,
) -> int:
    """Return a foot that has moved against most other feet; -1 without one.

    Feet that stand keep their places to one another, whatever the body does. This shows a slow
    slip, which the innovations of single readings do not. Feet whose contact is unknown may swing
    together, and have no vote.
    """
    limit, most, slipped = parameters.gate * math.sqrt(2.0) * parameters.foot_noise, 0.5, -1
    votes = np.zeros(robot.leg_count, dtype=np.bool_)
    for leg in range(robot.leg_count):
        votes[leg] = state.foothold[leg] != 0 and state.contact[leg] == Contact.GROUND
    for leg in range(robot.leg_count):
        changed, pairs = 0, 0
        for other in range(robot.leg_count):
            if leg == other or not votes[leg] or not votes[other]:
                continue
            apart = rotate(state.R_odom_body, feet[leg] - feet[other])
            change = math.sqrt(((apart - state.spread[leg, other]) ** 2).sum())
            if math.isfinite(change):
                pairs += 1
                changed += 1 if change > limit else 0
        # One pair does not show which of both slips.
        if pairs > 1 and changed > most * pairs:
            most, slipped = changed / pairs, leg
    return slipped


@compiled
def leave_out(state: FilterState, robot: EstimatorParameters, leg: int, foot: np.ndarray) -> None:
    """Take a foot that slips, body frame [m], out of the error state until it rests."""
    lift(state, robot, leg)
    state.slipping[leg], state.rest_time[leg] = 1, 0.0
    state.rest_position[leg] = state.position + rotate(state.R_odom_body, foot)


@compiled
def place(
    state: FilterState, robot: EstimatorParameters, leg: int, foot: np.ndarray, noise: float
) -> None:
    """Take a foot at a position in odom [m] into the error state: df = dp + dR d + n."""
    P, n, first = state.covariance, FEET + 3 * robot.leg_count, FEET + 3 * leg
    d = foot - state.position
    state.feet[leg], state.foothold[leg] = foot, 1
    state.slipping[leg], state.rest_time[leg] = 0, NEVER
    for _ in range(2):
        for j in range(n):
            a, b, c = P[ATTITUDE, j], P[ATTITUDE + 1, j], P[ATTITUDE + 2, j]
            P[first, j] = P[POSITION, j] + b * d[2] - c * d[1]
            P[first + 1, j] = P[POSITION + 1, j] + c * d[0] - a * d[2]
            P[first + 2, j] = P[POSITION + 2, j] + a * d[1] - b * d[0]
        transpose(P, n)
    for k in range(first, first + 3):
        P[k, k] += noise


@compiled
def lift(state: FilterState, robot: EstimatorParameters, leg: int) -> None:
    """Take a foot out of the error state."""
    if state.foothold[leg] == 0:
        return
    state.foothold[leg], first = 0, FEET + 3 * leg
    n = FEET + 3 * robot.leg_count
    state.covariance[first : first + 3, :n] = 0.0
    state.covariance[:n, first : first + 3] = 0.0


@compiled
def correct(
    state: FilterState,
    parameters: FilterParameters,
    robot: EstimatorParameters,
    innovation: np.ndarray,
    H: np.ndarray,
    columns: np.ndarray,
    noise: float,
) -> bool:
    """Correct the state by a vector; return False, and change nothing, beyond the gate.

    Args:
        state: Changed.
        parameters: With the gate.
        robot: The robot.
        innovation: Measured less predicted, shape (3,).
        H: Derivative by the components, shape (3, K).
        columns: Components of the error state that it depends on, shape (K,).
        noise: Variance of each component of the measurement.
    """
    P, n = state.covariance, FEET + 3 * robot.leg_count
    PH, S = np.zeros((n, 3)), np.zeros((3, 3))
    for c in range(len(columns)):
        column = columns[c]
        for k in range(3):
            h = H[k, c]
            if h != 0.0:
                for i in range(n):
                    PH[i, k] += P[column, i] * h
    for c in range(len(columns)):
        for k in range(3):
            for j in range(3):
                S[k, j] += H[k, c] * PH[columns[c], j]
    for k in range(3):
        S[k, k] += noise
    inverse = np.linalg.inv(S)
    if innovation @ (inverse @ innovation) > parameters.gate**2:
        return False
    K, change = np.empty((n, 3)), np.empty(n)
    for i in range(n):
        for k in range(3):
            K[i, k] = PH[i, 0] * inverse[0, k] + PH[i, 1] * inverse[1, k] + PH[i, 2] * inverse[2, k]
        change[i] = K[i, 0] * innovation[0] + K[i, 1] * innovation[1] + K[i, 2] * innovation[2]
    for i in range(n):
        for j in range(i, n):
            P[i, j] -= K[i, 0] * PH[j, 0] + K[i, 1] * PH[j, 1] + K[i, 2] * PH[j, 2]
            P[j, i] = P[i, j]
    state.position += change[POSITION:VELOCITY]
    state.velocity += change[VELOCITY:ATTITUDE]
    state.force_bias += change[FORCE_BIAS:RATE_BIAS]
    state.rate_bias += change[RATE_BIAS:HEADING]
    state.heading += change[HEADING]
    for leg in range(robot.leg_count):
        for k in range(3):
            state.feet[leg, k] += change[FEET + 3 * leg + k]
    turn_body(state, change[ATTITUDE:FORCE_BIAS].copy())
    return True


@compiled
def transpose(P: np.ndarray, n: int) -> None:
    """Transpose the first n rows and columns in place."""
    for i in range(n):
        for j in range(i):
            P[i, j], P[j, i] = P[j, i], P[i, j]


# Rotations ----------------------------------------------------------------------------------------


@compiled
def turn_body(state: FilterState, turn: np.ndarray) -> None:
    """Turn the body about a vector in odom, axis times angle [rad], by Rodrigues' formula."""
    square = turn @ turn
    angle = math.sqrt(square)
    a = math.sin(angle) / angle if angle > 1e-6 else 1.0 - square / 6
    b = (1.0 - math.cos(angle)) / square if angle > 1e-6 else 0.5
    for j in range(3):
        column = state.R_odom_body[:, j].copy()
        first = cross(turn, column)
        state.R_odom_body[:, j] = column + a * first + b * cross(turn, first)


@compiled
def write_orientation(state: FilterState) -> None:
    """Write the body's rotation as a quaternion, by roll, pitch and yaw."""
    R = state.R_odom_body
    roll, yaw = math.atan2(R[2, 1], R[2, 2]), math.atan2(R[1, 0], R[0, 0])
    pitch = -math.asin(min(max(R[2, 0], -1.0), 1.0))
    (sr, cr), (sp, cp), (sy, cy) = sincos(roll / 2), sincos(pitch / 2), sincos(yaw / 2)
    state.orientation[0] = cr * cp * cy + sr * sp * sy
    state.orientation[1] = sr * cp * cy - cr * sp * sy
    state.orientation[2] = cr * sp * cy + sr * cp * sy
    state.orientation[3] = cr * cp * sy - sr * sp * cy


@compiled
def orientation_matrix(q: np.ndarray) -> np.ndarray:
    """Return the rotation of a quaternion, w x y z."""
    w, x, y, z = q / math.sqrt(q @ q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


@compiled
def is_orientation(q: np.ndarray) -> bool:
    """Return whether a reading is a unit quaternion; comparisons with NaN are false."""
    return abs(math.sqrt(q @ q) - 1.0) < 0.1


@compiled
def is_below(vector: np.ndarray, most: float) -> bool:
    """Return whether a vector is finite and shorter than a length."""
    return math.sqrt(vector @ vector) < most
