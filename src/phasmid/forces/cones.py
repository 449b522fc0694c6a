"""Minimum of a cost over an affine set within circular cones and linear limits."""

from __future__ import annotations

from typing import NamedTuple

import daqp
import numpy as np
from jaxtyping import Float

FACES = 8
"""Faces of the initial pyramid around each cone."""

ASIDE = 0.05
"""A face within this angle of the touching plane is dropped [rad]."""

SWING = 0.015
"""Rotation of a direction above which its last touching plane is kept [rad]."""

TOLERANCE = 1e-11
"""Tolerance of cones and optimality, relative to the load."""

MOST_PROGRAMMES = 200
"""Most quadratic programmes of a sample; 4 or 5 are usual, above 20 rare."""

PATIENCE = 6
"""Programmes after which a foot at its cone's tip keeps its last touching planes."""

KEPT = 4
"""Number of touching planes that are kept."""

TIP = 0.01
"""Tangential force near the tip, relative to the load."""

ROUND_OFF = 1e-15
"""Round-off of a force, relative to the load."""

UNBOUNDED = 1e30
"""Infinity of the solver."""


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


def pyramid(faces: int) -> Float[np.ndarray, "faces 2"]:
    """Return the tangential directions of the faces of a pyramid."""
    angle = 2 * np.pi * np.arange(faces) / faces
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def cheapest_points(
    force: Float[np.ndarray, "samples feet 3"],
    U: Float[np.ndarray, "samples feet 3 free"],
    friction: Float[np.ndarray, "samples feet"],
    limits: Rows,
    slope: Float[np.ndarray, " free"],
) -> Float[np.ndarray, "samples free"]:
    """Return the x of least ½ xᵀ x + slope · x with each force f + U x in its friction cone.

    Each cone |tangential force| <= friction * normal force starts as a pyramid around it. Each
    iteration adds the half space that touches the cone at the last force, and the cone's curvature
    there, times the multiplier of the limit, to the cost. This is Newton's method on the
    optimality conditions: it meets the circular cone to round-off after a few programmes.

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
    faces = pyramid(FACES)
    linear = limits.upper.shape[1]
    limits = Rows.join(limits, half_spaces(faces, force, U, friction))
    x, unsolved = np.full((samples, free), np.nan), np.arange(samples)
    tangential, pressure = force[..., 1:], np.zeros((samples, feet))
    # The latest direction of each foot's tangential force, then earlier ones.
    directions = np.tile([1.0, 0.0], (samples, feet, 1 + KEPT, 1))
    for programme in range(MOST_PROGRAMMES):
        along = np.linalg.norm(tangential, axis=-1)
        loaded = along > 1e-9
        length = np.where(loaded, along, 1.0)
        # A foot without force keeps its last direction, which is otherwise round-off.
        latest = np.where(loaded[..., None], tangential / length[..., None], directions[:, :, 0])
        swung = _apart(latest, directions[:, :, 0], SWING)[..., None, None]
        directions[:, :, 1:] = np.where(swung, directions[:, :, :-1], directions[:, :, 1:])
        directions[:, :, 0] = latest
        # At the tip of a cone the direction may oscillate: the last planes count.
        planes = directions[:, :, : 1 if programme < PATIENCE else None]
        rows = Rows.join(limits, half_spaces(planes, force, U, friction))
        unused = ~_apart(planes, latest[..., None, :], SWING) | (along >= TIP)[..., None]
        unused[..., 0] = False
        # A face beside the touching plane is nearly redundant and makes the solver cycle.
        beside = loaded[..., None] & ~_apart(latest[..., None, :], faces, ASIDE)
        idle = [part.reshape(len(unsolved), -1) for part in (beside, unused)]
        rows.upper[:, linear:][np.concatenate(idle, axis=1)] = UNBOUNDED

        sideways = np.stack([-latest[..., 1], latest[..., 0]], axis=-1)
        across = (sideways[..., None, :] @ U[..., 1:, :])[..., 0, :]
        bent = np.where(loaded, pressure / length, 0.0)[..., None] * across
        H = np.eye(free) + np.swapaxes(bent, -1, -2) @ across
        offset = np.sum(sideways * force[..., 1:], axis=-1)
        g = slope + np.einsum("nkd,nk->nd", bent, offset)
        point, multipliers, exists = _programmes(H, g, rows)

        reached = force + (U @ point[:, None, :, None])[..., 0]
        tangential = reached[..., 1:]
        cones = multipliers[:, linear:]
        pressure = cones[:, : FACES * feet].reshape(-1, feet, FACES).sum(axis=-1)
        pressure += cones[:, FACES * feet :].reshape(*planes.shape[:3]).sum(axis=-1)
        outside = np.linalg.norm(tangential, axis=-1) - friction * reached[..., 0]
        # A limit that was not active before has lent the cost no curvature yet.
        pressed = np.where(loaded, pressure / length, 0.0)
        slack = np.abs(pressed * np.sum(sideways * tangential, axis=-1)).max(axis=-1)
        # Where limits leave little room their multipliers are huge, and so is their round-off.
        slack -= ROUND_OFF * pressed.max(axis=-1)
        solved = exists & (outside.max(axis=-1) <= TOLERANCE) & (slack <= tolerance)
        x[unsolved[solved]] = point[solved]
        left = exists & ~solved
        if not left.any():
            break
        unsolved, tangential, pressure = unsolved[left], tangential[left], pressure[left]
        directions, force, U, friction = directions[left], force[left], U[left], friction[left]
        limits = Rows(*(part[left] for part in limits))
    return x


def _apart(a: np.ndarray, b: np.ndarray, angle: float) -> np.ndarray:
    """Return where two directions differ by more than an angle."""
    return np.asarray(np.sum(a * b, axis=-1) < np.cos(angle))


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
