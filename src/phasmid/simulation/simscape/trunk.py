"""Compiled integration of a free trunk with prescribed joints under the paper's contact law.

The state is the position c of the centre of mass, the orientation R as a quaternion, the momentum p
and the angular momentum L about the centre of mass, all in world axes:

    c' = p/m,   p' = m g + sum F,   L' = sum r x F,   R' = R [w]x,   w = J⁻¹ (Rᵀ L - l),

with the inertia J about the centre of mass and the angular momentum l of the legs, in body axes,
from `legs`. In flight both momenta are conserved to round-off.

Sticking friction is a stiff damper: its rate is static friction times weight over threshold and
mass, thousands per second. A substep is therefore linearly implicit: ROS2, a Rosenbrock method of
second order that keeps its order with any matrix in place of the Jacobian (Verwer, Spee, Blom and
Hundsdorfer 1999), and is L-stable with gamma = 1 - 1/√2. The matrix is that of the contacts'
dampers: normal damping, and friction as force over slip, which never turns a slip around.

The contact law is that of the Simscape Multibody Contact Forces Library, sphere to plane, with its
defaults (the tool of the paper's Figs. 9 to 11). The ground is level, at height 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from phasmid.compiled import compiled
from phasmid.kinematics.vector_kernels import (
    Vector,
    add,
    cross,
    dot,
    minus,
    quaternion_rows,
    rotate,
    times,
    vector,
)
from phasmid.simulation.contact import CONTACT_POINTS

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
        static: Coefficient of static friction.
        kinetic: Coefficient of kinetic friction, at most the static one.
        threshold: Slip up to which a point sticks [m/s].
        size: Greatest distance of two points of a foot [m].
        radius: Radius of a contact point [m].
    """

    dt: float
    substeps: int
    mass: float
    weight: Vector
    stiffness: float
    damping: float
    static: float
    kinetic: float
    threshold: float
    size: float
    radius: float


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


@compiled
def cubics(c: np.ndarray, s: float) -> Vector:
    """Return the values of three cubics at a share s of the step."""
    return (
        c[0, 0] + s * (c[0, 1] + s * (c[0, 2] + s * c[0, 3])),
        c[1, 0] + s * (c[1, 1] + s * (c[1, 2] + s * c[1, 3])),
        c[2, 0] + s * (c[2, 1] + s * (c[2, 2] + s * c[2, 3])),
    )


@compiled
def slopes(c: np.ndarray, s: float, dt: float) -> Vector:
    """Return the time derivatives of three cubics at a share s of the step."""
    return (
        (c[0, 1] + s * (2.0 * c[0, 2] + s * 3.0 * c[0, 3])) / dt,
        (c[1, 1] + s * (2.0 * c[1, 2] + s * 3.0 * c[1, 3])) / dt,
        (c[2, 1] + s * (2.0 * c[2, 2] + s * 3.0 * c[2, 3])) / dt,
    )


# The robot at a share s of the step, body axes ----------------------------------------------------


@compiled
def symmetric(diagonal: Vector, beside: Vector) -> np.ndarray:
    """Return a symmetric matrix from xx, yy, zz and xy, xz, yz."""
    (xx, yy, zz), (xy, xz, yz) = diagonal, beside
    return np.array(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))


@compiled
def inertia(trunk: np.record, s: float) -> np.ndarray:
    """Return the inertia about the centre of mass [kg·m²]."""
    return symmetric(cubics(trunk.inertia[:3], s), cubics(trunk.inertia[3:], s))


@compiled
def rotation(quaternion: np.ndarray) -> np.ndarray:
    """Return the rotation of a quaternion of any length."""
    w, x, y, z = quaternion
    return np.array(quaternion_rows(w, x, y, z, 2.0 / (w * w + x * x + y * y + z * z)))


@compiled
def angular_velocity(trunk: np.record, s: float, state: np.ndarray) -> np.ndarray:
    """Return w = J⁻¹ (Rᵀ L - l) [rad/s]."""
    own = rotation(state[3:7]).T @ state[10:] - np.array(cubics(trunk.momentum, s))
    return np.linalg.solve(inertia(trunk, s), own)


# Forces and rates ---------------------------------------------------------------------------------


