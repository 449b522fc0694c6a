"""Attitude of the body against gravity, from gyro, accelerometer and orientation sensor."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import internal
from phasmid.control.estimation.state import (
    AttitudeEstimate,
    AttitudeSource,
    EstimatorParameters,
    Measurements,
)
from phasmid.units import STANDARD_GRAVITY

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

Vector = Float[np.ndarray, "3"]


@internal
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
    gyro, force = measured.angular_velocity, measured.acceleration
    q = measured.orientation
    w, x, y, z = q[0], q[1], q[2], q[3]
    size = math.sqrt(w * w + x * x + y * y + z * z)
    has_orientation = abs(size - 1.0) < 0.1
    has_gyro = math.sqrt(gyro[0] ** 2 + gyro[1] ** 2 + gyro[2] ** 2) < MOST_RATE
    specific = math.sqrt(force[0] ** 2 + force[1] ** 2 + force[2] ** 2)
    has_force = abs(specific / STANDARD_GRAVITY - 1) < MOST_EXCESS
    oriented, plumb = np.zeros(3), np.zeros(3)
    if has_orientation:
        oriented[0] = 2 * (x * z - w * y) / (size * size)
        oriented[1] = 2 * (y * z + w * x) / (size * size)
        oriented[2] = 1 - 2 * (x * x + y * y) / (size * size)
    if has_force:
        plumb[:] = force / specific
    if attitude.started == 0:
        attitude.up[0], attitude.up[1], attitude.up[2] = 0.0, 0.0, 1.0
        if not (has_orientation or has_force):
            return
        attitude.started = 1
        inertial_up[:] = plumb if has_force else oriented
        up[:] = oriented if has_orientation else plumb
    # An orientation that never changes while the robot walks is frozen.
    last = attitude.orientation
    same = has_orientation and w == last[0] and x == last[1] and y == last[2] and z == last[3]
    attitude.frozen_time = attitude.frozen_time + dt if same and not still else 0.0
    last[:] = q
    rate = np.zeros(3)
    if has_gyro:
        if still:
            approach(bias, gyro, dt / BIAS_TIME)
        rate[:] = gyro - bias
    rotate(up, rate, dt)
    rotate(inertial_up, rate, dt)
    slow = -math.expm1(-dt / ACCELEROMETER_TIME)
    if has_force:
        approach(inertial_up, plumb, slow)
    gate = math.cos(GATE)
    near = oriented[0] * up[0] + oriented[1] * up[1] + oriented[2] * up[2] > gate
    attitude.source = AttitudeSource.NONE
    if has_orientation and near and attitude.frozen_time < DISAGREEMENT_TIME:
        attitude.source = AttitudeSource.ORIENTATION
        approach(up, oriented, -math.expm1(-dt / ORIENTATION_TIME))
    elif has_force or has_gyro:
        attitude.source = AttitudeSource.ACCELEROMETER
        approach(up, inertial_up, slow)
    normalise(up)
    normalise(inertial_up)
    # Without an accelerometer the second filter drifts and proves nothing.
    attitude.accelerometer_silence = 0.0 if has_force else attitude.accelerometer_silence + dt
    silence = attitude.accelerometer_silence
    agreement = up[0] * inertial_up[0] + up[1] * inertial_up[1] + up[2] * inertial_up[2]
    disagrees = silence < ACCELEROMETER_TIME and agreement < gate
    attitude.disagreement_time = min(
        max(attitude.disagreement_time + (dt if disagrees else -dt / 4), 0.0),
        2 * DISAGREEMENT_TIME,
    )
    drifts = silence > 2 * ACCELEROMETER_TIME
    if attitude.disagreement_time > DISAGREEMENT_TIME or (
        attitude.source == AttitudeSource.ACCELEROMETER and drifts
    ):
        attitude.source = AttitudeSource.NONE
    attitude.up[:] = up
    rotate(attitude.up, rate, parameters.settings.imu_delay)
    normalise(attitude.up)


@internal
def rotate(u: Vector, w: Vector, dt: float) -> None:
    """Integrate u' = u x w by one step of Euler's method."""
    x, y, z = u[0], u[1], u[2]
    u[0] = x + dt * (y * w[2] - z * w[1])
    u[1] = y + dt * (z * w[0] - x * w[2])
    u[2] = z + dt * (x * w[1] - y * w[0])


@internal
def approach(u: Vector, target: Vector, share: float) -> None:
    """Move a vector towards a target by a share of the difference."""
    for k in range(3):
        u[k] += share * (target[k] - u[k])


@internal
def normalise(u: Vector) -> None:
    """Scale a vector to length 1."""
    size = math.sqrt(u[0] ** 2 + u[1] ** 2 + u[2] ** 2)
    for k in range(3):
        u[k] /= size
