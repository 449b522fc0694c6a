"""Swing trajectories of the feet, and of legs that are held in the air."""

from __future__ import annotations

import numpy as np

from phasmid.compiled import compiled
from phasmid.control.reach import joint_margin
from phasmid.control.types import Manoeuvre, Model, State
from phasmid.control.vectors import cross, rotate
from phasmid.kinematics.leg_kernels import forward_kinematics
from phasmid.kinematics.vector_kernels import quintic

FREE = 0.15
"""Share of a swing at each end over which a foot returns to its curve completely."""

SOFT = 0.06
"""Width of the zone before a joint limit in which a swinging joint yields [rad]."""


@compiled
def advance_quintic(
    position: np.ndarray,
    velocity: np.ndarray,
    acceleration: np.ndarray,
    goal: np.ndarray,
    left: float,
    h: float,
) -> None:
    """Advance a motion by a time step along the quintic to rest at a goal after the time left [s].

    With an unchanged goal this is the same curve at every update; where the goal moves, the curve
    continues into another without a jump.
    """
    t = left
    for i in range(3):
        p, v, a = position[i], velocity[i], acceleration[i]
        # p + v t + a t²/2 + b t³ + c t⁴ + d t⁵ is at rest at the goal after t.
        gap = goal[i] - p
        b = (20 * gap - 12 * v * t - 3 * a * t * t) / (2 * t**3)
        c = (-30 * gap + 16 * v * t + 3 * a * t * t) / (2 * t**4)
        d = (12 * gap - 6 * v * t - a * t * t) / (2 * t**5)
        position[i] = p + h * (v + h * (a / 2 + h * (b + h * (c + h * d))))
        velocity[i] = v + h * (a + h * (3 * b + h * (4 * c + h * 5 * d)))
        acceleration[i] = a + h * (6 * b + h * (12 * c + h * 20 * d))


@compiled
def lift(s: float, time: float, height: float) -> tuple[float, float, float]:
    """Return height [m], velocity and acceleration of the lift at a part s of a swing.

    It is at rest at both ends.
    """
    x, y = s * (1 - s), 1 - 2 * s
    top = 64 * height
    return (
        top * x**3,
        top * 3 * x * x * y / time,
        top * (6 * x * y * y - 6 * x * x) / time**2,
    )


@compiled
def blend(s: float, time: float) -> tuple[float, float, float]:
    """Return a quintic from 0 to 1 between rest and rest, its velocity and acceleration."""
    share, rate, acceleration = quintic(s)
    return share, rate / time, acceleration / time**2


@compiled
def set_times(state: State, leg: int, duration: float, height: float) -> None:
    """Begin a curve of a foot with a duration [s] and a lift [m], without lateral displacement."""
    state.swing_elapsed[leg] = 0.0
    state.swing_lateral[leg] = 0.0
    state.swing_duration[leg], state.swing_height[leg] = duration, height


@compiled
def restart_line(state: State, leg: int) -> None:
    """Begin the line of a foot's curve at its present place, velocity and acceleration."""
    state.line_position[leg] = state.foot[leg]
    state.line_velocity[leg] = state.foot_velocity[leg]
    state.line_acceleration[leg] = state.foot_acceleration[leg]


@compiled
def halt_foot(state: State, leg: int) -> None:
    """Bring a foot to rest where it is, at once."""
    state.foot_velocity[leg] = 0.0
    state.foot_acceleration[leg] = 0.0
    restart_line(state, leg)


@compiled
def stop_foot(state: State, leg: int) -> None:
    """Bring a foot to rest where it is, at once, and make that its touchdown."""
    state.manoeuvre[leg] = Manoeuvre.NONE
    state.touchdown[leg] = state.foot[leg]
    halt_foot(state, leg)


@compiled
def raise_foot(state: State, leg: int) -> None:
    """Write position and motion of a swinging foot in odom: line, lift and lateral displacement."""
    s = state.swing_elapsed[leg] / state.swing_duration[leg]
    z, v, a = lift(min(s, 1.0), state.swing_duration[leg], 1.0)
    lateral = state.swing_lateral[leg]
    top = np.array((lateral[0], lateral[1], state.swing_height[leg]))
    state.foot[leg] = state.line_position[leg] + z * top
    state.foot_velocity[leg] = state.line_velocity[leg] + v * top
    state.foot_acceleration[leg] = state.line_acceleration[leg] + a * top


