"""Loads that feet on uneven ground can give, and a second solver."""

import clarabel
import numpy as np
from scipy import sparse

from phasmid.forces import Contacts, JointLoad, MinimumTorque, WeightedMinimumNorm


def wrench_of(feet, force):
    return np.concatenate([force.sum(axis=-2), np.cross(feet, force).sum(axis=-2)], axis=-1)


def equations(feet):
    """The matrix from the forces on k feet to their wrench, shape (6, 3 k)."""
    skew = [[[0, -z, y], [z, 0, -x], [-y, x, 0]] for x, y, z in feet]
    return np.vstack([np.tile(np.eye(3), len(feet)), np.hstack(skew)])


def random_load(count, legs, standing, *, friction=0.6, tilt=0.2, seed=0, full=False):
    """Feet on slopes, the wrench of admissible forces, and joints with loads of their own.

    The forces from which the wrench is made use up to 95 % of the friction.
    """
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * np.arange(legs) / legs
    feet = np.stack([0.25 * np.cos(angle), 0.2 * np.sin(angle), -0.1 + 0 * angle], axis=-1)
    feet = feet + rng.normal(scale=0.03, size=(count, legs, 3))
    share = np.zeros((count, legs))
    for row in share:
        row[rng.permutation(legs)[:standing]] = 1.0
    if not full:
        share *= rng.uniform(0.3, 1.0, size=share.shape)
    normals = np.array([0, 0, 1.0]) + rng.normal(scale=tilt, size=feet.shape)
    contacts = Contacts(feet, share, normals, friction)
    N = rng.uniform(0.5, 10.0, size=share.shape)
    T = friction * N * rng.uniform(0, 0.95, size=share.shape)
    turn = rng.uniform(0, 2 * np.pi, size=share.shape)
    force = np.stack([N, T * np.cos(turn), T * np.sin(turn)], axis=-1) * (share > 0)[..., None]
    force = (contacts.axes @ force[..., None])[..., 0]
    joints = JointLoad(
        jacobian=rng.normal(scale=0.1, size=(count, legs, 3, 3)),
        torque=rng.normal(scale=0.1, size=(count, legs, 3)),
    )
    return contacts, wrench_of(feet, force), joints, force


def cost_matrices(model, contacts, joints):
    """H and c of ½ Fᵀ H F - cᵀ F, foot by foot, from the definitions of docs/forces.md."""
    n, c = contacts.normals, np.zeros(contacts.feet.shape)
    along = n[..., :, None] * n[..., None, :]
    H = np.broadcast_to(np.eye(3), along.shape)
    if isinstance(model, WeightedMinimumNorm):
        H = along + model.tangential_weight * (np.eye(3) - along)
    if isinstance(model, MinimumTorque):
        J = joints.jacobian
        H = J @ J.swapaxes(-1, -2) + model.lever**2 * np.eye(3)
        c = (J @ joints.torque[..., None])[..., 0]
    return H, c


def reference(contacts, wrench, sample, *, largest=False):
    """The forces of least norm by clarabel, which knows second-order cones.

    With ``largest`` it finds the smallest largest load per share instead: one more unknown.
    """
    share = contacts.share[sample]
    feet = np.flatnonzero(share > 0)
    k = len(feet)
    n = 3 * k + largest
    P, q = np.zeros((n, n)), np.zeros(n)
    rows, right, cones = [np.zeros((6, n))], [wrench[sample]], [clarabel.ZeroConeT(6)]
    rows[0][:, : 3 * k] = equations(contacts.feet[sample, feet])
    for j, i in enumerate(feet):
        at = slice(3 * j, 3 * j + 3)
        cone = np.zeros((3, n))
        cone[:, at] = -contacts.axes[sample, i].T
        cone[0] *= contacts.friction[sample, i]
        rows.append(cone)
        right.append(np.zeros(3))
        cones.append(clarabel.SecondOrderConeT(3))
        if not largest:
            P[at, at] = np.eye(3) / share[i]
            continue
        row = np.zeros((1, n))
        row[0, at], row[0, -1] = contacts.normals[sample, i], -share[i]
        rows.append(row)
        right.append(np.zeros(1))
        cones.append(clarabel.NonnegativeConeT(1))
    if largest:
        q[-1] = 1.0
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = 1e-13
    settings.tol_feas = 1e-12
    # Where it gets no further it must at least have come as far as this.
    settings.reduced_tol_gap_abs = settings.reduced_tol_gap_rel = settings.reduced_tol_feas = 1e-9
    A, b = sparse.csc_matrix(np.concatenate(rows)), np.concatenate(right)
    solver = clarabel.DefaultSolver(sparse.csc_matrix(P), q, A, b, cones, settings)
    solution = solver.solve()
    solved = {clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved}
    assert solution.status in solved, solution.status
    if largest:
        return solution.x[-1]
    force = np.zeros(contacts.feet.shape[1:])
    force[feet] = np.asarray(solution.x).reshape(-1, 3)
    return force
