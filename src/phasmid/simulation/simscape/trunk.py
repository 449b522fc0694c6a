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
from typing import NamedTuple, TypeAlias

import numpy as np

from phasmid.compiled import compiled
from phasmid.dynamics.whole_body_kernels import Vector, add, cross, vector
from phasmid.simulation.contact import CONTACT_POINTS, POINT_RADIUS

Matrix: TypeAlias = tuple[Vector, Vector, Vector]
"""Rows."""

GAMMA = 1.0 - math.sqrt(0.5)
"""Coefficient of ROS2."""

KINETIC_FROM = 1.5
"""Slip, over the threshold speed, from which friction is kinetic."""


class Constants(NamedTuple):
    """Constants of a run.

    Attributes:
        dt: Time step [s].
        substeps: Substeps of a time step.
        mass: Of the robot [kg].
        weight: Of the robot, world axes [N].
        stiffness: Of a contact point [N/m].
        damping: Of a contact point that sinks [N·s/m].
        kinetic: Coefficient of kinetic friction.
        threshold: Slip up to which a point sticks [m/s].
        size: Greatest distance of two points of a foot [m].
    """

    dt: float
    substeps: int
    mass: float
    weight: Vector
    stiffness: float
    damping: float
    kinetic: float
    threshold: float
    size: float


class State(NamedTuple):
    """State of the trunk, world axes.

    Attributes:
        com: Centre of mass of the robot [m].
        quaternion: Orientation (w x y z).
        momentum: [N·s].
        spin: Angular momentum about the centre of mass [N·m·s].
    """

    com: Vector
    quaternion: tuple[float, float, float, float]
    momentum: Vector
    spin: Vector


@compiled
def normal_force(depth: float, sinking: float, stiffness: float, damping: float) -> float:
    """Return the normal force on one point [N]: a spring, and a damper while the point sinks."""
    if depth <= 0.0:
        return 0.0
    return stiffness * depth + damping * max(sinking, 0.0)


@compiled
def friction_coefficient(speed: float, static: float, kinetic: float, threshold: float) -> float:
    """Return friction over normal force of one point.

    It rises linearly with the slip to the static coefficient at the threshold speed, and falls
    linearly to the kinetic one at 1.5 times that speed.
    """
    if speed <= threshold:
        return static * speed / threshold
    if speed >= KINETIC_FROM * threshold:
        return kinetic
    return static - (static - kinetic) * (speed / threshold - 1.0) / (KINETIC_FROM - 1.0)


# Vectors are tuples, which the compiler keeps in registers.


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
def apply(M: Matrix, a: Vector) -> Vector:
    """Return M a."""
    return dot(M[0], a), dot(M[1], a), dot(M[2], a)


@compiled
def apply_transposed(M: Matrix, a: Vector) -> Vector:
    """Return Mᵀ a."""
    return add(add(times(a[0], M[0]), times(a[1], M[1])), times(a[2], M[2]))


@compiled
def solve(J: Matrix, b: Vector) -> Vector:
    """Return x of J x = b for a symmetric matrix."""
    x, y, z = J
    yz, zx, xy = cross(y, z), cross(z, x), cross(x, y)
    d = 1.0 / dot(x, yz)
    return times(d, add(add(times(b[0], yz), times(b[1], zx)), times(b[2], xy)))


@compiled
def rotation(quaternion: tuple[float, float, float, float]) -> Matrix:
    """Return the rotation of a quaternion of any length."""
    w, x, y, z = quaternion
    n = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        (1 - n * (y * y + z * z), n * (x * y - w * z), n * (x * z + w * y)),
        (n * (x * y + w * z), 1 - n * (x * x + z * z), n * (y * z - w * x)),
        (n * (x * z - w * y), n * (y * z + w * x), 1 - n * (x * x + y * y)),
    )


# Legs: cubics at a share s of the step ------------------------------------------------------------


@compiled
def cubics(c: np.ndarray, s: float) -> Vector:
    """Return the values of three cubics."""
    return (
        c[0, 0] + s * (c[0, 1] + s * (c[0, 2] + s * c[0, 3])),
        c[1, 0] + s * (c[1, 1] + s * (c[1, 2] + s * c[1, 3])),
        c[2, 0] + s * (c[2, 1] + s * (c[2, 2] + s * c[2, 3])),
    )


