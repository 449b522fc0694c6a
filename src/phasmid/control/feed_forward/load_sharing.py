"""Load sharing of the stance feet at one instant, without limits.

The same as `forces.share_load` with minimum norm; used once per update. Where the feet cannot give
the load, because fewer than three stand or all on one line, the nearest load is shared.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.control.feed_forward.state import State

NEGLIGIBLE = 1e-9
"""A foot with a smaller share of the load carries nothing."""

REGULARISATION = 1e-12
"""Resistance to moments that no foot can give, relative to others; refinement removes its effect on
those."""


@compiled
def share_load(state: State) -> None:
    """Write the foot forces of least sum of F²/s, with load shares s, for the required wrench.

    They are those of a rigid body of masses s at the feet: F = s (f / Σ s + a x r), with r from the
    centre of mass, the total force f, and a = J⁻¹ m of inertia J and moment m about the centre.
    """
    legs, required = state.leg_count, state.required
    feet, shares, force = required.foot[:legs], state.load_share[:legs], required.wrench[:3]
    total = shares.sum()
    if total < NEGLIGIBLE:
        state.foot_force[:], state.missing = 0.0, 1.0
        return
    centre = shares @ feet / total
    r = feet - centre
    products = (r.T * shares) @ r
    J = np.trace(products) * np.eye(3) - products
    moment = required.wrench[3:] - np.cross(centre, force)
    regular = J + (REGULARISATION * np.trace(J) + 1e-100) * np.eye(3)
    a = solve_symmetric(regular, moment)
    a += solve_symmetric(regular, moment - J @ a)
    for leg in range(legs):
        state.foot_force[leg] = shares[leg] * (force / total + np.cross(a, r[leg]))
    size = np.abs(feet).max()
    largest = max(size * np.abs(force).max(), np.abs(required.wrench[3:]).max())
    state.missing = np.abs(moment - J @ a).max() / max(largest, 1e-300)


@compiled
def solve_symmetric(A: Float[np.ndarray, "3 3"], b: Float[np.ndarray, "3"]) -> np.ndarray:
    """Solve A x = b by Cramer's rule; 8 times as fast as LAPACK."""
    a1, a2, a3 = A[0], A[1], A[2]
    first = np.cross(a2, a3)
    x = b[0] * first + b[1] * np.cross(a3, a1) + b[2] * np.cross(a1, a2)
    return x / (a1 @ first)


@compiled
def load_joints(state: State) -> None:
    """Write the joint torques of motion and foot forces, friction and torque utilisation."""
    for leg in range(state.leg_count):
        J, force = state.required.jacobian[leg], state.foot_force[leg]
        held = force[0] * J[0] + force[1] * J[1] + force[2] * J[2]
        state.joint_torque[leg] = state.required.torque[leg] - held
    state.friction = friction_of(state)
    state.torque_utilisation = utilisation_of(state)


@compiled
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


@compiled
def utilisation_of(state: State) -> float:
    """Return the largest joint torque as a share of the servo's limit at its speed."""
    torque = state.joint_torque
    low, high = state.torque_limits[0], state.torque_limits[1]
    # The other limit makes a negative share.
    shares = np.maximum(torque / np.maximum(high, 1e-300), torque / np.minimum(low, -1e-300))
    return float(shares.max())
