"""Foot forces within friction and torque limits at one instant, by a quadratic programme.

Unknowns are y of F = F_least + W y for each foot that carries load, and s, the part of the motion
that is left out. The programme minimises |y|² + s² + `MOTION_COST` s.
"""

from __future__ import annotations

import math

import daqp
import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled, internal
from phasmid.control.feed_forward.inverse_dynamics import solve_inverse_dynamics
from phasmid.control.feed_forward.load_sharing import (
    NEGLIGIBLE,
    friction_of,
    grasp_of,
    load_joints,
    utilisation_of,
)

FACES = 8
"""Faces of the pyramid inside each friction cone; its edges lie on the cone."""

INSCRIBED = math.cos(math.pi / FACES)
"""Friction coefficient of the pyramid's faces divided by that of the cone."""

MOTION_COST = 1e3
"""Cost of leaving out all of the motion, beside forces of the size of the load."""

EQUALITY = 5
"""The solver's code of an equation."""

UNBOUNDED = 1e30
"""The solver's infinity."""


class ContactForceQP:
    """Quadratic programme of a number of feet that carry load.

    Attributes:
        A: Constraint matrix: six rows of the wrench, then friction, then torque.
        lower: Lower bounds of unknowns and rows.
        upper: Upper bounds of unknowns and rows.
        W: Square roots of the feet's inverse costs, shape (feet, 3, 3).
    """

    def __init__(self, feet: int) -> None:
        size, rows = 3 * feet + 1, 6 + (FACES + 3) * feet
        self.A, self.W = np.zeros((rows, size)), np.zeros((feet, 3, 3))
        self.lower, self.upper = np.zeros(size + rows), np.zeros(size + rows)
        self._hessian, self._cost = np.eye(size), np.zeros(size)
        self._cost[-1] = MOTION_COST
        self._kinds = np.zeros(size + rows, np.int32)
        self._kinds[size : size + 6] = EQUALITY

    def solve(self) -> Float[np.ndarray, " unknowns"] | None:
        """Return the unknowns; None where nothing keeps the limits."""
        x, _, flag, _ = daqp.solve(
            self._hessian, self._cost, self.A, self.upper, self.lower, self._kinds
        )
        return x if flag > 0 else None


@compiled
def write_qp(
    states: np.ndarray,
    robots: np.ndarray,
    A: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    W: np.ndarray,
) -> float:
    """Write the programme for forces near the cheapest that keep friction and torque limits.

    Args:
        states: State after `solve_feed_forward`; `at_rest` is written, shape (1,).
        robots: Parameters of the robot, shape (1,).
        A: Written, as are the following; see `ContactForceQP`.
        lower: See there.
        upper: See there.
        W: See there.

    Returns:
        Load of the robot at rest, the unit of all forces [N].
    """
    state, robot = states[0], robots[0]
    required, still = state.required, state.at_rest
    state.pose.R_world_body[:] = state.motion.R_world_body
    state.pose.q[:] = state.motion.q
    solve_inverse_dynamics(robot, state.pose, still)
    scale = 0.0
    for i in range(3):
        scale = max(scale, abs(still.wrench[i]))
    if not scale > 0.0:
        return 0.0
    count = W.shape[0]
    A[:] = 0.0
    lower[:] = -UNBOUNDED
    last, inside = 3 * count, robot.friction * INSCRIBED
    upper[:last] = UNBOUNDED
    lower[last], upper[last] = 0.0, 1.0
    first = last + 1
    grasp = np.zeros((6, 3))
    reach = 1e-9
    for leg in range(state.leg_count):
        for i in range(3):
            if state.load_share[leg] >= NEGLIGIBLE:
                reach = max(reach, abs(required.foot[leg, i]))
    # The part of the motion that is left out needs no wrench.
    for i in range(6):
        unit = 1.0 if i < 3 else 1.0 / reach
        A[i, last] = unit * (required.wrench[i] - still.wrench[i]) / scale
        lower[first + i] = upper[first + i] = 0.0
    k, t, u = -1, np.empty(3), np.empty(3)
    for leg in range(state.leg_count):
        if not state.load_share[leg] >= NEGLIGIBLE:
            continue
        k += 1
        _root_of(state.inverse_cost[leg], W[k])
        grasp_of(required.foot[leg], 1.0 / reach, grasp)
        for i in range(6):
            for j in range(3):
                for m in range(3):
                    A[i, 3 * k + j] += grasp[i, m] * W[k, m, j]
        n, cheapest = state.normals[leg], state.foot_force[leg]
        _tangents_of(n, t, u)
        for face in range(FACES):
            at = 6 + FACES * k + face
            c, s = math.cos(2 * math.pi * face / FACES), math.sin(2 * math.pi * face / FACES)
            now = 0.0
            for i in range(3):
                side = c * t[i] + s * u[i] - inside * n[i]
                now += side * cheapest[i] / scale
                for j in range(3):
                    A[at, 3 * k + j] += side * W[k, i, j]
            upper[first + at] = -now
        for joint in range(3):
            at = 6 + FACES * count + 3 * k + joint
            now = required.torque[leg, joint]
            for i in range(3):
                J = required.jacobian[leg, i, joint]
                now -= J * cheapest[i]
                for j in range(3):
                    A[at, 3 * k + j] -= J * W[k, i, j]
            A[at, last] = (still.torque[leg, joint] - required.torque[leg, joint]) / scale
            lower[first + at] = (state.torque_limits[0, leg, joint] - now) / scale
            upper[first + at] = (state.torque_limits[1, leg, joint] - now) / scale
    return scale


