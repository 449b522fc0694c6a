"""The motion of the trunk under its legs and the ground, integrated in small steps.

The state of a substep is what forces change most simply: place and momentum of the centre of mass,
orientation, and angular momentum about that centre, all in world axes,

    c' = p/m,   p' = m g + sum F,   L' = sum r x F,   R' = R [w]x,   w = J⁻¹ (Rᵀ L - l),

with the inertia J about the centre of mass and the legs' own angular momentum l, in body axes, of
`legs`. In flight both momenta are kept to round-off, whatever the legs do.

Friction that sticks is a stiff damper: its rate is static friction times weight over threshold and
mass, some thousands per second. So a substep is linearly implicit: ROS2, a Rosenbrock method of
second order that keeps its order with any matrix in the place of the Jacobian (Verwer, Spee, Blom
and Hundsdorfer 1999), and is L-stable with gamma = 1 - 1/√2. The matrix is that of the contacts'
dampers: of normal damping, and of friction as force over slip, which never turns a slip around.
"""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled
from phasmid.simulation.simscape.ground import (
    cubic,
    cubic_rate,
    ground,
    inertia_at,
    rotation,
    solved,
)
from phasmid.simulation.simscape.legs import (
    AXIS,
    COM,
    COM_ACCELERATION,
    COXA_AXIS,
    INERTIA,
    LEG,
    LEGS,
    MOMENTUM,
    TIP,
)

GAMMA = 1.0 - math.sqrt(0.5)
"""Of the method."""


@compiled
def factored(dampers: np.ndarray, mass: float, J: np.ndarray, weight: float, C: np.ndarray) -> None:
    """Fill C with the Cholesky factor of the mass matrix and so much of the dampers."""
    for i in range(6):
        for j in range(i + 1):
            value = weight * dampers[i, j]
            if i >= 3 and j >= 3:
                value += J[i - 3, j - 3]
            elif i == j:
                value += mass
            for k in range(j):
                value -= C[i, k] * C[j, k]
            C[i, j] = math.sqrt(value) if i == j else value / C[j, j]


@compiled
def damped(C: np.ndarray, mass: float, J: np.ndarray, b: np.ndarray, x: np.ndarray) -> None:
    """Fill x with M (M + weight D)⁻¹ b, from the factor of the matrix in brackets."""
    for i in range(6):
        value = b[i]
        for k in range(i):
            value -= C[i, k] * x[k]
        x[i] = value / C[i, i]
    for i in range(5, -1, -1):
        value = x[i]
        for k in range(i + 1, 6):
            value -= C[k, i] * x[k]
        x[i] = value / C[i, i]
    y3, y4, y5 = x[3], x[4], x[5]
    for a in range(3):
        x[a] *= mass
        x[3 + a] = J[a, 0] * y3 + J[a, 1] * y4 + J[a, 2] * y5


@compiled
def drift(state: np.ndarray, w: np.ndarray, mass: float, rate: np.ndarray) -> None:
    """Fill the rates of the centre of mass (3) and of the quaternion (4)."""
    for a in range(3):
        rate[a] = state[7 + a] / mass
    qw, qx, qy, qz = state[3], state[4], state[5], state[6]
    rate[3] = 0.5 * (-qx * w[0] - qy * w[1] - qz * w[2])
    rate[4] = 0.5 * (qw * w[0] + qy * w[2] - qz * w[1])
    rate[5] = 0.5 * (qw * w[1] + qz * w[0] - qx * w[2])
    rate[6] = 0.5 * (qw * w[2] + qx * w[1] - qy * w[0])


@compiled
def with_weight(
    R: np.ndarray,
    wrench: np.ndarray,
    weight: np.ndarray,
    R_to: np.ndarray,
    total: np.ndarray,
) -> None:
    """Fill the total wrench, with the weight in it, in the axes of another rotation."""
    for half in (0, 3):
        x, y, z = wrench[half], wrench[half + 1], wrench[half + 2]
        a = R[0, 0] * x + R[0, 1] * y + R[0, 2] * z
        b = R[1, 0] * x + R[1, 1] * y + R[1, 2] * z
        c = R[2, 0] * x + R[2, 1] * y + R[2, 2] * z
        if half == 0:
            a, b, c = a + weight[0], b + weight[1], c + weight[2]
        for i in range(3):
            total[half + i] = R_to[0, i] * a + R_to[1, i] * b + R_to[2, i] * c


