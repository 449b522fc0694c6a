"""Attitude of the body against gravity, from gyro, accelerometer and orientation sensor."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled
from phasmid.control.estimation.state import (
    AttitudeEstimate,
    AttitudeSource,
    EstimatorParameters,
    Measurements,
)

MOST_RATE = 8.0
"""Largest plausible angular velocity of a walking robot [rad/s]."""

MOST_EXCESS = 0.3
"""Largest relative difference of the specific force from one g at which it shows where up is."""

ORIENTATION_TIME, ACCELEROMETER_TIME = 0.02, 1.0
"""Time constants of the corrections by orientation sensor and accelerometer [s]."""

BIAS_TIME = 3.0
"""Time constant of the gyro's bias while the robot stands [s]."""

GATE = math.radians(20)
"""Largest angle between an orientation reading that is used and the estimate [rad]."""

DISAGREEMENT_TIME = 0.5
"""Duration for which inertial sensors may contradict each other, or one may be frozen while the
robot walks, before they are distrusted [s]."""


@compiled
def estimate_attitude(
    measured: Measurements,
    still: bool,
    attitude: AttitudeEstimate,
    parameters: EstimatorParameters,
) -> None:
    """Estimate the direction of up by complementary filters on the sphere.

    The gyro integrates u' = u x w; the orientation sensor, or else the accelerometer, corrects u
    with a time constant, so that the loss of a sensor causes no jump. A second filter uses gyro and
    accelerometer alone. Where the two disagree for long a sensor is faulty, and none is trusted.

    Source: Mahony, Hamel, Pflimlin, "Nonlinear complementary filters on the special orthogonal
    group", 2008, for one direction.
    """
    dt = parameters.dt
    up, inertial_up, bias = attitude.filtered_up, attitude.inertial_up, attitude.gyro_bias
    gyro, force, q = measured.angular_velocity, measured.acceleration, measured.orientation
    w, x, y, z = q[0], q[1], q[2], q[3]
    square, specific = q @ q, math.sqrt(force @ force)
    # Comparisons with NaN are false.
    has_orientation = abs(math.sqrt(square) - 1.0) < 0.1
    has_gyro = math.sqrt(gyro @ gyro) < MOST_RATE
    has_force = abs(specific / parameters.gravity - 1) < MOST_EXCESS
    oriented, plumb = np.zeros(3), np.zeros(3)
    if has_orientation:
        oriented[:] = 2 * (x * z - w * y), 2 * (y * z + w * x), square - 2 * (x * x + y * y)
        oriented /= square
    if has_force:
        plumb[:] = force / specific
    if attitude.started == 0:
        attitude.up[:] = 0.0, 0.0, 1.0
        if not (has_orientation or has_force):
            return
        attitude.started = 1
        inertial_up[:] = plumb if has_force else oriented
        up[:] = oriented if has_orientation else plumb
    # An orientation that never changes while the robot walks is frozen.
    same = has_orientation and (q == attitude.orientation).all()
    attitude.frozen_time = attitude.frozen_time + dt if same and not still else 0.0
    attitude.orientation[:] = q
    rate = np.zeros(3)
    if has_gyro:
        if still:
            bias += dt / BIAS_TIME * (gyro - bias)
        rate[:] = gyro - bias
    up += dt * np.cross(up, rate)
    inertial_up += dt * np.cross(inertial_up, rate)
    slow = -math.expm1(-dt / ACCELEROMETER_TIME)
    if has_force:
        inertial_up += slow * (plumb - inertial_up)
    gate = math.cos(GATE)
    attitude.source = AttitudeSource.NONE
    if has_orientation and oriented @ up > gate and attitude.frozen_time < DISAGREEMENT_TIME:
        attitude.source = AttitudeSource.ORIENTATION
        up += -math.expm1(-dt / ORIENTATION_TIME) * (oriented - up)
    elif has_force or has_gyro:
        attitude.source = AttitudeSource.ACCELEROMETER
        up += slow * (inertial_up - up)
    up /= math.sqrt(up @ up)
    inertial_up /= math.sqrt(inertial_up @ inertial_up)
    # Without an accelerometer the second filter drifts and proves nothing.
    attitude.accelerometer_silence = 0.0 if has_force else attitude.accelerometer_silence + dt
    silence = attitude.accelerometer_silence
    disagrees = silence < ACCELEROMETER_TIME and up @ inertial_up < gate
    attitude.disagreement_time = min(
        max(attitude.disagreement_time + (dt if disagrees else -dt / 4), 0.0),
        2 * DISAGREEMENT_TIME,
    )
    drifts = silence > 2 * ACCELEROMETER_TIME
    if attitude.disagreement_time > DISAGREEMENT_TIME or (
        attitude.source == AttitudeSource.ACCELEROMETER and drifts
    ):
        attitude.source = AttitudeSource.NONE
    attitude.up[:] = up + parameters.imu_delay * np.cross(up, rate)
    attitude.up /= math.sqrt(attitude.up @ attitude.up)