@compiled
def soft_limit(
    depth: float, velocity: float, acceleration: float, width: float
) -> tuple[float, float, float]:
    """Return by how much a joint yields in the zone before its limit, with time derivatives.

    At the depth d > 0 in a zone of width w it yields d - d (1 + (d/w)³)^(-1/3). It never passes w.

    Args:
        depth: Depth in the zone [rad].
        velocity: First time derivative of the depth [rad/s].
        acceleration: Second time derivative [rad/s²].
        width: Width of the zone [rad].
    """
    base = 1.0 + (depth / width) ** 3
    slope = 1.0 - base ** (-4 / 3)
    curvature = 4 * depth * depth / width**3 * base ** (-7 / 3)
    return (
        depth - depth * base ** (-1 / 3),
        slope * velocity,
        curvature * velocity * velocity + slope * acceleration,
    )


@compiled
def soften_joint_limits(state: State, model: Model, leg: int) -> bool:
    """Let the joints of a swinging leg yield near their limits; return whether they keep them.

    In the middle of a swing a foot may leave its curve. Angles, velocities and accelerations are
    continuous; at both ends of the swing nothing changes.
    """
    time, q, qd, qdd = state.swing_duration[leg], state.q[leg], state.qd[leg], state.qdd[leg]
    part = state.swing_elapsed[leg] / time
    # A curve without lift, straight down or back, began in the air.
    begun = part if state.swing_height[leg] > 0.0 or state.manoeuvre[leg] == Manoeuvre.RISE else 1.0
    to_end = min(min(begun, 1.0 - part) / FREE, 1.0)
    share, share_rate, share_acceleration = blend(to_end, FREE * time)
    if part > 0.5:
        share_rate = -share_rate
    for k in range(3):
        low, high = model.limits[leg, k, 0], model.limits[leg, k, 1]
        margin, width = joint_margin(model, leg, k), min(SOFT, (high - low) / 8)
        for sign in (-1.0, 1.0):
            limit = high if sign > 0 else low
            depth = sign * q[k] - (sign * limit - margin / 4 - width)
            if depth <= 0.0:
                continue
            yielded, rate, acceleration = soft_limit(depth, sign * qd[k], sign * qdd[k], width)
            q[k] -= sign * share * yielded
            qd[k] -= sign * (share * rate + share_rate * yielded)
            qdd[k] -= sign * (
                share * acceleration + 2 * share_rate * rate + share_acceleration * yielded
            )
        if not (low + margin / 5 <= q[k] <= high - margin / 5):
            return False
    return True


@compiled
def foot_at_joints(state: State, model: Model, leg: int) -> np.ndarray:
    """Write a foot in odom from its joint angles; return its vector from the body [m]."""
    q, lengths = state.q[leg], model.lengths[leg]
    foot = np.array(forward_kinematics(lengths, lengths[3], q[0], q[1], q[2]))
    arm = rotate(state.R_odom_body, model.p_body_hip[leg] + rotate(model.R_body_hip[leg], foot))
    state.foot[leg] = state.body_position + arm
    return arm


@compiled
def hold_leg(state: State, model: Model, leg: int, h: float) -> None:
    """Fold a leg that is held in the air, and write its foot in odom."""
    q, qd, qdd = state.q[leg], state.qd[leg], state.qdd[leg]
    left = state.swing_duration[leg] - state.swing_elapsed[leg]
    if h < left:
        advance_quintic(q, qd, qdd, model.folded[leg], left, h)
        state.swing_elapsed[leg] += h
    else:
        state.swing_elapsed[leg] = state.swing_duration[leg]
        q[:] = model.folded[leg]
        qd[:] = 0.0
        qdd[:] = 0.0
    arm, w, wd = (
        foot_at_joints(state, model, leg),
        state.angular_velocity,
        state.angular_acceleration,
    )
    # As if it were fixed to the body: its own motion has ended when it is used again.
    v = cross(w, arm)
    state.foot_velocity[leg] = state.body_velocity + v
    state.foot_acceleration[leg] = state.body_acceleration + cross(wd, arm) + cross(w, v)
