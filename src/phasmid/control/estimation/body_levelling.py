"""How the body is kept level, or along the ground, and over its feet."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import internal

# What is remembered: up as seen from the ground, and the corrections.
UP, CORRECTION = slice(0, 3), slice(3, 8)
STARTED = 8
MEMORY = 9

AHEAD, LEFT, RISE, ROLL, PITCH = range(5)
"""Columns of a correction."""

# Columns of the settings.
LEVEL, LEVEL_TIME, LEVEL_RATE, LEVEL_LIMIT, SHIFT, SHIFT_RATE, SHIFT_LIMIT, EASE_TIME = range(8)


@internal
def level_body(
    dt: float,
    trusted: bool,
    up_body: Float[np.ndarray, "3"],
    R_odom_body: Float[np.ndarray, "3 3"],
    R_odom_path: Float[np.ndarray, "3 3"],
    plane: Float[np.ndarray, "5"],
    height: float,
    settings: Float[np.ndarray, " 8"],
    memory: Float[np.ndarray, " 9"],
) -> None:
    """Lean and shift of the body, so that it is level and its mass over the middle of its feet.

    How gravity lies in the frame odom, where the engine believes that it walks, is R u, with the
    body's attitude in it that is commanded, R, and the measured direction of up in the body, u: it
    holds the ground's slope and all by which legs and servos give way. Its mean over the time of
    levelling is what the body follows, as an integral controller would: the lean that is commanded
    lowers what is measured and leaves what is believed.

    Args:
        dt: Since the last update [s].
        trusted: Whether the measured direction is to be believed; if not the corrections ease out.
        up_body: Upwards in body axes, measured, shape (3,).
        R_odom_body: Attitude of the body that is commanded, shape (3, 3).
        R_odom_path: Axes of the path, turned about odom's z alone, shape (3, 3).
        plane: Of the ground in odom, of which the slopes along x and y are used, shape (5,).
        height: Of the centre of mass over that plane, along the path's z [m].
        settings: Share and time constant of levelling, its largest speed [rad/s] and angle [rad];
            share of the shift, its largest speed [m/s] and length [m]; time of easing out [s].
        memory: Up in odom; ahead, left, rise [m], roll and pitch [rad]; whether it has
            begun; is changed; zeros at first, shape (9,).
    """
    ux = uy = uz = 0.0
    for k in range(3):
        ux += R_odom_body[0, k] * up_body[k]
        uy += R_odom_body[1, k] * up_body[k]
        uz += R_odom_body[2, k] * up_body[k]
    if not trusted:
        # What was felt is forgotten slowly, and the body goes back to what is commanded.
        ux, uy, uz = 0.0, 0.0, 1.0
        part = -math.expm1(-dt / settings[EASE_TIME])
    elif memory[STARTED] < 0.5:
        part = 1.0
    else:
        part = -math.expm1(-dt / settings[LEVEL_TIME])
    memory[STARTED] = 1.0
    memory[0] += part * (ux - memory[0])
    memory[1] += part * (uy - memory[1])
    memory[2] += part * (uz - memory[2])
    size = math.sqrt(memory[0] ** 2 + memory[1] ** 2 + memory[2] ** 2)
    ux, uy, uz = memory[0] / size, memory[1] / size, memory[2] / size
    # Seen along the path.
    tx = R_odom_path[0, 0] * ux + R_odom_path[1, 0] * uy
    ty = R_odom_path[0, 1] * ux + R_odom_path[1, 1] * uy
    ux, uy = tx, ty
    slope_x = R_odom_path[0, 0] * plane[1] + R_odom_path[1, 0] * plane[2]
    slope_y = R_odom_path[0, 1] * plane[1] + R_odom_path[1, 1] * plane[2]
    # The body's own z between the ground's normal and up.
    nz = 1.0 / math.sqrt(1.0 + slope_x**2 + slope_y**2)
    nx, ny = -slope_x * nz, -slope_y * nz
    share = settings[LEVEL] if trusted else 0.0
    zx, zy, zz = nx + share * (ux - nx), ny + share * (uy - ny), nz + share * (uz - nz)
    size = math.sqrt(zx * zx + zy * zy + zz * zz)
    roll, pitch = -math.asin(zy / size), math.atan2(zx, zz)
    # From a place at the height, along the path's z, the vertical meets the plane off its foot.
    fall = settings[SHIFT] * height * nz / max(ux * nx + uy * ny + uz * nz, 0.5)
    ahead, left = fall * ux, fall * uy
    size = math.hypot(roll, pitch)
    if size > settings[LEVEL_LIMIT]:
        roll, pitch = roll * settings[LEVEL_LIMIT] / size, pitch * settings[LEVEL_LIMIT] / size
    size = math.hypot(ahead, left)
    if size > settings[SHIFT_LIMIT]:
        ahead, left = ahead * settings[SHIFT_LIMIT] / size, left * settings[SHIFT_LIMIT] / size
    # Bounded speed; while easing out it is slow as well.
    turn, move = settings[LEVEL_RATE] * dt, settings[SHIFT_RATE] * dt
    dr, dp = roll - memory[3 + ROLL], pitch - memory[3 + PITCH]
    size = math.hypot(dr, dp)
    if not trusted:
        turn = min(turn, size * -math.expm1(-dt / settings[EASE_TIME]))
    if size > turn:
        dr, dp = dr * turn / size, dp * turn / size
    memory[3 + ROLL] += dr
    memory[3 + PITCH] += dp
    dx, dy = ahead - memory[3 + AHEAD], left - memory[3 + LEFT]
    size = math.hypot(dx, dy)
    if not trusted:
        move = min(move, size * -math.expm1(-dt / settings[EASE_TIME]))
    if size > move:
        dx, dy = dx * move / size, dy * move / size
    memory[3 + AHEAD] += dx
    memory[3 + LEFT] += dy
    # Along the ground.
    memory[3 + RISE] = slope_x * memory[3 + AHEAD] + slope_y * memory[3 + LEFT]
