"""Foot forces within friction and torque limits at one instant, by a quadratic programme.

Unknowns are y of F = F_least + √share y for each foot that carries load, and s, the part of the
motion that is left out. The programme minimises (|y|² + s²) / 2 + `MOTION_COST` s. Forces are in
units of the robot's load at rest, moments in units of that load times the largest distance of a
foot.
"""

from __future__ import annotations

import math

import daqp
import numpy as np

from phasmid.compiled import compiled
from phasmid.control.feed_forward.inverse_dynamics import solve_inverse_dynamics
from phasmid.control.feed_forward.load_sharing import (
    NEGLIGIBLE,
    load_joints,
    utilisation_of,
)

FACES = 8
"""Faces of the pyramid inside each friction cone; its edges lie on the cone."""

INSCRIBED = math.cos(math.pi / FACES)
"""Friction coefficient of the pyramid's faces divided by that of the cone."""

MOTION_COST = 1e3
"""Cost of leaving out all of the motion, beside forces of the size of the load."""

WHOLE = 1.0 - 1e-6
"""Part of the motion that counts as all of it: round-off of the programme slows nothing down."""

EQUALITY = 5
"""The solver's code of an equation."""

UNBOUNDED = 1e30
"""The solver's infinity."""


@compiled
def pyramid(normal: np.ndarray, friction: float) -> np.ndarray:
    """Return the outward normals of a friction pyramid's faces, shape (FACES, 3)."""
    axis, faces = np.zeros(3), np.empty((FACES, 3))
    # The first tangent is made from the axis farthest from the normal.
    axis[np.argmin(np.abs(normal))] = 1.0
    t = axis - (axis @ normal) * normal
    t /= math.sqrt(t @ t)
    u = np.cross(normal, t)
    for k in range(FACES):
        angle = 2 * math.pi * k / FACES
        faces[k] = math.cos(angle) * t + math.sin(angle) * u - friction * normal
    return faces


@compiled
def write_programme(
    states: np.ndarray, robots: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the programme for C loaded feet: its rows and their bounds.

    The rows are the wrench, the faces of the friction pyramids and the joint torques; there are
    none where no foot carries load.

    Args:
        states: Record of the feed-forward stage; what the pose requires at rest is written.
        robots: Record of its parameters.

    Returns:
        Rows, shape (6 + (FACES + 3) C, 3 C + 1); lower and upper bounds of the unknowns, then of
        the rows.
    """
    state, robot, legs = states[0], robots[0], states[0].leg_count
    required, rest = state.required, state.at_rest
    state.pose.R_world_body[:] = state.motion.R_world_body
    state.pose.q[:] = state.motion.q
    solve_inverse_dynamics(robot, state.pose, state.normals, rest)
    feet = np.flatnonzero(state.load_share[:legs] >= NEGLIGIBLE)
    load, count = np.abs(rest.wrench[:3]).max(), len(feet)
    rows = 6 + (FACES + 3) * count if load > 0.0 and count else 0
    last = 3 * count
    A = np.zeros((rows, last + 1))
    lower, upper = np.full(last + 1 + rows, -UNBOUNDED), np.full(last + 1 + rows, UNBOUNDED)
    if rows == 0:
        return A, lower, upper
    size = 0.0
    for leg in feet:
        size = max(size, np.abs(required.foot[leg]).max())
    unit = 1.0 / max(size, 1e-9)
    # The part of the motion that is left out needs no wrench.
    A[:6, last] = (required.wrench - rest.wrench) / load
    A[3:6, last] *= unit
    lower[last], upper[last] = 0.0, 1.0
    lowest, highest = lower[last + 1 :], upper[last + 1 :]
    lowest[:6], highest[:6] = 0.0, 0.0
    for k, leg in enumerate(feet):
        force, J, columns = state.foot_force[leg], required.jacobian[leg], A[:, 3 * k : 3 * k + 3]
        x, y, z = unit * required.foot[leg]
        columns[:3] = np.eye(3)
        columns[3, 1], columns[3, 2] = -z, y
        columns[4, 0], columns[4, 2] = z, -x
        columns[5, 0], columns[5, 1] = -y, x
        at = slice(6 + FACES * k, 6 + FACES * (k + 1))
        faces = pyramid(state.normals[leg], robot.friction * INSCRIBED)
        columns[at], highest[at] = faces, -(faces @ force) / load
        at = slice(6 + FACES * count + 3 * k, 6 + FACES * count + 3 * (k + 1))
        columns[at] = -J.T
        A[at, last] = (rest.torque[leg] - required.torque[leg]) / load
        torque = required.torque[leg] - J.T @ force
        lowest[at] = (state.torque_limits[0, leg] - torque) / load
        highest[at] = (state.torque_limits[1, leg] - torque) / load
        columns *= math.sqrt(state.load_share[leg])
    return A, lower, upper


@compiled
def apply_solution(states: np.ndarray, x: np.ndarray) -> None:
    """Write the forces of a solution, and their torques.

    Args:
        states: Record of the feed-forward stage.
        x: y of each loaded foot, then s, shape (3 C + 1,).
    """
    state, k = states[0], 0
    load = np.abs(state.at_rest.wrench[:3]).max()
    scale = max(1.0 - x[-1], 0.0)
    state.motion_scale = 1.0 if scale >= WHOLE else scale
    for leg in range(state.leg_count):
        if state.load_share[leg] >= NEGLIGIBLE:
            root = math.sqrt(state.load_share[leg])
            state.foot_force[leg] += load * root * x[3 * k : 3 * k + 3]
            k += 1
        else:
            state.foot_force[leg] = 0.0
    load_joints(state)
    left_out = state.at_rest.torque - state.required.torque
    state.joint_torque += (1.0 - state.motion_scale) * left_out
    state.torque_utilisation = utilisation_of(state)


def limit_forces(states: np.ndarray, robots: np.ndarray) -> bool:
    """Replace the cheapest forces, and the torques, by those nearest that keep all limits.

    Args:
        states: Record of the feed-forward stage; forces, torques and `motion_scale` are written,
            shape (1,).
        robots: Record of its parameters, shape (1,).

    Returns:
        Whether there are such forces.
    """
    A, lower, upper = write_programme(states, robots)
    if not len(A):
        return False
    count = A.shape[1]
    cost, kinds = np.zeros(count), np.zeros(len(lower), np.int32)
    cost[-1], kinds[count : count + 6] = MOTION_COST, EQUALITY
    x, _, flag, _ = daqp.solve(np.eye(count), cost, A, upper, lower, kinds)
    if flag > 0:
        apply_solution(states, np.asarray(x))
    return bool(flag > 0)