@compiled
def moved(
    row: np.ndarray,
    dt: float,
    substeps: int,
    mass: float,
    weight: np.ndarray,
    planes: np.ndarray,
    law: np.ndarray,
    state: np.ndarray,
    space: np.ndarray,
    feet: np.ndarray,
) -> None:
    """Move the state over one step.

    Args:
        row: The legs in this step.
        dt: Length of the step [s].
        substeps: In how many equal parts.
        mass: Of the robot [kg].
        weight: Of the robot, world axes [N].
        planes: As of `ground`.
        law: As of `ground`.
        state: Is moved.
        space: For numbers in between, shape (30, 6).
        feet: For numbers in between, shape (L, 7).
    """
    R, J, R2, J2 = space[0:3, :3], space[3:6, :3], space[6:9, :3], space[9:12, :3]
    dampers, C, none = space[12:18], space[18:24], space[:0]
    w, wrench, force, k1, k2 = space[24, :3], space[25], space[26], space[27], space[28]
    rate, later, stage = np.empty(7), np.empty(7), np.empty(13)
    h = dt / substeps
    for part in range(substeps):
        s = part / substeps
        ground(row, s, dt, state, R, J, w, mass, planes, law, feet, wrench, dampers)
        factored(dampers, mass, J, GAMMA * h, C)
        drift(state, w, mass, rate)
        with_weight(R, wrench, weight, R, force)
        damped(C, mass, J, force, k1)
        stage[:7] = state[:7] + h * rate
        for a in range(3):
            stage[7 + a] = state[7 + a] + h * (R[a, 0] * k1[0] + R[a, 1] * k1[1] + R[a, 2] * k1[2])
            stage[10 + a] = state[10 + a] + h * (
                R[a, 0] * k1[3] + R[a, 1] * k1[4] + R[a, 2] * k1[5]
            )
        s = (part + 1.0) / substeps
        ground(row, s, dt, stage, R2, J2, w, mass, planes, law, feet, wrench, none)
        drift(stage, w, mass, later)
        with_weight(R2, wrench, weight, R, force)
        for a in range(6):
            force[a] -= 2.0 * k1[a]
        damped(C, mass, J, force, k2)
        for a in range(7):
            state[a] += 0.5 * h * (rate[a] + later[a])
        for a in range(6):
            k1[a] = h * (1.5 * k1[a] + 0.5 * k2[a])
        for a in range(3):
            state[7 + a] += R[a, 0] * k1[0] + R[a, 1] * k1[1] + R[a, 2] * k1[2]
            state[10 + a] += R[a, 0] * k1[3] + R[a, 1] * k1[4] + R[a, 2] * k1[5]

    size = 0.0
    for a in range(3, 7):
        size += state[a] * state[a]
    state[3:7] /= math.sqrt(size)


@compiled
def momenta(
    row: np.ndarray,
    dt: float,
    mass: float,
    pose: np.ndarray,
    twist: np.ndarray,
    space: np.ndarray,
    state: np.ndarray,
) -> None:
    """Fill the state from pose and twist of the body frame, where a step begins.

    Args:
        row: The legs in this step.
        dt: Length of the step [s].
        mass: Of the robot [kg].
        pose: Position and quaternion (7).
        twist: Velocity in world axes and angular velocity in body axes (6).
        space: For numbers in between.
        state: Is filled.
    """
    R, J = space[0:3, :3], space[3:6, :3]
    rotation(pose[3:7], R)
    inertia_at(row, 0.0, J)
    c0, c1, c2 = row[COM], row[COM + 4], row[COM + 8]
    w0, w1, w2 = twist[3], twist[4], twist[5]
    v0 = row[COM + 1] / dt + w1 * c2 - w2 * c1
    v1 = row[COM + 5] / dt + w2 * c0 - w0 * c2
    v2 = row[COM + 9] / dt + w0 * c1 - w1 * c0
    l0 = J[0, 0] * w0 + J[0, 1] * w1 + J[0, 2] * w2 + row[MOMENTUM]
    l1 = J[1, 0] * w0 + J[1, 1] * w1 + J[1, 2] * w2 + row[MOMENTUM + 4]
    l2 = J[2, 0] * w0 + J[2, 1] * w1 + J[2, 2] * w2 + row[MOMENTUM + 8]
    for a in range(3):
        state[a] = pose[a] + R[a, 0] * c0 + R[a, 1] * c1 + R[a, 2] * c2
        state[7 + a] = mass * (twist[a] + R[a, 0] * v0 + R[a, 1] * v1 + R[a, 2] * v2)
        state[10 + a] = R[a, 0] * l0 + R[a, 1] * l1 + R[a, 2] * l2
    for a in range(3, 7):
        state[a] = pose[a]