@compiled
def contact(
    trunk: np.record,
    legs: np.ndarray,
    s: float,
    state: np.ndarray,
    w: Vector,
    constants: Constants,
    feet: np.ndarray,
    dampers: np.ndarray,
) -> tuple[Vector, Vector]:
    """Return force and moment of all contacts in a state, in body axes.

    Args:
        trunk: The robot in this step, from `leg_rows`.
        legs: Its legs, shape (L,).
        s: Share of the step that has passed.
        state: Centre of mass, quaternion, momentum and angular momentum, shape (13,).
        w: Angular velocity of the body [rad/s].
        constants: Of the run.
        feet: Filled with the number of touching points, force and moment on each foot, the moment
            about the centre of mass, shape (L, 7).
        dampers: Filled with the damping matrix of the contacts, by which a twist of the body
            changes the wrench, shape (6, 6); not where it has no rows.
    """
    dt, damping, threshold = constants.dt, constants.damping, constants.threshold
    R, com = rotation(state[3:7]), cubics(trunk.com, s)
    n = vector(R[2])
    velocity = vector(R.T @ state[7:10] / constants.mass)
    velocity = minus(velocity, slopes(trunk.com, s, dt))
    height = state[2] - constants.radius
    all_force, all_moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    feet[:] = 0.0
    dampers[:] = 0.0
    for leg in range(len(legs)):
        points, ends = legs[leg].points, legs[leg].turning
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
            below = times(constants.radius - depth / 2.0, n)
            r = minus(r, below)
            v = add(add(velocity, cross(w, r)), slopes(points[point], s, dt))
            v = minus(v, cross(turning, below))
            rising = dot(n, v)
            v = minus(v, times(rising, n))
            slip = math.sqrt(dot(v, v))
            normal = normal_force(depth, -rising, constants.stiffness, damping)
            drag = constants.static * normal / threshold
            if slip > threshold:
                friction = friction_coefficient(
                    slip, constants.static, constants.kinetic, threshold
                )
                drag = friction * normal / slip
            force = minus(times(normal, n), times(drag, v))
            feet[leg, 0] += 1.0
            foot_force = add(foot_force, force)
            foot_moment = add(foot_moment, cross(r, force))
            if len(dampers):
                add_dampers(dampers, damping if rising < 0.0 else 0.0, drag, n, r)
        feet[leg, 1:4], feet[leg, 4:7] = foot_force, foot_moment
        all_force, all_moment = add(all_force, foot_force), add(all_moment, foot_moment)
    return all_force, all_moment


@compiled
def add_dampers(dampers: np.ndarray, damping: float, drag: float, n: Vector, r: Vector) -> None:
    """Add damping along the normal n and drag across it, at the point r."""
    x, y, z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    for k, axis in ((drag, x), (drag, y), (drag, z), (damping - drag, n)):
        direction = axis + cross(r, axis)
        for i in range(6):
            for j in range(6):
                dampers[i, j] += k * direction[i] * direction[j]


@compiled
def rates(
    trunk: np.record,
    legs: np.ndarray,
    s: float,
    state: np.ndarray,
    constants: Constants,
    feet: np.ndarray,
    dampers: np.ndarray,
) -> np.ndarray:
    """Return the rate of the state; arguments as of `contact`."""
    w = vector(angular_velocity(trunk, s, state))
    force, moment = contact(trunk, legs, s, state, w, constants, feet, dampers)
    R, q, r = rotation(state[3:7]), state[3], vector(state[4:7])
    rate = np.empty(13)
    rate[:3] = state[7:10] / constants.mass
    rate[3] = -0.5 * dot(r, w)
    rate[4:7] = times(0.5, add(times(q, w), cross(r, w)))
    rate[7:10] = add(rotate(R, force), constants.weight)
    rate[10:] = rotate(R, moment)
    return rate


# Integration --------------------------------------------------------------------------------------


@compiled
def implicit_share(
    dampers: np.ndarray, mass: float, J: np.ndarray, R: np.ndarray, weight: float
) -> np.ndarray:
    """Return M (M + weight D)⁻¹ of the momenta, in world axes, and 1 of the positions."""
    M, turn, share = np.zeros((6, 6)), np.zeros((6, 6)), np.eye(13)
    M[:3, :3], M[3:, 3:] = mass * np.eye(3), J
    turn[:3, :3], turn[3:, 3:] = R, R
    share[7:, 7:] = turn @ M @ np.linalg.inv(M + weight * dampers) @ turn.T
    return share


@compiled
def move(
    trunk: np.record,
    legs: np.ndarray,
    constants: Constants,
    state: np.ndarray,
    feet: np.ndarray,
) -> np.ndarray:
    """Return the state after one step of equal substeps; arguments as of `contact`."""
    dampers, none = np.empty((6, 6)), np.empty((0, 6))
    h = constants.dt / constants.substeps
    for part in range(constants.substeps):
        s, end = part / constants.substeps, (part + 1.0) / constants.substeps
        f1 = rates(trunk, legs, s, state, constants, feet, dampers)
        R, J = rotation(state[3:7]), inertia(trunk, s)
        A = implicit_share(dampers, constants.mass, J, R, GAMMA * h)
        k1 = A @ f1
        stage = state + h * k1
        f2 = rates(trunk, legs, end, stage, constants, feet, none)
        k2 = A @ (f2 - 2.0 * k1)
        state = state + h * (1.5 * k1 + 0.5 * k2)
    state[3:7] /= math.sqrt(np.dot(state[3:7], state[3:7]))
    return state


