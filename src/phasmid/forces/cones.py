"""Minimum of a cost over an affine set within circular cones and linear limits."""

from __future__ import annotations

from typing import NamedTuple

import daqp
import numpy as np
from jaxtyping import Float

TOLERANCE = 1e-11
"""Tolerance of cones and optimality, relative to the load."""

MOST_PROGRAMMES = 200
"""Most quadratic programmes of a sample; 4 or 5 are usual, above 20 rare."""

UNBOUNDED = 1e30
"""Infinity of the solver."""


def directions(angles: Float[np.ndarray, " count"]) -> Float[np.ndarray, "count 2"]:
    """Return unit vectors at angles from the first axis [rad]."""
    return np.stack([np.cos(angles), np.sin(angles)], axis=-1)


FACES = directions(np.array([0.0, 0.1, 0.3, 0.9, 1.8, np.pi, -1.8, -0.9, -0.3, -0.1]))
"""Faces of the pyramid around each cone, from the direction of the last force. They are denser
beside it: near the tip of a cone the direction of the force turns far from one programme to the
next, and settles where the faces around it come closer."""


class Rows(NamedTuple):
    """Linear limits lower <= A x <= upper, one set per sample.

    Attributes:
        A: Shape (N, m, d).
        lower: Shape (N, m).
        upper: Shape (N, m).
    """

    A: Float[np.ndarray, "samples rows free"]
    lower: Float[np.ndarray, "samples rows"]
    upper: Float[np.ndarray, "samples rows"]

    @classmethod
    def join(cls, *sets: Rows) -> Rows:
        """Join several sets of limits."""
        return cls(*(np.concatenate(parts, axis=1) for parts in zip(*sets, strict=True)))

    @classmethod
    def below(cls, A: np.ndarray, upper: np.ndarray) -> Rows:
        """Return the limits A x <= upper."""
        return cls(A, np.full(upper.shape, -UNBOUNDED), upper)


def half_spaces(
    directions: Float[np.ndarray, "... planes 2"],
    force: Float[np.ndarray, "samples feet 3"],
    U: Float[np.ndarray, "samples feet 3 free"],
    friction: Float[np.ndarray, "samples feet"],
) -> Rows:
    """Return half spaces that touch the cones along tangential directions, foot by foot.

    Args:
        directions: Of all feet, shape (p, 2), or of each foot, shape (N, k, p, 2).
        force: As of `cheapest_points`.
        U: As of `cheapest_points`.
        friction: As of `cheapest_points`.
    """
    normals = np.empty((*friction.shape, directions.shape[-2], 3))
    normals[..., 0], normals[..., 1:] = -friction[..., None], directions
    room = -(normals @ force[..., None])[..., 0]
    samples, free = len(U), U.shape[-1]
    return Rows.below((normals @ U).reshape(samples, -1, free), room.reshape(samples, -1))


def cheapest_points(
    force: Float[np.ndarray, "samples feet 3"],
    U: Float[np.ndarray, "samples feet 3 free"],
    friction: Float[np.ndarray, "samples feet"],
    limits: Rows,
    slope: Float[np.ndarray, " free"],
) -> Float[np.ndarray, "samples free"]:
    """Return the x of least ½ xᵀ x + slope · x with each force f + U x in its friction cone.

    Each cone |tangential force| <= friction * normal force is a pyramid around it that touches it
    at the last force. The cone's curvature there, times the multiplier of the limit, is a part of
    the cost. This is Newton's method on the optimality conditions: it meets the circular cone to
    round-off after a few programmes.

    Args:
        force: Forces for x = 0 in contact axes (normal first), in units of the load: (N, k, 3).
        U: Change of the forces with x, shape (N, k, 3, d).
        friction: Coefficients of friction, shape (N, k).
        limits: Further limits.
        slope: Of the linear cost, shape (d,).

    Returns:
        Points, shape (N, d); NaN where there is none.

    Source: Nocedal and Wright, Numerical Optimization, chapter 18 (sequential quadratic
    programming); each programme is solved by daqp (Arnström, Bemporad, Axehill 2022).
    """
    samples, feet, _, free = U.shape
    tolerance = TOLERANCE * max(1.0, float(np.abs(slope).max(initial=0.0)))
    linear = limits.upper.shape[1]
    x, unsolved = np.full((samples, free), np.nan), np.arange(samples)
    tangential, pressure = force[..., 1:], np.zeros((samples, feet))
    latest = np.tile([1.0, 0.0], (samples, feet, 1))
    for _ in range(MOST_PROGRAMMES):
        length = np.linalg.norm(tangential, axis=-1)
        loaded = length > 1e-9
        # A foot without force keeps its last direction, which is otherwise round-off.
        latest = np.divide(
            tangential, length[..., None], out=latest.copy(), where=loaded[..., None]
        )
        sideways = np.stack([-latest[..., 1], latest[..., 0]], axis=-1)
        planes = FACES @ np.stack([latest, sideways], axis=-2)
        rows = Rows.join(limits, half_spaces(planes, force, U, friction))

        across = (sideways[..., None, :] @ U[..., 1:, :])[..., 0, :]
        curvature = np.divide(pressure, length, out=np.zeros_like(length), where=loaded)
        bent = curvature[..., None] * across
        H = np.eye(free) + np.swapaxes(bent, -1, -2) @ across
        offset = np.sum(sideways * force[..., 1:], axis=-1)
        g = slope + np.einsum("nkd,nk->nd", bent, offset)
        point, multipliers, exists = _programmes(H, g, rows)

        reached = force + (U @ point[:, None, :, None])[..., 0]
        tangential = reached[..., 1:]
        pressure = multipliers[:, linear:].reshape(-1, feet, len(FACES)).sum(axis=-1)
        outside = np.linalg.norm(tangential, axis=-1) - friction * reached[..., 0]
        # A limit that was not active before has lent the cost no curvature yet.
        curvature = np.divide(pressure, length, out=np.zeros_like(length), where=loaded)
        error = np.abs(curvature * np.sum(sideways * tangential, axis=-1))
        solved = exists & (outside.max(axis=-1) <= TOLERANCE) & (error.max(axis=-1) <= tolerance)
        x[unsolved[solved]] = point[solved]
        left = exists & ~solved
        if not left.any():
            break
        unsolved, tangential, pressure = unsolved[left], tangential[left], pressure[left]
        latest, force, U, friction = latest[left], force[left], U[left], friction[left]
        limits = Rows(*(part[left] for part in limits))
    return x


def _programmes(
    H: np.ndarray, g: np.ndarray, limits: Rows
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return minima of ½ xᵀ H x + gᵀ x within limits, their multipliers, and where they exist."""
    samples, rows = limits.upper.shape
    x, multipliers = np.zeros(g.shape), np.zeros((samples, rows))
    exists = np.zeros(samples, dtype=bool)
    kinds = np.zeros(rows, dtype=np.int32)
    A, lower, upper = (np.ascontiguousarray(part) for part in limits)
    for i in range(samples):
        point, _, flag, info = daqp.solve(
            H[i], g[i], A[i], upper[i], lower[i], kinds, primal_tol=TOLERANCE / 10
        )
        if flag == 1:
            x[i], multipliers[i], exists[i] = point, info["lam"], True
    return x, multipliers, exists