@compiled
def twisted(
    row: np.ndarray,
    dt: float,
    mass: float,
    state: np.ndarray,
    space: np.ndarray,
    pose: np.ndarray,
    twist: np.ndarray,
) -> None:
    """Fill pose and twist of the body frame from the state where a step ends; see `momenta`."""
    R, J, rest, w = space[0:3, :3], space[3:6, :3], space[6, :3], space[7, :3]
    rotation(state[3:7], R)
    inertia_at(row, 1.0, J)
    for a in range(3):
        inner = R[0, a] * state[10] + R[1, a] * state[11] + R[2, a] * state[12]
        rest[a] = inner - cubic(row, MOMENTUM + 4 * a, 1.0)
    solved(J, rest, w)
    c0, c1, c2 = cubic(row, COM, 1.0), cubic(row, COM + 4, 1.0), cubic(row, COM + 8, 1.0)
    v0 = cubic_rate(row, COM, 1.0) / dt + w[1] * c2 - w[2] * c1
    v1 = cubic_rate(row, COM + 4, 1.0) / dt + w[2] * c0 - w[0] * c2
    v2 = cubic_rate(row, COM + 8, 1.0) / dt + w[0] * c1 - w[1] * c0
    for a in range(3):
        pose[a] = state[a] - (R[a, 0] * c0 + R[a, 1] * c1 + R[a, 2] * c2)
        twist[a] = state[7 + a] / mass - (R[a, 0] * v0 + R[a, 1] * v1 + R[a, 2] * v2)
        twist[3 + a] = w[a]
    for a in range(3, 7):
        pose[a] = state[a]


@compiled
def looked(
    row: np.ndarray,
    dt: float,
    mass: float,
    weight: np.ndarray,
    state: np.ndarray,
    space: np.ndarray,
    feet: np.ndarray,
    pose: np.ndarray,
    sensors: np.ndarray,
    turns: np.ndarray,
    acceleration: np.ndarray,
) -> None:
    """Write down what is felt where a step begins; `ground` has just filled space and feet.

    Args:
        row: The legs in this step.
        dt: Length of the step [s].
        mass: Of the robot [kg].
        weight: Of the robot, world axes [N].
        state: Centre of mass, quaternion, momenta.
        space: What `ground` filled.
        feet: What `ground` filled.
        pose: Of the body frame.
        sensors: Filled as the engine's: leg by leg points that touch and force in world axes,
            then the feet's positions.
        turns: Filled with the torques about coxa, femur and tibia that the feet's forces have
            beyond those of the same forces at the tips.
        acceleration: Filled with those of the body frame's origin and of its turning, world axes.
    """
    R, J, w, wrench = space[0:3, :3], space[3:6, :3], space[24, :3], space[25]
    legs = len(feet)
    c0, c1, c2 = row[COM], row[COM + 4], row[COM + 8]
    for leg in range(legs):
        at = LEGS + leg * LEG
        tip, axis, foot = row[at + TIP : at + AXIS], row[at + AXIS : at + COXA_AXIS], feet[leg]
        hip = row[at + COXA_AXIS : at + LEG]
        f0, f1, f2 = foot[1], foot[2], foot[3]
        r0, r1, r2 = tip[0] - c0, tip[1] - c1, tip[2] - c2
        m0 = foot[4] - (r1 * f2 - r2 * f1)
        m1 = foot[5] - (r2 * f0 - r0 * f2)
        m2 = foot[6] - (r0 * f1 - r1 * f0)
        turns[3 * leg] = hip[0] * m0 + hip[1] * m1 + hip[2] * m2
        turns[3 * leg + 1] = turns[3 * leg + 2] = axis[0] * m0 + axis[1] * m1 + axis[2] * m2
        sensors[4 * leg] = foot[0]
        for a in range(3):
            sensors[4 * leg + 1 + a] = R[a, 0] * f0 + R[a, 1] * f1 + R[a, 2] * f2
            arm = R[a, 0] * tip[0] + R[a, 1] * tip[1] + R[a, 2] * tip[2]
            sensors[4 * legs + 3 * leg + a] = pose[a] + arm
    # J w' = moment - J' w - l' - w x (J w + l).
    w0, w1, w2 = w
    spin, rest, turning = space[26, :3], space[27, :3], space[28, :3]
    for a in range(3):
        spin[a] = R[0, a] * state[10] + R[1, a] * state[11] + R[2, a] * state[12]
    g0, g1, g2 = row[INERTIA + 1] / dt, row[INERTIA + 5] / dt, row[INERTIA + 9] / dt
    g3, g4, g5 = row[INERTIA + 13] / dt, row[INERTIA + 17] / dt, row[INERTIA + 21] / dt
    rest[0] = g0 * w0 + g3 * w1 + g4 * w2 + w1 * spin[2] - w2 * spin[1]
    rest[1] = g3 * w0 + g1 * w1 + g5 * w2 + w2 * spin[0] - w0 * spin[2]
    rest[2] = g4 * w0 + g5 * w1 + g2 * w2 + w0 * spin[1] - w1 * spin[0]
    for a in range(3):
        rest[a] = wrench[3 + a] - rest[a] - row[MOMENTUM + 4 * a + 1] / dt
    solved(J, rest, turning)
    # The origin against the centre of mass: -c'' - 2 w x c' - w' x c - w x (w x c), body axes.
    d0, d1, d2 = row[COM + 1] / dt, row[COM + 5] / dt, row[COM + 9] / dt
    e0, e1, e2 = 2 * d0 + w1 * c2 - w2 * c1, 2 * d1 + w2 * c0 - w0 * c2, 2 * d2 + w0 * c1 - w1 * c0
    t0, t1, t2 = turning
    rest[0] = row[COM_ACCELERATION] + w1 * e2 - w2 * e1 + t1 * c2 - t2 * c1
    rest[1] = row[COM_ACCELERATION + 1] + w2 * e0 - w0 * e2 + t2 * c0 - t0 * c2
    rest[2] = row[COM_ACCELERATION + 2] + w0 * e1 - w1 * e0 + t0 * c1 - t1 * c0
    for a in range(3):
        inner = 0.0
        for b in range(3):
            inner += R[a, b] * (wrench[b] / mass - rest[b])
        acceleration[a] = weight[a] / mass + inner
        acceleration[3 + a] = R[a, 0] * t0 + R[a, 1] * t1 + R[a, 2] * t2


