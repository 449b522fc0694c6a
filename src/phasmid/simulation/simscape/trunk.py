"""Compiled integration of a free trunk with prescribed joints under the paper's contact law.

The state is the position c of the centre of mass, the orientation R, the momentum p and the angular
momentum L about the centre of mass, all in world axes:

    c' = p/m,   p' = m g + sum F,   L' = sum r x F,   R' = R [w]x,   w = J⁻¹ (Rᵀ L - l),

with the inertia J about the centre of mass and the angular momentum l of the legs, in body axes,
from `legs`. In flight both momenta are conserved to round-off.

Sticking friction is a stiff damper: its rate is static friction times weight over threshold and
mass, thousands per second. A substep is therefore linearly implicit: ROS2, a Rosenbrock method of
second order that keeps its order with any matrix in place of the Jacobian (Verwer, Spee, Blom and
Hundsdorfer 1999), and is L-stable with gamma = 1 - 1/√2. The matrix is that of the contacts'
dampers: normal damping, and friction as force over slip, which never turns a slip around.

The contact law is that of the Simscape Multibody Contact Forces Library, sphere to plane, with its
defaults (the tool of the paper's Figs. 9 to 11).
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from phasmid.compiled import compiled
from phasmid.simulation.contact import CONTACT_POINTS
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
    TURNING,
)

Vector: TypeAlias = tuple[float, float, float]

GAMMA = 1.0 - math.sqrt(0.5)
"""Coefficient of ROS2."""

KINETIC_FROM = 1.5
"""Slip, over the threshold speed, from which friction is kinetic."""


@compiled
def normal_force(depth: float, sinking: float, stiffness: float, damping: float) -> float:
    """Return the normal force on one point [N]: a spring, and a damper while the point sinks.

    Args:
        depth: Of the point in the ground [m].
        sinking: Velocity into the ground [m/s].
        stiffness: [N/m].
        damping: [N·s/m].
    """
    if depth <= 0.0:
        return 0.0
    return stiffness * depth + damping * max(sinking, 0.0)


@compiled
def friction_coefficient(speed: float, static: float, kinetic: float, threshold: float) -> float:
    """Return friction over normal force of one point.

    It rises linearly to the static coefficient at the threshold, and falls linearly to the kinetic
    one at 1.5 times the threshold.

    Args:
        speed: Of the slip, not negative [m/s].
        static: Coefficient at the threshold.
        kinetic: Coefficient of fast slip.
        threshold: Speed up to which the point sticks, by creeping [m/s].
    """
    if speed <= threshold:
        return static * speed / threshold
    if speed >= KINETIC_FROM * threshold:
        return kinetic
    return static - (static - kinetic) * (speed / threshold - 1.0) / (KINETIC_FROM - 1.0)


# Vectors are tuples, which the compiler keeps in registers.


@compiled
def plus(a: Vector, b: Vector) -> Vector:
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@compiled
def minus(a: Vector, b: Vector) -> Vector:
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@compiled
def times(k: float, a: Vector) -> Vector:
    """Return k a."""
    return k * a[0], k * a[1], k * a[2]


@compiled
def dot(a: Vector, b: Vector) -> float:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def vector(array: np.ndarray, at: int) -> Vector:
    """Return three numbers of an array."""
    return array[at], array[at + 1], array[at + 2]


@compiled
def put(array: np.ndarray, at: int, a: Vector) -> None:
    """Write three numbers of an array."""
    array[at], array[at + 1], array[at + 2] = a


@compiled
def apply(M: np.ndarray, a: Vector) -> Vector:
    """Return M a."""
    return dot(vector(M[0], 0), a), dot(vector(M[1], 0), a), dot(vector(M[2], 0), a)


@compiled
def apply_transposed(M: np.ndarray, a: Vector) -> Vector:
    """Return Mᵀ a."""
    x, y, z = vector(M[0], 0), vector(M[1], 0), vector(M[2], 0)
    return plus(plus(times(a[0], x), times(a[1], y)), times(a[2], z))


@compiled
def solve(J: np.ndarray, b: Vector) -> Vector:
    """Return x of J x = b for a symmetric matrix."""
    x, y, z = vector(J[0], 0), vector(J[1], 0), vector(J[2], 0)
    yz, zx, xy = cross(y, z), cross(z, x), cross(x, y)
    d = 1.0 / dot(x, yz)
    return times(d, plus(plus(times(b[0], yz), times(b[1], zx)), times(b[2], xy)))


@compiled
def cubic(row: np.ndarray, at: int, s: float) -> float:
    """Return the value of a cubic at a share of the step."""
    return row[at] + s * (row[at + 1] + s * (row[at + 2] + s * row[at + 3]))


@compiled
def cubics(row: np.ndarray, at: int, s: float) -> Vector:
    """Return the values of three cubics."""
    return cubic(row, at, s), cubic(row, at + 4, s), cubic(row, at + 8, s)


@compiled
def rate(row: np.ndarray, at: int, s: float, dt: float) -> float:
    """Return the time derivative of a cubic."""
    return (row[at + 1] + s * (2.0 * row[at + 2] + s * 3.0 * row[at + 3])) / dt


@compiled
def rates(row: np.ndarray, at: int, s: float, dt: float) -> Vector:
    """Return the time derivatives of three cubics."""
    return rate(row, at, s, dt), rate(row, at + 4, s, dt), rate(row, at + 8, s, dt)


@compiled
def fill_rotation(state: np.ndarray, R: np.ndarray) -> None:
    """Fill R with the rotation of the state's quaternion, which may be of any length."""
    w, x, y, z = state[3], state[4], state[5], state[6]
    n = 2.0 / (w * w + x * x + y * y + z * z)
    put(R[0], 0, (1 - n * (y * y + z * z), n * (x * y - w * z), n * (x * z + w * y)))
    put(R[1], 0, (n * (x * y + w * z), 1 - n * (x * x + z * z), n * (y * z - w * x)))
    put(R[2], 0, (n * (x * z - w * y), n * (y * z + w * x), 1 - n * (x * x + y * y)))


