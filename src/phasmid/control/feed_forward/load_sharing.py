"""Load sharing of the stance feet at one instant, without limits.

The same as `forces.share_load` with minimum norm; used once per update. Where the feet cannot give
the load, because fewer than three stand or all on one line, the nearest load is shared.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import internal
from phasmid.control.feed_forward.state import State

NEGLIGIBLE = 1e-9
"""A foot with a smaller share of the load carries nothing."""

REGULARISATION = 1e-13
"""Relative stiffness against loads that no foot holds; refinement removes its effect on others."""


@internal
def share_load(state: State) -> None:
    """Write the foot forces of least sum of squares that give the required wrench.

    With grasp matrix G and load shares D the forces are F = D Gᵀ x, where G D Gᵀ x is the wrench.
    """
    feet, roots, scale = state.required.foot, np.sqrt(state.load_share), np.ones(6)
    # Moments are divided by the robot's size, so that all equations are of the same order.
    scale[3:] /= max(np.abs(feet).max(), 1e-9)
    G = grasp_matrix(scale[3] * feet, roots)
    S = G @ G.T
    S += (REGULARISATION * S.max() + 1e-100) * np.eye(6)
    wrench = scale * state.required.wrench
    x, residual = np.zeros(6), wrench
    for _ in range(3):
        x += np.linalg.solve(S, residual)
        residual = wrench - G @ (x @ G)
    force = x @ G
    for leg in range(state.leg_count):
        state.foot_force[leg] = roots[leg] * force[3 * leg : 3 * leg + 3]
    state.missing = np.abs(residual).max() / max(np.abs(wrench).max(), 1e-300)


@internal
def grasp_matrix(
    feet: Float[np.ndarray, "legs 3"], weights: Float[np.ndarray, " legs"]
) -> Float[np.ndarray, "6 axes"]:
    """Return the grasp matrix, from all foot forces to the wrench, with weighted columns."""
    G = np.zeros((6, 3 * len(feet)))
    for leg in range(len(feet)):
        w, k = weights[leg], 3 * leg
        x, y, z = w * feet[leg, 0], w * feet[leg, 1], w * feet[leg, 2]
        G[0, k] = G[1, k + 1] = G[2, k + 2] = w
        G[3, k + 1], G[3, k + 2] = -z, y
        G[4, k], G[4, k + 2] = z, -x
        G[5, k], G[5, k + 1] = -y, x
    return G


@internal
def load_joints(state: State) -> None:
    """Write the joint torques of motion and foot forces, friction and torque utilisation."""
    required = state.required
    for leg in range(state.leg_count):
        held = required.jacobian[leg].T @ state.foot_force[leg]
        state.joint_torque[leg] = required.torque[leg] - held
    state.friction = friction_of(state)
    state.torque_utilisation = utilisation_of(state)


@internal
def friction_of(state: State) -> float:
    """Return the coefficient of friction that the feet need; infinite where one would pull."""
    worst = 0.0
    for leg in range(state.leg_count):
        if state.load_share[leg] < NEGLIGIBLE:
            continue
        n, force = state.normals[leg], state.foot_force[leg]
        normal = force @ n
        tangential = math.sqrt(max(force @ force - normal * normal, 0.0))
        if normal > 1e-12:
            worst = max(worst, tangential / normal)
        elif tangential > 1e-12 or normal < -1e-12:
            return math.inf
    return worst


@internal
def utilisation_of(state: State) -> float:
    """Return the largest joint torque as a share of the servo's limit at its speed."""
    torque = state.joint_torque
    low, high = state.torque_limits[0], state.torque_limits[1]
    # The other limit makes a negative share.
    shares = np.maximum(torque / np.maximum(high, 1e-300), torque / np.minimum(low, -1e-300))
    return float(shares.max())