@compiled
def rates(c: np.ndarray, s: float, dt: float) -> Vector:
    """Return the time derivatives of three cubics."""
    return (
        (c[0, 1] + s * (2.0 * c[0, 2] + s * 3.0 * c[0, 3])) / dt,
        (c[1, 1] + s * (2.0 * c[1, 2] + s * 3.0 * c[1, 3])) / dt,
        (c[2, 1] + s * (2.0 * c[2, 2] + s * 3.0 * c[2, 3])) / dt,
    )


@compiled
def symmetric(diagonal: Vector, beside: Vector) -> Matrix:
    """Return a symmetric matrix from xx, yy, zz and xy, xz, yz."""
    (xx, yy, zz), (xy, xz, yz) = diagonal, beside
    return (xx, xy, xz), (xy, yy, yz), (xz, yz, zz)


@compiled
def inertia(trunk: np.record, s: float) -> Matrix:
    """Return the inertia about the centre of mass, body axes [kg·m²]."""
    return symmetric(cubics(trunk.inertia[:3], s), cubics(trunk.inertia[3:], s))


# Forces -------------------------------------------------------------------------------------------


@compiled
def contact(
    trunk: np.record,
    legs: np.ndarray,
    s: float,
    state: State,
    constants: Constants,
    planes: np.ndarray,
    feet: np.ndarray,
    dampers: np.ndarray,
) -> tuple[Vector, Vector, Vector]:
    """Compute the contact forces in a state, in body axes.

    Args:
        trunk: The robot in this step, from `leg_rows`.
        legs: Its legs, shape (L,).
        s: Share of the step that has passed.
        state: Of the trunk.
        constants: Of the run.
        planes: Ground under each leg: normal in world axes, distance from the origin along it, and
            static coefficient of friction, shape (L, 5).
        feet: Filled with the number of touching points, force and moment on each foot, the moment
            about the centre of mass, shape (L, 7).
        dampers: Filled with the lower triangle of the damping matrix of the contacts (6, 6), by
            which a twist of the body changes the wrench; not where it has no rows.

    Returns:
        Angular velocity of the body, force and moment of all feet.
    """
    dt, mass, damping = constants.dt, constants.mass, constants.damping
    threshold = constants.threshold
    R, com = rotation(state.quaternion), cubics(trunk.com, s)
    w = solve(inertia(trunk, s), minus(apply_transposed(R, state.spin), cubics(trunk.momentum, s)))
    velocity = apply_transposed(R, times(1.0 / mass, state.momentum))
    velocity = minus(velocity, rates(trunk.com, s, dt))
    all_force, all_moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    feet[:] = 0.0
    dampers[:] = 0.0
    for leg in range(len(planes)):
        points, ends = legs[leg].points, legs[leg].turning
        upward, static = vector(planes[leg]), planes[leg, 4]
        n = apply_transposed(R, upward)
        height = dot(upward, state.com) - planes[leg, 3] - POINT_RADIUS
        begin, end = vector(ends[0]), vector(ends[1])
        turning = add(begin, times(s, minus(end, begin)))
        foot_force, foot_moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for point in range(CONTACT_POINTS):
            r = minus(cubics(points[point], s), com)
            depth = -(height + dot(n, r))
            if depth <= 0.0:
                # No other point of this foot can reach the ground.
                if depth < -constants.size:
                    break
                continue
            # The point of the tibia that touches, halfway into the ground.
            below = times(POINT_RADIUS - depth / 2.0, n)
            r = minus(r, below)
            v = add(add(velocity, cross(w, r)), rates(points[point], s, dt))
            v = minus(v, cross(turning, below))
            rising = dot(n, v)
            v = minus(v, times(rising, n))
            slip = math.sqrt(dot(v, v))
            normal = normal_force(depth, -rising, constants.stiffness, damping)
            drag = static * normal / threshold
            if slip > threshold:
                least = min(constants.kinetic, static)
                drag = friction_coefficient(slip, static, least, threshold) * normal / slip
            force = minus(times(normal, n), times(drag, v))
            feet[leg, 0] += 1.0
            foot_force = add(foot_force, force)
            foot_moment = add(foot_moment, cross(r, force))
            if len(dampers):
                add_dampers(dampers, damping if rising < 0.0 else 0.0, drag, n, r)
        feet[leg, 1:4], feet[leg, 4:7] = foot_force, foot_moment
        all_force, all_moment = add(all_force, foot_force), add(all_moment, foot_moment)
    return w, all_force, all_moment


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
def factorise(dampers: np.ndarray, mass: float, J: Matrix, weight: float, C: np.ndarray) -> None:
    """Fill C with the Cholesky factor of the mass matrix plus a weight times the dampers."""
    for i in range(6):
        for j in range(i + 1):
            value = weight * dampers[i, j]
            if i >= 3 and j >= 3:
                value += J[i - 3][j - 3]
            elif i == j:
                value += mass
            for k in range(j):
                value -= C[i, k] * C[j, k]
            C[i, j] = math.sqrt(value) if i == j else value / C[j, j]


