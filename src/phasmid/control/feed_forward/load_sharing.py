"""Load sharing of the stance feet at one instant, for cost functions without limits.

The same as `forces.share_load`; used once per update. Where the feet cannot give the load, because
fewer than three stand or all on one line, the nearest load is shared.
"""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import internal
from phasmid.control.feed_forward.settings import MINIMUM_TORQUE, WEIGHTED
from phasmid.control.feed_forward.state import Parameters, State

NEGLIGIBLE = 1e-9
"""A foot with a smaller share of the load carries nothing."""


@internal
def share_load(state: State, robot: Parameters) -> None:
    """Write the foot forces that give the required wrench at the least cost.

    Writes `foot_force`, `inverse_cost`, `cost_gradient` and `missing`.

    Args:
        state: With `required`, `load_share` and `normals`.
        robot: Cost function.
    """
    required, D, c, force = (
        state.required,
        state.inverse_cost,
        state.cost_gradient,
        state.foot_force,
    )
    legs = state.leg_count
    # Moments are divided by the robot's size, so that the six pivots are of the same order.
    size = 0.0
    for leg in range(legs):
        for i in range(3):
            size = max(size, abs(required.foot[leg, i]))
    unit = 1.0 / size if size > 0.0 else 1.0
    S, rest, wrench = np.zeros((6, 6)), np.empty(6), np.empty(6)
    A, AD = np.zeros((6, 3)), np.empty((6, 3))
    for i in range(3):
        wrench[i], wrench[3 + i] = required.wrench[i], unit * required.wrench[3 + i]
    rest[:] = wrench
    for leg in range(legs):
        _set_cost(state, robot, leg)
        grasp_of(required.foot[leg], unit, A)
        for i in range(6):
            for k in range(3):
                AD[i, k] = A[i, 0] * D[leg, 0, k] + A[i, 1] * D[leg, 1, k] + A[i, 2] * D[leg, 2, k]
            rest[i] -= AD[i, 0] * c[leg, 0] + AD[i, 1] * c[leg, 1] + AD[i, 2] * c[leg, 2]
        for i in range(6):
            for j in range(i + 1):
                S[i, j] += AD[i, 0] * A[j, 0] + AD[i, 1] * A[j, 1] + AD[i, 2] * A[j, 2]
    _factorise(S)
    largest = 1e-300
    for i in range(6):
        largest = max(largest, abs(wrench[i]))
    missing = 0.0
    multipliers, change = np.zeros(6), np.empty(6)
    # Two passes of refinement: near stretched legs the system is ill-conditioned.
    for _ in range(3):
        _solve(S, rest, change)
        for i in range(6):
            multipliers[i] += change[i]
            rest[i] = wrench[i]
        for leg in range(legs):
            grasp_of(required.foot[leg], unit, A)
            x, y, z = c[leg, 0], c[leg, 1], c[leg, 2]
            for i in range(6):
                x += A[i, 0] * multipliers[i]
                y += A[i, 1] * multipliers[i]
                z += A[i, 2] * multipliers[i]
            for k in range(3):
                force[leg, k] = D[leg, k, 0] * x + D[leg, k, 1] * y + D[leg, k, 2] * z
            for i in range(6):
                rest[i] -= A[i, 0] * force[leg, 0] + A[i, 1] * force[leg, 1]
                rest[i] -= A[i, 2] * force[leg, 2]
        missing = 0.0
        for i in range(6):
            missing = max(missing, abs(rest[i]) / largest)
        if missing < 1e-14:
            break
    state.missing = missing


@internal
def grasp_of(foot: np.ndarray, unit: float, A: np.ndarray) -> None:
    """Write the wrench of a unit force at a foot; moments are multiplied by `unit`."""
    x, y, z = unit * foot[0], unit * foot[1], unit * foot[2]
    A[0, 0] = A[1, 1] = A[2, 2] = 1.0
    A[3, 1], A[3, 2] = -z, y
    A[4, 0], A[4, 2] = z, -x
    A[5, 0], A[5, 1] = -y, x