@compiled
def advance(
    rows: np.ndarray,
    dt: float,
    substeps: int,
    last: bool,
    mass: float,
    weight: np.ndarray,
    planes: np.ndarray,
    law: np.ndarray,
    pose: np.ndarray,
    twist: np.ndarray,
    log_pose: np.ndarray,
    log_twist: np.ndarray,
    sensors: np.ndarray,
    turns: np.ndarray,
    acceleration: np.ndarray,
) -> None:
    """Make a step for each row, and write down what was there where each one began.

    Args:
        rows: The legs in each step.
        dt: Length of a step [s].
        substeps: Parts in which a step is integrated.
        last: Whether the last row is the end, where there is nothing more than a look.
        mass: Of the robot [kg].
        weight: Of the robot, world axes [N].
        planes: As of `ground`.
        law: As of `ground`.
        pose: Position and quaternion of the body frame, where it is and then where it will be.
        twist: Its velocity in world axes and angular velocity in body axes.
        log_pose: A row of the pose for each step.
        log_twist: A row of the twist for each step.
        sensors: As of `looked`, a row for each step.
        turns: As of `looked`, a row for each step.
        acceleration: As of `looked`, a row for each step.
    """
    space, feet, state = np.zeros((30, 6)), np.zeros((len(planes), 7)), np.zeros(13)
    R, J, none = space[0:3, :3], space[3:6, :3], space[:0]
    w, wrench = space[24, :3], space[25]
    for k in range(len(rows)):
        row = rows[k]
        momenta(row, dt, mass, pose, twist, space, state)
        ground(row, 0.0, dt, state, R, J, w, mass, planes, law, feet, wrench, none)
        for a in range(7):
            log_pose[k, a] = pose[a]
        for a in range(6):
            log_twist[k, a] = twist[a]
        looked(
            row, dt, mass, weight, state, space, feet, pose, sensors[k], turns[k], acceleration[k]
        )
        if last and k == len(rows) - 1:
            return
        moved(row, dt, substeps, mass, weight, planes, law, state, space, feet)
        twisted(row, dt, mass, state, space, pose, twist)
