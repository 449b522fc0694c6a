"""How the body lies against gravity, by gyro, accelerometer and told orientation."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import internal

# What is remembered: up in body axes by all sensors, up by gyro and accelerometer alone, the
# gyro's bias, the last orientation told, and times.
UP, OWN, BIAS, LAST = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 13)
STARTED, FROZEN, QUARREL, BLIND = range(13, 17)
MEMORY = 17

NONE, ORIENTATION, ACCELEROMETER = 0, 1, 2
"""What the attitude is by: nothing that is to be believed, or one of these."""

# Columns of the settings.
ORIENTATION_TIME, ACCELEROMETER_TIME, BIAS_TIME, DELAY, GATE, QUARREL_TIME = range(6)

MOST_TURN = 8.0
"""Larger angular velocities are no walking robot's [rad/s]."""

HARSH = 0.3
"""Share by which the specific force may differ from one g and still tell where up is."""


@internal
def estimate_attitude(
    dt: float,
    gravity: float,
    orientation: Float[np.ndarray, "4"],
    gyro: Float[np.ndarray, "3"],
    accelerometer: Float[np.ndarray, "3"],
    still: bool,
    settings: Float[np.ndarray, " 6"],
    memory: Float[np.ndarray, " 17"],
    up: Float[np.ndarray, "3"],
) -> int:
    """Direction of up in body axes: complementary filters on the sphere.

    The gyro turns the last one, u' = u x w; the told orientation, or else the accelerometer, draws
    it near within a time constant. So a sensor that begins or ends never makes it jump. A second
    filter knows gyro and accelerometer alone: where the two contradict each other for long one of
    the sensors lies, and nothing is believed.

    Args:
        dt: Since the last update [s].
        gravity: Acceleration of free fall [m/s²].
        orientation: Of the body, w x y z; NaN: none, shape (4,).
        gyro: Angular velocity, body axes [rad/s]; NaN: none, shape (3,).
        accelerometer: Specific force, body axes [m/s²]; NaN: none, shape (3,).
        still: Whether the robot stands by its plan.
        settings: Time constants of orientation, accelerometer and bias [s], delay [s], gate [rad],
            time of a quarrel [s].
        memory: Is changed; zeros at first, shape (17,).
        up: Is written: upwards in body axes, made up for the delay, shape (3,).

    Returns:
        What it is by: 0 nothing to be believed, 1 the orientation, 2 gyro and accelerometer.

    Source: Mahony, Hamel, Pflimlin, "Nonlinear complementary filters on the special orthogonal
    group", 2008, for one direction.
    """
    w, x, y, z = orientation[0], orientation[1], orientation[2], orientation[3]
    size = math.sqrt(w * w + x * x + y * y + z * z)
    told = abs(size - 1.0) < 0.1
    ox, oy, oz = 0.0, 0.0, 1.0
    if told:
        ox = 2 * (x * z - w * y) / (size * size)
        oy = 2 * (y * z + w * x) / (size * size)
        oz = 1 - 2 * (x * x + y * y) / (size * size)
    turn = math.sqrt(gyro[0] ** 2 + gyro[1] ** 2 + gyro[2] ** 2)
    turned = turn < MOST_TURN
    force = math.sqrt(accelerometer[0] ** 2 + accelerometer[1] ** 2 + accelerometer[2] ** 2)
    fell = abs(force / gravity - 1) < HARSH
    if memory[STARTED] < 0.5:
        if not (told or fell):
            up[0], up[1], up[2] = 0.0, 0.0, 1.0
            return NONE
        memory[STARTED] = 1.0
        if fell:
            for k in range(3):
                memory[3 + k] = accelerometer[k] / force
        else:
            memory[3], memory[4], memory[5] = ox, oy, oz
        if told:
            memory[0], memory[1], memory[2] = ox, oy, oz
        else:
            for k in range(3):
                memory[k] = memory[3 + k]
    # An orientation that never changes while the robot walks is a picture of one.
    same = told and w == memory[9] and x == memory[10] and y == memory[11] and z == memory[12]
    memory[FROZEN] = memory[FROZEN] + dt if same and not still else 0.0
    for k in range(4):
        memory[9 + k] = orientation[k]
    wx, wy, wz = 0.0, 0.0, 0.0
    if turned:
        if still:
            part = dt / settings[BIAS_TIME]
            for k in range(3):
                memory[6 + k] += part * (gyro[k] - memory[6 + k])
        wx, wy, wz = gyro[0] - memory[6], gyro[1] - memory[7], gyro[2] - memory[8]
    for first in (0, 3):
        ux, uy, uz = memory[first], memory[first + 1], memory[first + 2]
        memory[first] = ux + dt * (uy * wz - uz * wy)
        memory[first + 1] = uy + dt * (uz * wx - ux * wz)
        memory[first + 2] = uz + dt * (ux * wy - uy * wx)
    if fell:
        part = -math.expm1(-dt / settings[ACCELEROMETER_TIME])
        for k in range(3):
            memory[3 + k] += part * (accelerometer[k] / force - memory[3 + k])
    near = ox * memory[0] + oy * memory[1] + oz * memory[2] > math.cos(settings[GATE])
    heard = told and near and memory[FROZEN] < settings[QUARREL_TIME]
    source = NONE
    if heard:
        source = ORIENTATION
        part = -math.expm1(-dt / settings[ORIENTATION_TIME])
        memory[0] += part * (ox - memory[0])
        memory[1] += part * (oy - memory[1])
        memory[2] += part * (oz - memory[2])
    elif fell or turned:
        source = ACCELEROMETER
        part = -math.expm1(-dt / settings[ACCELEROMETER_TIME])
        for k in range(3):
            memory[k] += part * (memory[3 + k] - memory[k])
    for first in (0, 3):
        size = math.sqrt(memory[first] ** 2 + memory[first + 1] ** 2 + memory[first + 2] ** 2)
        for k in range(3):
            memory[first + k] /= size
    # Without an accelerometer the second filter knows nothing, and nobody quarrels.
    memory[BLIND] = 0.0 if fell else memory[BLIND] + dt
    agreed = memory[0] * memory[3] + memory[1] * memory[4] + memory[2] * memory[5]
    quarrels = memory[BLIND] < settings[ACCELEROMETER_TIME] and agreed < math.cos(settings[GATE])
    memory[QUARREL] = min(
        max(memory[QUARREL] + (dt if quarrels else -dt / 4), 0.0), 2 * settings[QUARREL_TIME]
    )
    if memory[QUARREL] > settings[QUARREL_TIME]:
        source = NONE
    if source == ACCELEROMETER and memory[BLIND] > 2 * settings[ACCELEROMETER_TIME]:
        # A gyro alone drifts away.
        source = NONE
    ahead = settings[DELAY]
    up[0] = memory[0] + ahead * (memory[1] * wz - memory[2] * wy)
    up[1] = memory[1] + ahead * (memory[2] * wx - memory[0] * wz)
    up[2] = memory[2] + ahead * (memory[0] * wy - memory[1] * wx)
    size = math.sqrt(up[0] ** 2 + up[1] ** 2 + up[2] ** 2)
    for k in range(3):
        up[k] /= size
    return source