@compiled
def fill_symmetric(xx_yy_zz: Vector, xy_xz_yz: Vector, J: np.ndarray) -> None:
    """Fill a symmetric matrix."""
    (xx, yy, zz), (xy, xz, yz) = xx_yy_zz, xy_xz_yz
    put(J[0], 0, (xx, xy, xz))
    put(J[1], 0, (xy, yy, yz))
    put(J[2], 0, (xz, yz, zz))


# Forces -------------------------------------------------------------------------------------------


@compiled
def contact(
    row: np.ndarray,
    s: float,
    dt: float,
    state: np.ndarray,
    mass: float,
    planes: np.ndarray,
    law: np.ndarray,
    R: np.ndarray,
    J: np.ndarray,
    feet: np.ndarray,
    wrench: np.ndarray,
    dampers: np.ndarray,
) -> Vector:
    """Compute the contact forces in a state, in body axes, and return the angular velocity.

    Args:
        row: The legs in this step, from `leg_rows`.
        s: Share of the step that has passed.
        dt: Time step [s].
        state: Centre of mass, quaternion, momentum, angular momentum (13).
        mass: Of the robot [kg].
        planes: Ground under each leg: normal in world axes, distance from the origin along it, and
            static coefficient of friction, shape (L, 5).
        law: Stiffness, damping, kinetic coefficient and threshold speed of a point, its radius,
            and the greatest distance of two points of a foot.
        R: Filled with the body's rotation.
        J: Filled with the inertia about the centre of mass.
        feet: Filled with the number of touching points, force and moment on each foot, the moment
            about the centre of mass, shape (L, 7).
        wrench: Filled with the feet's sum (6).
        dampers: Filled with the lower triangle of the damping matrix of the contacts (6, 6), by
            which a twist of the body changes the wrench; not where it has no rows.
    """
    stiffness, damping, kinetic, threshold, radius, size = law
    fill_rotation(state, R)
    fill_symmetric(cubics(row, INERTIA, s), cubics(row, INERTIA + 12, s), J)
    com = cubics(row, COM, s)
    w = solve(J, minus(apply_transposed(R, vector(state, 10)), cubics(row, MOMENTUM, s)))
    velocity = apply_transposed(R, times(1.0 / mass, vector(state, 7)))
    velocity = minus(velocity, rates(row, COM, s, dt))
    feet[:] = 0.0
    wrench[:] = 0.0
    dampers[:] = 0.0
    for leg in range(len(planes)):
        at = LEGS + leg * LEG
        upward, static = vector(planes[leg], 0), planes[leg, 4]
        n = apply_transposed(R, upward)
        height = dot(upward, vector(state, 0)) - planes[leg, 3] - radius
        begin, end = vector(row, at + TURNING), vector(row, at + TURNING + 3)
        turning = plus(begin, times(s, minus(end, begin)))
        for point in range(CONTACT_POINTS):
            r = minus(cubics(row, at + 12 * point, s), com)
            depth = -(height + dot(n, r))
            if depth <= 0.0:
                # No other point of this foot can reach the ground.
                if depth < -size:
                    break
                continue
            # The point of the tibia that touches, halfway into the ground.
            below = times(radius - depth / 2.0, n)
            r = minus(r, below)
            v = plus(plus(velocity, cross(w, r)), rates(row, at + 12 * point, s, dt))
            v = minus(v, cross(turning, below))
            rising = dot(n, v)
            v = minus(v, times(rising, n))
            slip = math.sqrt(dot(v, v))
            normal = normal_force(depth, -rising, stiffness, damping)
            drag = static * normal / threshold
            if slip > threshold:
                least = min(kinetic, static)
                drag = friction_coefficient(slip, static, least, threshold) * normal / slip
            force = minus(times(normal, n), times(drag, v))
            feet[leg, 0] += 1.0
            put(feet[leg], 1, plus(vector(feet[leg], 1), force))
            put(feet[leg], 4, plus(vector(feet[leg], 4), cross(r, force)))
            if len(dampers):
                add_dampers(dampers, damping if rising < 0.0 else 0.0, drag, n, r)
        for a in range(6):
            wrench[a] += feet[leg, 1 + a]
    return w


