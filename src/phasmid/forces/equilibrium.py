"""Foot forces of least cost that give a wrench, without limits."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

DEPENDENT = 1e-11
"""Relative size of a singular value of the six equations that counts as zero."""

MISSING = 1e-9
"""Relative residual above which a wrench cannot be given."""


def grasp_matrix(feet: Float[np.ndarray, "*batch legs 3"]) -> Float[np.ndarray, "*batch 6 axes"]:
    """Return the grasp matrix, from all foot forces to the wrench, shape (..., 6, 3 L).

    Args:
        feet: Feet from the point of the moment [m], shape (..., L, 3).
    """
    legs = feet.shape[-2]
    matrix = np.zeros((*feet.shape[:-2], 6, legs, 3))
    x, y, z = np.moveaxis(feet, -1, 0)
    for i in range(3):
        matrix[..., i, :, i] = 1.0
    matrix[..., 3, :, 1], matrix[..., 3, :, 2] = -z, y
    matrix[..., 4, :, 0], matrix[..., 4, :, 2] = z, -x
    matrix[..., 5, :, 0], matrix[..., 5, :, 1] = -y, x
    return matrix.reshape(*feet.shape[:-2], 6, 3 * legs)


def cheapest_forces(
    A: Float[np.ndarray, "samples 6 axes"],
    D: Float[np.ndarray, "samples legs 3 3"],
    c: Float[np.ndarray, "samples legs 3"],
    wrench: Float[np.ndarray, "samples 6"],
) -> tuple[Float[np.ndarray, "samples legs 3"], Float[np.ndarray, "samples 6"]]:
    """Return the forces F with A F = w that minimise ½ Fᵀ D⁻¹ F - cᵀ F.

    With multipliers λ of the six equations, F = D (c + Aᵀ λ). D may be singular: a foot with D = 0
    has no force.

    Args:
        A: Grasp matrix, shape (N, 6, 3 L).
        D: Inverse of each foot's cost, symmetric, not negative, shape (N, L, 3, 3).
        c: Linear gain of each foot, shape (N, L, 3).
        wrench: Force [N] and moment [N·m], shape (N, 6).

    Returns:
        Forces [N], shape (N, L, 3), and the missing wrench, 0 where there is none, shape (N, 6).
    """
    samples, legs = D.shape[:2]
    A_foot = np.swapaxes(A.reshape(samples, 6, legs, 3), 1, 2)
    AD = np.swapaxes(A_foot @ D, 1, 2).reshape(samples, 6, 3 * legs)
    system = AD @ np.swapaxes(A, -1, -2)

    def forces(gain: np.ndarray, multipliers: np.ndarray) -> np.ndarray:
        twist = (np.swapaxes(A, -1, -2) @ multipliers[..., None]).reshape(c.shape)
        return (D @ (gain + twist)[..., None])[..., 0]

    def missing(force: np.ndarray, rows: np.ndarray | slice = slice(None)) -> np.ndarray:
        return wrench[rows] - (A[rows] @ force[rows].reshape(-1, 3 * legs, 1))[..., 0]

    rest = wrench - (AD @ c.reshape(samples, -1, 1))[..., 0]
    # Fewer than three feet leave a pivot of 0; such a sample must not stop the others.
    system[np.linalg.slogdet(system)[0] == 0] = np.eye(6)
    force = forces(c, np.linalg.solve(system, rest[..., None])[..., 0])
    # One step of refinement: where legs are nearly stretched the system is ill-conditioned.
    again = np.linalg.solve(system, missing(force)[..., None])[..., 0]
    force = force + forces(np.zeros_like(c), again)
    size = 1.0 + np.abs(wrench).max(axis=-1)
    off = np.flatnonzero(~(np.abs(missing(force)).max(axis=-1) <= MISSING * size))
    if len(off):
        # With D = W Wᵀ and F = D c + W y, the equations A W y = rest have the square root of the
        # system's condition number.
        sizes, axes = np.linalg.eigh(D[off])
        W = axes * np.sqrt(np.maximum(sizes, 0.0))[..., None, :]
        B = np.swapaxes(A_foot[off] @ W, 1, 2).reshape(len(off), 6, 3 * legs)
        inverse = np.linalg.pinv(B, rcond=DEPENDENT)
        force[off] = (D[off] @ c[off, ..., None])[..., 0]
        for _ in range(2):
            y = (inverse @ missing(force, off)[..., None]).reshape(len(off), legs, 3, 1)
            force[off] += (W @ y)[..., 0]
    left = missing(force)
    return force, np.where((np.abs(left).max(axis=-1) > MISSING * size)[:, None], left, 0.0)


def null_space(B: Float[np.ndarray, "samples 6 axes"]) -> Float[np.ndarray, "samples axes free"]:
    """Return orthonormal bases of the null spaces of matrices.

    Args:
        B: Matrices, shape (N, 6, n).

    Returns:
        Bases in columns, shape (N, n, n - 6). Where rows are dependent, all samples have n columns,
        and those outside the basis are 0.
    """
    axes = B.shape[-1]
    if axes > 6:
        Q, R = np.linalg.qr(np.swapaxes(B, -1, -2), mode="complete")
        pivots = np.abs(np.diagonal(R, axis1=-2, axis2=-1))
        if np.all(pivots.min(axis=-1) > DEPENDENT * pivots.max(axis=-1)):
            return np.ascontiguousarray(Q[..., 6:])
    _, sizes, Vh = np.linalg.svd(B, full_matrices=True)
    fixed = np.zeros(Vh.shape[:-1])
    fixed[..., : sizes.shape[-1]] = sizes > DEPENDENT * sizes.max(axis=-1, keepdims=True)
    return np.ascontiguousarray(np.swapaxes(Vh, -1, -2) * (1.0 - fixed[..., None, :]))
