"""Foot forces within friction and torque limits at one instant, by a quadratic programme.

Unknowns are y of F = F_least + √share y for each foot that carries load, and s, the part of the
motion that is left out. The programme minimises |y|² + s² + `MOTION_COST` s. Forces are in units of
the robot's load at rest, moments in units of that load times the largest distance of a foot.
"""

from __future__ import annotations

import math

import daqp
import numpy as np
from scipy.linalg import block_diag

from phasmid.compiled import compiled
from phasmid.control.feed_forward.inverse_dynamics import solve_inverse_dynamics
from phasmid.control.feed_forward.load_sharing import (
    NEGLIGIBLE,
    load_joints,
    utilisation_of,
)
from phasmid.control.feed_forward.state import Parameters, State
from phasmid.forces.load import grasp_matrix

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
def solve_at_rest(states: np.ndarray, robots: np.ndarray) -> None:
    """Write the forces that the pose of the motion requires at rest."""
    state = states[0]
    state.pose.R_world_body[:] = state.motion.R_world_body
    state.pose.q[:] = state.motion.q
    solve_inverse_dynamics(robots[0], state.pose, state.at_rest)


def limit_forces(state: State, robot: Parameters) -> bool:
    """Replace the cheapest forces, and the torques, by those nearest that keep all limits.

    Args:
        state: After `solve_at_rest`; forces, torques and `motion_scale` are written.
        robot: Friction.

    Returns:
        Whether there are such forces.
    """
    required, rest, force = state.required, state.at_rest, state.foot_force
    load, carries = np.abs(rest.wrench[:3]).max(), state.load_share >= NEGLIGIBLE
    count = int(carries.sum())
    if not (load > 0.0 and count):
        return False
    feet, J = required.foot[carries], required.jacobian[carries]
    unit, root = 1.0 / max(np.abs(feet).max(), 1e-9), np.sqrt(state.load_share[carries])
    A = np.zeros((6 + (FACES + 3) * count, 3 * count + 1))
    lower, upper = np.full(sum(A.shape), -UNBOUNDED), np.full(sum(A.shape), UNBOUNDED)
    lower[3 * count], upper[3 * count] = 0.0, 1.0
    bounds = lower[3 * count + 1 :], upper[3 * count + 1 :]
    # The part of the motion that is left out needs no wrench.
    A[:6, -1] = (required.wrench - rest.wrench) / load
    A[3:6, -1] *= unit
    bounds[0][:6] = bounds[1][:6] = 0.0
    torque = required.torque - np.einsum("lij,li->lj", required.jacobian, force)
    faces = _pyramid(state.normals[carries], robot.friction * INSCRIBED)
    friction, torques = slice(6, 6 + FACES * count), slice(6 + FACES * count, None)
    A[:6, :-1] = grasp_matrix(unit * feet)
    A[friction, :-1] = block_diag(*faces)
    A[torques, :-1] = block_diag(*-J.swapaxes(1, 2))
    A[:, :-1] *= np.repeat(root, 3)
    A[torques, -1] = (rest.torque - required.torque)[carries].ravel() / load
    bounds[1][friction] = -(faces @ force[carries][..., None]).ravel() / load
    low, high = (state.torque_limits - torque)[:, carries] / load
    bounds[0][torques], bounds[1][torques] = low.ravel(), high.ravel()
    kinds = np.zeros(len(lower), np.int32)
    kinds[3 * count + 1 : 3 * count + 7] = EQUALITY
    cost = np.zeros(A.shape[1])
    cost[-1] = MOTION_COST
    x, _, flag, _ = daqp.solve(np.eye(A.shape[1]), cost, A, upper, lower, kinds)
    if flag <= 0:
        return False
    scale = max(1.0 - float(x[-1]), 0.0)
    state.motion_scale = 1.0 if scale >= WHOLE else scale
    force[~carries] = 0.0
    force[carries] += load * root[:, None] * x[:-1].reshape(-1, 3)
    load_joints(state)
    state.joint_torque += (1.0 - state.motion_scale) * (rest.torque - required.torque)
    state.torque_utilisation = utilisation_of(state)
    return True


def _pyramid(normals: np.ndarray, friction: float) -> np.ndarray:
    """Return the outward normals of the faces of friction pyramids, shape (feet, FACES, 3)."""
    # The first tangent is made from the axis farthest from the normal.
    axes = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    t = axes - (axes * normals).sum(axis=1, keepdims=True) * normals
    t /= np.linalg.norm(t, axis=1, keepdims=True)
    angle = 2 * math.pi * np.arange(FACES)[:, None] / FACES
    t, u, n = (v[:, None] for v in (t, np.cross(normals, t), normals))
    return np.asarray(np.cos(angle) * t + np.sin(angle) * u - friction * n)
