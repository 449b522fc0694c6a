"""Foot forces within friction cones and torque limits."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.forces.cones import UNBOUNDED, Rows, cheapest_points
from phasmid.forces.equilibrium import null_space
from phasmid.forces.models import FrictionCone, Limited, SmallestLargestLoad
from phasmid.forces.problem import Problem

BLOCK = 1024
"""Samples solved together; their matrices fit the cache."""

WITHIN = 1e-12
"""Tolerance of the limits, relative to the load."""

LARGEST_TOLERANCE = 0.1
"""Tolerance of the smallest largest load, relative to the model's slack."""


def admissible_forces(
    problem: Problem,
    force: Float[np.ndarray, "samples legs 3"],
    model: Limited,
) -> Float[np.ndarray, "samples legs 3"]:
    """Return the forces of a model with limits.

    Args:
        problem: The load.
        force: Forces of least cost without limits [N], shape (N, L, 3).
        model: The model.

    Returns:
        Forces [N], shape (N, L, 3); NaN where there are none within the limits.
    """
    force = force.copy()
    todo = np.arange(len(force))
    if isinstance(model, FrictionCone):
        todo = np.flatnonzero(~_within(problem, force, model.least_normal))
    counts = problem.carrying[todo].sum(axis=-1)
    for count in np.unique(counts[counts > 0]):
        group = todo[counts == count]
        for block in (group[i : i + BLOCK] for i in range(0, len(group), BLOCK)):
            few, legs = problem.standing(block, int(count))
            rows = block[:, None]
            force[rows, legs] = _solve(few, force[rows, legs], model)
    return force


def _in_contact_axes(problem: Problem, force: np.ndarray) -> np.ndarray:
    return np.einsum("nlij,nli->nlj", problem.axes, force)


def _within(problem: Problem, force: np.ndarray, least: float) -> np.ndarray:
    """Return which samples keep all limits, shape (N,)."""
    f = _in_contact_axes(problem, force)
    slack = WITHIN * np.abs(force).max(axis=(-2, -1), initial=0.0)[:, None]
    carrying = problem.carrying
    good = np.hypot(f[..., 1], f[..., 2]) <= problem.friction * f[..., 0] + slack
    good &= f[..., 0] >= least * problem.share - slack
    if problem.limited:
        torque = problem.torque - np.einsum("nlij,nli->nlj", problem.jacobian, force)
        good &= np.all(np.abs(torque) <= problem.limit, axis=-1)
    return np.all(good | ~carrying, axis=-1)


def _solve(few: Problem, force: np.ndarray, model: Limited) -> np.ndarray:
    """Return forces within the limits for samples whose feet all carry; NaN where there are none.

    With D = W Wᵀ and F = force + W y the cost is ½ y · y, and y lies in the null space of the
    equations. The forces keep the wrench and are nearest to those without limits.
    """
    samples, feet = few.share.shape
    W = np.linalg.cholesky(few.inverse)
    A_foot = np.swapaxes(few.grasp.reshape(samples, 6, feet, 3), 1, 2)
    B = np.swapaxes(A_foot @ W, 1, 2).reshape(samples, 6, 3 * feet)
    V = W @ null_space(B).reshape(samples, feet, 3, -1)
    U = np.swapaxes(few.axes, -1, -2) @ V
    scale = np.abs(force).max(axis=(-2, -1))
    scale = np.where(scale > 0, scale, 1.0)[:, None, None]
    f = _in_contact_axes(few, force) / scale
    limits = _limits(few, f, force, U, V, scale[..., 0], model.least_normal)
    if isinstance(model, SmallestLargestLoad):
        limits, bounded = _smallest_largest(few, f, U, limits, model.slack)
        force = np.where(bounded[:, None, None], force, np.nan)
    x, _ = cheapest_points(f, U, few.friction, limits)
    return force + scale * (V @ x[:, None, :, None])[..., 0]


def _limits(
    few: Problem,
    f: np.ndarray,
    force: np.ndarray,
    U: np.ndarray,
    V: np.ndarray,
    scale: np.ndarray,
    least: float,
) -> Rows:
    """Return the limits of pull and of joint torques."""
    pushes = Rows.below(-U[..., 0, :], f[..., 0] - least * few.share / scale)
    if not few.limited:
        return pushes
    samples, feet, _, free = U.shape
    torque = few.torque - np.einsum("nlij,nli->nlj", few.jacobian, force)
    change = -(np.swapaxes(few.jacobian, -1, -2) @ V).reshape(samples, 3 * feet, free)
    lower, upper = (
        np.clip((side * few.limit - torque) / scale[..., None], -UNBOUNDED, UNBOUNDED)
        for side in (-1, 1)
    )
    holds = Rows(change, lower.reshape(samples, -1), upper.reshape(samples, -1))
    return Rows.join(pushes, holds)


def _smallest_largest(
    few: Problem, f: np.ndarray, U: np.ndarray, limits: Rows, slack: float
) -> tuple[Rows, np.ndarray]:
    """Add the bound of the smallest largest load; return where there is one, too, shape (N,).

    The largest load is one more unknown t with normal force <= t * share, which is minimised.
    """
    samples, feet, _, free = U.shape
    with_t = np.concatenate([U, np.zeros((samples, feet, 3, 1))], axis=-1)
    below_t = np.concatenate([U[..., 0, :], -few.share[..., None]], axis=-1)
    wider = Rows(
        np.concatenate([limits.A, np.zeros((*limits.A.shape[:-1], 1))], axis=-1),
        limits.lower,
        limits.upper,
    )
    first = Rows.join(wider, Rows.below(below_t, -f[..., 0]))
    slope = np.append(np.zeros(free), 1.0)
    tolerance = LARGEST_TOLERANCE * slack
    x, found = cheapest_points(f, with_t, few.friction, first, slope, tolerance)
    largest = np.where(found, (1.0 + slack) * x[:, -1], UNBOUNDED)
    upper = largest[:, None] * few.share - f[..., 0]
    return Rows.join(limits, Rows.below(U[..., 0, :], upper)), found