@compiled
def add_dampers(dampers: np.ndarray, damping: float, drag: float, n: Vector, r: Vector) -> None:
    """Add damping along the normal n and drag along the ground, at the point r."""
    D = dampers
    # Drag in all directions: the lower triangle of drag Gᵀ G with G = [1, -[r]x].
    for i in range(3):
        D[i, i] += drag
        D[3 + i, 3 + i] += drag * dot(r, r)
        for j in range(i + 1):
            D[3 + i, 3 + j] -= drag * r[i] * r[j]
    D[3, 1] -= drag * r[2]
    D[3, 2] += drag * r[1]
    D[4, 0] += drag * r[2]
    D[4, 2] -= drag * r[0]
    D[5, 0] -= drag * r[1]
    D[5, 1] += drag * r[0]
    # Along the normal, what differs from it.
    moment = cross(r, n)
    b = (n[0], n[1], n[2], moment[0], moment[1], moment[2])
    for i in range(6):
        for j in range(i + 1):
            D[i, j] += (damping - drag) * b[i] * b[j]


# Integration --------------------------------------------------------------------------------------


@compiled
def factorise(
    dampers: np.ndarray, mass: float, J: np.ndarray, weight: float, C: np.ndarray
) -> None:
    """Fill C with the Cholesky factor of the mass matrix plus a weight times the dampers."""
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
def damp(C: np.ndarray, mass: float, J: np.ndarray, b: np.ndarray, x: np.ndarray) -> None:
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
    put(x, 0, times(mass, vector(x, 0)))
    put(x, 3, apply(J, vector(x, 3)))


@compiled
def fill_drift(state: np.ndarray, w: Vector, mass: float, drift: np.ndarray) -> None:
    """Fill the rates of the centre of mass (3) and of the quaternion (4)."""
    put(drift, 0, times(1.0 / mass, vector(state, 7)))
    scalar, q = state[3], vector(state, 4)
    drift[3] = -0.5 * dot(q, w)
    put(drift, 4, times(0.5, plus(times(scalar, w), cross(q, w))))