@internal
def _set_cost(state: State, robot: Parameters, leg: int) -> None:
    """Write the inverse D of a foot's cost matrix times its share, and the linear part c."""
    J, torque, n = state.required.jacobian[leg], state.required.torque[leg], state.normals[leg]
    D, c, share = state.inverse_cost[leg], state.cost_gradient[leg], state.load_share[leg]
    option = robot.cost_option
    c[:] = 0.0
    D[:] = 0.0
    if share < NEGLIGIBLE:
        return
    if robot.cost == MINIMUM_TORQUE:
        h00 = J[0, 0] * J[0, 0] + J[0, 1] * J[0, 1] + J[0, 2] * J[0, 2] + option * option
        h11 = J[1, 0] * J[1, 0] + J[1, 1] * J[1, 1] + J[1, 2] * J[1, 2] + option * option
        h22 = J[2, 0] * J[2, 0] + J[2, 1] * J[2, 1] + J[2, 2] * J[2, 2] + option * option
        h01 = J[0, 0] * J[1, 0] + J[0, 1] * J[1, 1] + J[0, 2] * J[1, 2]
        h02 = J[0, 0] * J[2, 0] + J[0, 1] * J[2, 1] + J[0, 2] * J[2, 2]
        h12 = J[1, 0] * J[2, 0] + J[1, 1] * J[2, 1] + J[1, 2] * J[2, 2]
        m00, m01, m02 = h11 * h22 - h12 * h12, h02 * h12 - h01 * h22, h01 * h12 - h02 * h11
        scale = share / (h00 * m00 + h01 * m01 + h02 * m02)
        D[0, 0], D[1, 1] = scale * m00, scale * (h00 * h22 - h02 * h02)
        D[2, 2] = scale * (h00 * h11 - h01 * h01)
        D[0, 1] = D[1, 0] = scale * m01
        D[0, 2] = D[2, 0] = scale * m02
        D[1, 2] = D[2, 1] = scale * (h01 * h02 - h00 * h12)
        for i in range(3):
            c[i] = J[i, 0] * torque[0] + J[i, 1] * torque[1] + J[i, 2] * torque[2]
        return
    across = 1.0 / option if robot.cost == WEIGHTED else 1.0
    for i in range(3):
        for j in range(3):
            D[i, j] = share * (1.0 - across) * n[i] * n[j]
        D[i, i] += share * across


@internal
def _factorise(S: np.ndarray) -> None:
    """Replace the lower half of a symmetric matrix by its Cholesky factor."""
    largest = 1e-300
    for i in range(6):
        largest = max(largest, S[i, i])
    for j in range(6):
        pivot = S[j, j]
        for k in range(j):
            pivot -= S[j, k] * S[j, k]
        # A direction that no foot holds gets hardly any force.
        root = math.sqrt(pivot) if pivot > 1e-13 * largest else math.sqrt(largest) * 1e8
        S[j, j] = root
        for i in range(j + 1, 6):
            value = S[i, j]
            for k in range(j):
                value -= S[i, k] * S[j, k]
            S[i, j] = value / root


@internal
def _solve(factor: np.ndarray, right: np.ndarray, x: np.ndarray) -> None:
    """Solve the factorised equations."""
    for i in range(6):
        value = right[i]
        for k in range(i):
            value -= factor[i, k] * x[k]
        x[i] = value / factor[i, i]
    for back in range(6):
        i = 5 - back
        value = x[i]
        for k in range(i + 1, 6):
            value -= factor[k, i] * x[k]
        x[i] = value / factor[i, i]


@internal
def load_joints(state: State) -> None:
    """Write the joint torques of motion and foot forces, friction and torque utilisation."""
    required, force, torque = state.required, state.foot_force, state.joint_torque
    J = required.jacobian
    for leg in range(state.leg_count):
        x, y, z = force[leg, 0], force[leg, 1], force[leg, 2]
        for k in range(3):
            held = J[leg, 0, k] * x + J[leg, 1, k] * y + J[leg, 2, k] * z
            torque[leg, k] = required.torque[leg, k] - held
    state.friction = friction_of(state)
    state.torque_utilisation = utilisation_of(state)


@internal
def friction_of(state: State) -> float:
    """Return the coefficient of friction that the feet need; infinite where one would pull."""
    worst = 0.0
    for leg in range(state.leg_count):
        if state.load_share[leg] < NEGLIGIBLE:
            continue
        n, f = state.normals[leg], state.foot_force[leg]
        up = f[0] * n[0] + f[1] * n[1] + f[2] * n[2]
        square = f[0] * f[0] + f[1] * f[1] + f[2] * f[2] - up * up
        along = math.sqrt(max(square, 0.0))
        if up > 1e-12:
            worst = max(worst, along / up)
        elif along > 1e-12 or up < -1e-12:
            return math.inf
    return worst


@internal
def utilisation_of(state: State) -> float:
    """Return the largest joint torque as a share of the servo's limit at its speed."""
    worst = 0.0
    for leg in range(state.leg_count):
        for k in range(3):
            value = state.joint_torque[leg, k]
            limit = state.torque_limits[1 if value > 0.0 else 0, leg, k]
            worst = max(worst, value / limit if limit != 0.0 else np.inf)
    return worst