@compiled
def apply_solution(
    states: np.ndarray, x: np.ndarray, W: np.ndarray, scale: float, motion_scale: float
) -> None:
    """Replace the cheapest forces, and the torques, by those of a solution.

    Args:
        states: As in `write_qp`, changed.
        x: Unknowns.
        W: As in `write_qp`.
        scale: Unit of forces [N].
        motion_scale: Part of the motion that the forces give.
    """
    state, k = states[0], -1
    required, still, force = state.required, state.at_rest, state.foot_force
    for leg in range(state.leg_count):
        if not state.load_share[leg] >= NEGLIGIBLE:
            force[leg] = 0.0
            continue
        k += 1
        for i in range(3):
            for j in range(3):
                force[leg, i] += scale * W[k, i, j] * x[3 * k + j]
    load_joints(state)
    for leg in range(state.leg_count):
        for i in range(3):
            change = still.torque[leg, i] - required.torque[leg, i]
            state.joint_torque[leg, i] += (1.0 - motion_scale) * change
    state.friction, state.torque_utilisation = friction_of(state), utilisation_of(state)
    state.motion_scale = motion_scale


@internal
def _tangents_of(n: np.ndarray, t: np.ndarray, u: np.ndarray) -> None:
    """Write two tangents of a normal, the first from the axis farthest from the normal."""
    least = 0
    for i in range(1, 3):
        if abs(n[i]) < abs(n[least]):
            least = i
    for i in range(3):
        t[i] = (1.0 if i == least else 0.0) - n[least] * n[i]
    length = math.sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2])
    for i in range(3):
        t[i] /= length
    u[0], u[1] = n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2]
    u[2] = n[0] * t[1] - n[1] * t[0]


@internal
def _root_of(D: np.ndarray, W: np.ndarray) -> None:
    """Write the lower triangular W with W Wᵀ = D of a positive 3 x 3 matrix."""
    W[:] = 0.0
    W[0, 0] = math.sqrt(D[0, 0])
    W[1, 0], W[2, 0] = D[1, 0] / W[0, 0], D[2, 0] / W[0, 0]
    W[1, 1] = math.sqrt(D[1, 1] - W[1, 0] * W[1, 0])
    W[2, 1] = (D[2, 1] - W[2, 0] * W[1, 0]) / W[1, 1]
    W[2, 2] = math.sqrt(D[2, 2] - W[2, 0] * W[2, 0] - W[2, 1] * W[2, 1])