@compiled
def to_state(
    trunk: np.record, dt: float, mass: float, pose: np.ndarray, twist: np.ndarray
) -> np.ndarray:
    """Return the state of pose and twist of the body frame, at the beginning of a step."""
    R, com, w = rotation(pose[3:]), np.array(cubics(trunk.com, 0.0)), twist[3:]
    v = np.array(slopes(trunk.com, 0.0, dt)) + np.cross(w, com)
    state = np.empty(13)
    state[:3], state[3:7] = pose[:3] + R @ com, pose[3:]
    state[7:10] = mass * (twist[:3] + R @ v)
    state[10:] = R @ (inertia(trunk, 0.0) @ w + np.array(cubics(trunk.momentum, 0.0)))
    return state


@compiled
def from_state(
    trunk: np.record, dt: float, mass: float, state: np.ndarray, pose: np.ndarray, twist: np.ndarray
) -> None:
    """Fill pose and twist of the body frame from the state, at the end of a step."""
    R, com = rotation(state[3:7]), np.array(cubics(trunk.com, 1.0))
    w = angular_velocity(trunk, 1.0, state)
    v = np.array(slopes(trunk.com, 1.0, dt)) + np.cross(w, com)
    pose[:3], pose[3:] = state[:3] - R @ com, state[3:7]
    twist[:3], twist[3:] = state[7:10] / mass - R @ v, w


@compiled
def body_acceleration(
    trunk: np.record, constants: Constants, state: np.ndarray, rate: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return linear and angular acceleration of the body frame at the beginning of a step."""
    dt, R, w = constants.dt, rotation(state[3:7]), angular_velocity(trunk, 0.0, state)
    com, com_rate = np.array(cubics(trunk.com, 0.0)), np.array(slopes(trunk.com, 0.0, dt))
    # J w' = moment - J' w - l' - w x (J w + l).
    J_rate = symmetric(slopes(trunk.inertia[:3], 0.0, dt), slopes(trunk.inertia[3:], 0.0, dt))
    gyration = J_rate @ w + np.array(slopes(trunk.momentum, 0.0, dt))
    gyration += np.cross(w, R.T @ state[10:])
    turning = np.linalg.solve(inertia(trunk, 0.0), R.T @ rate[10:] - gyration)
    # Centre of mass against the origin: c'' + 2 w x c' + w' x c + w x (w x c), in body axes.
    relative = trunk.com_acceleration + np.cross(turning, com)
    relative += np.cross(w, 2.0 * com_rate + np.cross(w, com))
    return rate[7:10] / constants.mass - R @ relative, R @ turning


@compiled
def advance(
    trunks: np.ndarray,
    legs: np.ndarray,
    constants: Constants,
    last: bool,
    pose: np.ndarray,
    twist: np.ndarray,
    log: np.ndarray,
    tip_torque: np.ndarray,
    acceleration: np.ndarray,
) -> None:
    """Make a step per row, and write the measurements at its beginning.

    Args:
        trunks: The robot in each of N steps, from `leg_rows`, shape (N,).
        legs: Its legs, shape (N, L).
        constants: Of the run.
        last: Whether the last row is measured and not stepped.
        pose: Position and quaternion of the body frame, advanced.
        twist: Its velocity in world axes and angular velocity in body axes, advanced.
        log: Samples, as of `empty_samples`, whose pose, twist and sensors are written.
        tip_torque: Joint torques of the feet's forces beyond those of forces at the tips.
        acceleration: Of the body frame's origin, and angular acceleration, world axes.
    """
    L, dt, mass = legs.shape[1], constants.dt, constants.mass
    feet, none = np.empty((L, 7)), np.empty((0, 6))
    for k in range(len(trunks)):
        trunk, sensors = trunks[k], log[k].sensors
        state = to_state(trunk, dt, mass, pose, twist)
        R, com = rotation(state[3:7]), np.array(cubics(trunk.com, 0.0))
        rate = rates(trunk, legs[k], 0.0, state, constants, feet, none)
        log[k].qpos[:7], log[k].qvel[:6] = pose, twist
        for i in range(L):
            leg, force = legs[k, i], feet[i, 1:4]
            at_tip = feet[i, 4:] - np.cross(leg.tip - com, force)
            tip_torque[k, i, 0] = np.dot(leg.coxa_axis, at_tip)
            tip_torque[k, i, 1:] = np.dot(leg.axis, at_tip)
            sensors[4 * i] = feet[i, 0]
            sensors[4 * i + 1 : 4 * i + 4] = R @ force
            sensors[4 * L + 3 * i : 4 * L + 3 * i + 3] = pose[:3] + R @ leg.tip
        linear, angular = body_acceleration(trunk, constants, state, rate)
        acceleration[k, :3], acceleration[k, 3:] = linear, angular
        if not (last and k == len(trunks) - 1):
            state = move(trunk, legs[k], constants, state, feet)
            from_state(trunk, dt, mass, state, pose, twist)