@compiled
def damp(C: np.ndarray, mass: float, J: Matrix, b: np.ndarray, x: np.ndarray) -> None:
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
    x[:3], x[3:] = times(mass, vector(x)), apply(J, vector(x[3:]))


@compiled
def drift(state: State, w: Vector, mass: float) -> tuple[Vector, float, Vector]:
    """Return the rates of the centre of mass, and of scalar and vector of the quaternion."""
    q, r = state.quaternion[0], state.quaternion[1:]
    turn = times(0.5, add(times(q, w), cross(r, w)))
    return times(1.0 / mass, state.momentum), -0.5 * dot(r, w), turn


@compiled
def drifted(state: State, change: tuple[Vector, float, Vector], h: float) -> State:
    """Return the state moved by rates of position and orientation over a time."""
    velocity, scalar, turn = change
    x, y, z = add(state.quaternion[1:], times(h, turn))
    quaternion = (state.quaternion[0] + h * scalar, x, y, z)
    return State(add(state.com, times(h, velocity)), quaternion, state.momentum, state.spin)


@compiled
def pushed(state: State, R: Matrix, wrench: np.ndarray, h: float) -> State:
    """Return the state after a force and a moment in body axes over a time."""
    momentum = add(state.momentum, times(h, apply(R, vector(wrench))))
    spin = add(state.spin, times(h, apply(R, vector(wrench[3:]))))
    return State(state.com, state.quaternion, momentum, spin)


@compiled
def move(
    trunk: np.record,
    legs: np.ndarray,
    constants: Constants,
    planes: np.ndarray,
    state: State,
    feet: np.ndarray,
) -> State:
    """Return the state after one step of equal substeps; arguments as of `contact`."""
    dampers, C, none = np.empty((6, 6)), np.empty((6, 6)), np.empty((0, 6))
    total, k1, k2 = np.empty(6), np.empty(6), np.empty(6)
    mass, h = constants.mass, constants.dt / constants.substeps
    for part in range(constants.substeps):
        s = part / constants.substeps
        w, force, moment = contact(trunk, legs, s, state, constants, planes, feet, dampers)
        R, J = rotation(state.quaternion), inertia(trunk, s)
        factorise(dampers, mass, J, GAMMA * h, C)
        total[:3] = apply_transposed(R, add(apply(R, force), constants.weight))
        total[3:] = moment
        damp(C, mass, J, total, k1)
        rates_1 = drift(state, w, mass)
        stage = pushed(drifted(state, rates_1, h), R, k1, h)
        s = (part + 1.0) / constants.substeps
        w, force, moment = contact(trunk, legs, s, stage, constants, planes, feet, none)
        rates_2, R2 = drift(stage, w, mass), rotation(stage.quaternion)
        total[:3] = apply_transposed(R, add(apply(R2, force), constants.weight))
        total[3:] = apply_transposed(R, apply(R2, moment))
        total -= 2.0 * k1
        damp(C, mass, J, total, k2)
        state = drifted(drifted(state, rates_1, 0.5 * h), rates_2, 0.5 * h)
        state = pushed(state, R, 1.5 * k1 + 0.5 * k2, h)
    w, x, y, z = state.quaternion
    n = math.sqrt(w * w + x * x + y * y + z * z)
    return State(state.com, (w / n, x / n, y / n, z / n), state.momentum, state.spin)


@compiled
def to_state(
    trunk: np.record, dt: float, mass: float, pose: np.ndarray, twist: np.ndarray
) -> State:
    """Return the state of pose and twist of the body frame, at the beginning of a step."""
    quaternion = (pose[3], pose[4], pose[5], pose[6])
    R, com, w = rotation(quaternion), cubics(trunk.com, 0.0), vector(twist[3:])
    v = add(rates(trunk.com, 0.0, dt), cross(w, com))
    momentum = times(mass, add(vector(twist), apply(R, v)))
    spin = apply(R, add(apply(inertia(trunk, 0.0), w), cubics(trunk.momentum, 0.0)))
    return State(add(vector(pose), apply(R, com)), quaternion, momentum, spin)