@compiled
def add_impulse(state: np.ndarray, R: np.ndarray, force: np.ndarray, h: float) -> None:
    """Add a force and a moment in body axes, over a time, to the momenta."""
    for half in (0, 3):
        change = times(h, apply(R, vector(force, half)))
        put(state, 7 + half, plus(vector(state, 7 + half), change))


@compiled
def total_wrench(
    R: np.ndarray, wrench: np.ndarray, weight: np.ndarray, R_to: np.ndarray, total: np.ndarray
) -> None:
    """Fill the wrench with the weight, in the body axes of another rotation."""
    force = plus(apply(R, vector(wrench, 0)), vector(weight, 0))
    put(total, 0, apply_transposed(R_to, force))
    put(total, 3, apply_transposed(R_to, apply(R, vector(wrench, 3))))


@compiled
def move(
    row: np.ndarray,
    dt: float,
    substeps: int,
    mass: float,
    weight: np.ndarray,
    planes: np.ndarray,
    law: np.ndarray,
    state: np.ndarray,
    feet: np.ndarray,
) -> None:
    """Advance the state by one step in equal substeps; arguments as of `advance`."""
    R, J, R2, J2 = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    dampers, C, none = np.empty((6, 6)), np.empty((6, 6)), np.empty((0, 6))
    wrench, force, k1, k2 = np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    drift, drift2, stage = np.empty(7), np.empty(7), np.empty(13)
    h = dt / substeps
    for part in range(substeps):
        s = part / substeps
        w = contact(row, s, dt, state, mass, planes, law, R, J, feet, wrench, dampers)
        factorise(dampers, mass, J, GAMMA * h, C)
        fill_drift(state, w, mass, drift)
        total_wrench(R, wrench, weight, R, force)
        damp(C, mass, J, force, k1)
        stage[:7] = state[:7] + h * drift
        stage[7:] = state[7:]
        add_impulse(stage, R, k1, h)
        s = (part + 1.0) / substeps
        w = contact(row, s, dt, stage, mass, planes, law, R2, J2, feet, wrench, none)
        fill_drift(stage, w, mass, drift2)
        total_wrench(R2, wrench, weight, R, force)
        force -= 2.0 * k1
        damp(C, mass, J, force, k2)
        state[:7] += 0.5 * h * (drift + drift2)
        k1 = 1.5 * k1 + 0.5 * k2
        add_impulse(state, R, k1, h)
    state[3:7] /= math.sqrt(np.sum(state[3:7] ** 2))


@compiled
def fill_state(
    row: np.ndarray, dt: float, mass: float, pose: np.ndarray, twist: np.ndarray, state: np.ndarray
) -> None:
    """Fill the state from pose and twist of the body frame, at the beginning of a step."""
    R, J = np.empty((3, 3)), np.empty((3, 3))
    state[3:7] = pose[3:7]
    fill_rotation(state, R)
    fill_symmetric(cubics(row, INERTIA, 0.0), cubics(row, INERTIA + 12, 0.0), J)
    com, w = cubics(row, COM, 0.0), vector(twist, 3)
    v = plus(rates(row, COM, 0.0, dt), cross(w, com))
    put(state, 0, plus(vector(pose, 0), apply(R, com)))
    put(state, 7, times(mass, plus(vector(twist, 0), apply(R, v))))
    put(state, 10, apply(R, plus(apply(J, w), cubics(row, MOMENTUM, 0.0))))


@compiled
def fill_twist(
    row: np.ndarray, dt: float, mass: float, state: np.ndarray, pose: np.ndarray, twist: np.ndarray
) -> None:
    """Fill pose and twist of the body frame from the state, at the end of a step."""
    R, J = np.empty((3, 3)), np.empty((3, 3))
    pose[3:7] = state[3:7]
    fill_rotation(state, R)
    fill_symmetric(cubics(row, INERTIA, 1.0), cubics(row, INERTIA + 12, 1.0), J)
    w = solve(J, minus(apply_transposed(R, vector(state, 10)), cubics(row, MOMENTUM, 1.0)))
    com = cubics(row, COM, 1.0)
    v = plus(rates(row, COM, 1.0, dt), cross(w, com))
    put(pose, 0, minus(vector(state, 0), apply(R, com)))
    put(twist, 0, minus(times(1.0 / mass, vector(state, 7)), apply(R, v)))
    put(twist, 3, w)


@compiled
def measure(
    row: np.ndarray,
    dt: float,
    mass: float,
    weight: np.ndarray,
    state: np.ndarray,
    pose: np.ndarray,
    w: Vector,
    R: np.ndarray,
    J: np.ndarray,
    feet: np.ndarray,
    wrench: np.ndarray,
    sensors: np.ndarray,
    tip_torque: np.ndarray,
    acceleration: np.ndarray,
) -> None:
    """Write the measurements at the beginning of a step, after `contact`; see `advance`."""
    legs, com = len(feet), cubics(row, COM, 0.0)
    for leg in range(legs):
        at, force = LEGS + leg * LEG, vector(feet[leg], 1)
        tip = vector(row, at + TIP)
        moment = minus(vector(feet[leg], 4), cross(minus(tip, com), force))
        tip_torque[3 * leg] = dot(vector(row, at + COXA_AXIS), moment)
        tip_torque[3 * leg + 1] = tip_torque[3 * leg + 2] = dot(vector(row, at + AXIS), moment)
        sensors[4 * leg] = feet[leg, 0]
        put(sensors, 4 * leg + 1, apply(R, force))
        put(sensors, 4 * legs + 3 * leg, plus(vector(pose, 0), apply(R, tip)))
    # J w' = moment - J' w - l' - w x (J w + l).
    J_rate = np.empty((3, 3))
    fill_symmetric(rates(row, INERTIA, 0.0, dt), rates(row, INERTIA + 12, 0.0, dt), J_rate)
    momentum = apply_transposed(R, vector(state, 10))
    gyration = plus(plus(apply(J_rate, w), rates(row, MOMENTUM, 0.0, dt)), cross(w, momentum))
    turning = solve(J, minus(vector(wrench, 3), gyration))
    # Centre of mass against the origin: c'' + 2 w x c' + w' x c + w x (w x c), in body axes.
    com_rate = rates(row, COM, 0.0, dt)
    relative = plus(vector(row, COM_ACCELERATION), cross(turning, com))
    relative = plus(relative, cross(w, plus(times(2.0, com_rate), cross(w, com))))
    linear = apply(R, minus(times(1.0 / mass, vector(wrench, 0)), relative))
    put(acceleration, 0, plus(times(1.0 / mass, vector(weight, 0)), linear))
    put(acceleration, 3, apply(R, turning))


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
    tip_torque: np.ndarray,
    acceleration: np.ndarray,
) -> None:
    """Make a step per row, and write the measurements at its beginning.

    Args:
        rows: The legs in each step, from `leg_rows`.
        dt: Time step [s].
        substeps: Substeps of a step.
        last: Whether the last row is measured and not stepped.
        mass: Of the robot [kg].
        weight: Of the robot, world axes [N].
        planes: As of `contact`.
        law: As of `contact`.
        pose: Position and quaternion of the body frame, advanced.
        twist: Its velocity in world axes and angular velocity in body axes, advanced.
        log_pose: A row of the pose per step.
        log_twist: A row of the twist per step.
        sensors: As of `build_model`, a row per step.
        tip_torque: Joint torques of the feet's forces beyond those of forces at the tips.
        acceleration: Of the body frame's origin, and angular acceleration, world axes.
    """
    R, J, none = np.empty((3, 3)), np.empty((3, 3)), np.empty((0, 6))
    feet, wrench, state = np.empty((len(planes), 7)), np.empty(6), np.empty(13)
    for k in range(len(rows)):
        row = rows[k]
        fill_state(row, dt, mass, pose, twist, state)
        w = contact(row, 0.0, dt, state, mass, planes, law, R, J, feet, wrench, none)
        log_pose[k, :7], log_twist[k, :6] = pose, twist
        measured = sensors[k], tip_torque[k], acceleration[k]
        measure(row, dt, mass, weight, state, pose, w, R, J, feet, wrench, *measured)
        if last and k == len(rows) - 1:
            return
        move(row, dt, substeps, mass, weight, planes, law, state, feet)
        fill_twist(row, dt, mass, state, pose, twist)