@compiled
def from_state(
    trunk: np.record, dt: float, mass: float, state: State, pose: np.ndarray, twist: np.ndarray
) -> None:
    """Fill pose and twist of the body frame from the state, at the end of a step."""
    R, com = rotation(state.quaternion), cubics(trunk.com, 1.0)
    momentum = minus(apply_transposed(R, state.spin), cubics(trunk.momentum, 1.0))
    w = solve(inertia(trunk, 1.0), momentum)
    v = add(rates(trunk.com, 1.0, dt), cross(w, com))
    pose[:3], pose[3:] = minus(state.com, apply(R, com)), state.quaternion
    twist[:3], twist[3:] = minus(times(1.0 / mass, state.momentum), apply(R, v)), w


@compiled
def body_acceleration(
    trunk: np.record, constants: Constants, state: State, w: Vector, force: Vector, moment: Vector
) -> tuple[Vector, Vector]:
    """Return linear and angular acceleration of the body frame at the beginning of a step."""
    dt, mass = constants.dt, constants.mass
    R, com, com_rate = rotation(state.quaternion), cubics(trunk.com, 0.0), rates(trunk.com, 0.0, dt)
    # J w' = moment - J' w - l' - w x (J w + l).
    J_rate = symmetric(rates(trunk.inertia[:3], 0.0, dt), rates(trunk.inertia[3:], 0.0, dt))
    gyration = add(apply(J_rate, w), rates(trunk.momentum, 0.0, dt))
    gyration = add(gyration, cross(w, apply_transposed(R, state.spin)))
    turning = solve(inertia(trunk, 0.0), minus(moment, gyration))
    # Centre of mass against the origin: c'' + 2 w x c' + w' x c + w x (w x c), in body axes.
    relative = add(vector(trunk.com_acceleration), cross(turning, com))
    relative = add(relative, cross(w, add(times(2.0, com_rate), cross(w, com))))
    linear = apply(R, minus(times(1.0 / mass, force), relative))
    return add(times(1.0 / mass, constants.weight), linear), apply(R, turning)


@compiled
def advance(
    trunks: np.ndarray,
    legs: np.ndarray,
    constants: Constants,
    last: bool,
    planes: np.ndarray,
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
        trunks: The robot in each of N steps, from `leg_rows`, shape (N,).
        legs: Its legs, shape (N, L).
        constants: Of the run.
        last: Whether the last row is measured and not stepped.
        planes: As of `contact`.
        pose: Position and quaternion of the body frame, advanced.
        twist: Its velocity in world axes and angular velocity in body axes, advanced.
        log_pose: A row of the pose per step.
        log_twist: A row of the twist per step.
        sensors: As of `build_model`, a row per step.
        tip_torque: Joint torques of the feet's forces beyond those of forces at the tips.
        acceleration: Of the body frame's origin, and angular acceleration, world axes.
    """
    L, dt, mass = len(planes), constants.dt, constants.mass
    feet, none = np.empty((L, 7)), np.empty((0, 6))
    for k in range(len(trunks)):
        trunk = trunks[k]
        state = to_state(trunk, dt, mass, pose, twist)
        R, com = rotation(state.quaternion), cubics(trunk.com, 0.0)
        w, force, moment = contact(trunk, legs[k], 0.0, state, constants, planes, feet, none)
        log_pose[k, :7], log_twist[k, :6] = pose, twist
        for i in range(L):
            leg, foot_force = legs[k, i], vector(feet[i, 1:])
            tip = vector(leg.tip)
            at_tip = minus(vector(feet[i, 4:]), cross(minus(tip, com), foot_force))
            tip_torque[k, i, 0] = dot(vector(leg.coxa_axis), at_tip)
            tip_torque[k, i, 1:] = dot(vector(leg.axis), at_tip)
            sensors[k, 4 * i] = feet[i, 0]
            sensors[k, 4 * i + 1 : 4 * i + 4] = apply(R, foot_force)
            sensors[k, 4 * L + 3 * i : 4 * L + 3 * i + 3] = add(vector(pose), apply(R, tip))
        linear, angular = body_acceleration(trunk, constants, state, w, force, moment)
        acceleration[k, :3], acceleration[k, 3:] = linear, angular
        if not (last and k == len(trunks) - 1):
            state = move(trunk, legs[k], constants, planes, state, feet)
            from_state(trunk, dt, mass, state, pose, twist)
