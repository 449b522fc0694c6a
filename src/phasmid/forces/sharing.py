"""Foot-force distribution: the forces of the standing feet that give a wrench."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from phasmid.arguments import numbers
from phasmid.errors import InvalidInput
from phasmid.forces.cones import UNBOUNDED, Rows, cheapest_points
from phasmid.forces.contacts import Contacts, JointLoad
from phasmid.forces.infeasibility import explain
from phasmid.forces.load import Load, loads, push_limits, torque_limits
from phasmid.forces.models import (
    ForceModel,
    FrictionCone,
    Limited,
    SmallestLargestLoad,
    cost,
    force_model,
)

DEPENDENT = 1e-11
"""Relative size of a singular value of the six equations that counts as zero."""

MISSING = 1e-9
"""Relative residual above which a wrench cannot be given."""

WITHIN = 1e-12
"""Tolerance of the limits, relative to the load."""


def share_load(
    contacts: Contacts,
    wrench: Float[np.ndarray, "*#batch axes"],
    model: ForceModel | str = "minimum-norm",
    *,
    joints: JointLoad | None = None,
    time: Float[np.ndarray, "*times"] | None = None,
) -> Float[np.ndarray, "*all legs 3"]:
    """Return the ground reaction forces that give a wrench.

    All models give the wrench to round-off. They differ in the cost that they minimise and in the
    limits that they keep.

    Args:
        contacts: Feet, stance and ground of L legs.
        wrench: Force [N] and moment [N·m] of the ground about the origin of the feet, shape
            (..., 6). Leading axes broadcast.
        model: A force model, or the name of one with default options.
        joints: Load of the joints, for `MinimumTorque` and for torque limits.
        time: Times of the samples [s], for messages.

    Returns:
        Forces in the axes of the inputs [N], shape (..., L, 3); 0 where a foot's share is 0.

    Raises:
        InfeasibleLoad: The feet cannot give the wrench within the model's limits; the message has
            the first such sample, the feet or joints, the limit and the excess.
        InvalidInput: A shape does not fit, or the model needs the joints.

    Source: docs/forces.md.
    """
    model = force_model(model) if isinstance(model, str) else model
    wrench = numbers(wrench, "wrench")
    if wrench.shape[-1:] != (6,) or not np.isfinite(wrench).all():
        raise InvalidInput(
            f"wrench has shape {wrench.shape}; it must be finite, and its last axis have 6 entries."
        )
    legs, shapes = contacts.feet.shape[-2], [contacts.feet.shape[:-2], wrench.shape[:-1]]
    if joints is not None:
        shapes.append(joints.jacobian.shape[:-3])
        if joints.jacobian.shape[-3] != legs:
            count = joints.jacobian.shape[-3]
            raise InvalidInput(f"the joints' load is of {count} legs; there are {legs} feet.")
    batch = np.broadcast_shapes(*shapes)
    force = np.zeros((int(np.prod(batch)), legs, 3))
    failed: dict[int, tuple[Load, np.ndarray]] = {}
    for load in loads(contacts, wrench, joints, cost(model, contacts, joints), batch):
        found, missing = _forces(load, model)
        force[load.samples[:, None], load.legs] = found
        for row in np.flatnonzero(~np.isfinite(found).all(axis=(1, 2)) | missing.any(axis=1)):
            failed[int(load.samples[row])] = load.of(np.array([row])), missing[row]
    if failed:
        first = min(failed)
        least = model.least_normal if isinstance(model, Limited) else 0.0
        index = tuple(int(i) for i in np.unravel_index(first, batch)) if batch else ()
        when = None if time is None else float(np.broadcast_to(time, batch)[index])
        raise explain(*failed[first], least, index, when)
    return force.reshape(*batch, legs, 3)


def minimum_norm(
    feet: Float[np.ndarray, "*batch legs 3"],
    stance: Bool[np.ndarray, "*batch legs"],
    wrench: Float[np.ndarray, "*batch 6"],
) -> Float[np.ndarray, "*batch legs 3"]:
    """Return the ground reaction forces of least norm that give a wrench.

    Args:
        feet: Feet from the point of the moment [m], shape (..., L, 3).
        stance: Feet that stand; the others have no force, shape (..., L).
        wrench: Force [N] and moment [N·m] of the ground, shape (..., 6).

    Raises:
        InfeasibleLoad: Fewer than three feet stand, or they stand in a line.

    Source: minimisation of the norm of the feet forces, as named in the paper's abstract.
    """
    return share_load(Contacts(feet, stance), wrench)


def _forces(load: Load, model: ForceModel) -> tuple[np.ndarray, np.ndarray]:
    """Return the forces, NaN where none are within the limits, and the missing wrenches.

    With D = H⁻¹ = W Wᵀ and F = D c + W y the cost is ½ y · y and the equations are
    A W y = w - A D c. The least y solves them without limits; limits move it in the null space of
    A W.
    """
    n, k = load.share.shape
    if k == 0:
        return np.zeros((n, 0, 3)), load.wrench
    W = np.linalg.cholesky(load.inverse)
    A = load.grasp
    B = np.einsum("neki,nkij->nekj", A.reshape(n, 6, k, 3), W).reshape(n, 6, 3 * k)
    U, sizes, Vh = np.linalg.svd(B)
    V, rank = np.swapaxes(Vh, 1, 2), sizes.shape[1]
    independent = sizes > DEPENDENT * sizes[:, :1]
    inverse = np.divide(1.0, sizes, out=np.zeros_like(sizes), where=independent)
    solve = (V[..., :rank] * inverse[:, None]) @ np.swapaxes(U[..., :rank], 1, 2)
    force = (load.inverse @ load.gain[..., None])[..., 0]

    def missing() -> np.ndarray:
        return load.wrench - (A @ force.reshape(n, -1, 1))[..., 0]

    # The second pass refines: where legs are nearly stretched the system is ill-conditioned.
    for _ in range(2):
        force = force + (W @ (solve @ missing()[..., None]).reshape(n, k, 3, 1))[..., 0]
    left = missing()
    enough = MISSING * (1.0 + np.abs(load.wrench).max(axis=1))
    left[np.abs(left).max(axis=1) <= enough] = 0.0
    if isinstance(model, Limited) and not left.any():
        todo = np.arange(n)
        if isinstance(model, FrictionCone):
            todo = np.flatnonzero(~_within(load, force, model.least_normal))
        # All samples need equally many columns; those inside the equations' rows are set to 0.
        null = (
            V[..., rank:]
            if independent.all()
            else V * ~np.pad(independent, ((0, 0), (0, 3 * k - rank)))[:, None]
        )
        if len(todo):
            force[todo] = _limited(load.of(todo), force[todo], W[todo], null[todo], model)
    return force, left


def _within(load: Load, force: np.ndarray, least: float) -> np.ndarray:
    """Return the samples that keep all limits, shape (n,)."""
    f = load.in_contact_axes(force)
    slack = WITHIN * np.abs(force).max(axis=(-2, -1))[:, None]
    torque = load.torque_with(force)
    good = np.hypot(f[..., 1], f[..., 2]) <= load.friction * f[..., 0] + slack
    good &= f[..., 0] >= least * load.share - slack
    good &= (np.abs(torque) <= load.limit).all(axis=-1)
    return np.asarray(good.all(axis=-1))


def _limited(
    load: Load, force: np.ndarray, W: np.ndarray, null: np.ndarray, model: Limited
) -> np.ndarray:
    """Return the forces within the limits that are nearest to those without; NaN where none are."""
    n, k = load.share.shape
    V = W @ null.reshape(n, k, 3, null.shape[-1])
    U = np.swapaxes(load.axes, -1, -2) @ V
    scale = np.abs(force).max(axis=(-2, -1))
    scale = np.where(scale > 0, scale, 1.0)[:, None]
    f = load.in_contact_axes(force) / scale[..., None]
    limits = push_limits(load, f, U, model.least_normal, scale)
    if np.isfinite(load.limit).any():
        limits = Rows.join(limits, torque_limits(load, force, V, scale))
    if isinstance(model, SmallestLargestLoad):
        largest = _smallest_largest(load, f, U, limits, 0.1 * model.slack)
        # Samples without forces within the limits stay without a bound, and without a solution.
        upper = np.nan_to_num((1.0 + model.slack) * largest, nan=UNBOUNDED)[:, None] * load.share
        limits = Rows.join(limits, Rows.below(U[..., 0, :], upper - f[..., 0]))
        force = np.where(np.isfinite(largest)[:, None, None], force, np.nan)
    x = cheapest_points(f, U, load.friction, limits)
    return force + scale[..., None] * (V @ x[:, None, :, None])[..., 0]


def _smallest_largest(
    load: Load, f: np.ndarray, U: np.ndarray, limits: Rows, tolerance: float
) -> np.ndarray:
    """Return the smallest largest ratio of normal force to share, shape (n,); NaN where none.

    It is one more unknown t with normal force <= t * share, which is minimised.
    """
    n, k, _, free = U.shape
    with_t = np.concatenate([U, np.zeros((n, k, 3, 1))], axis=-1)
    wider = limits._replace(A=np.pad(limits.A, ((0, 0), (0, 0), (0, 1))))
    below_t = np.concatenate([U[..., 0, :], -load.share[..., None]], axis=-1)
    first = Rows.join(wider, Rows.below(below_t, -f[..., 0]))
    slope = np.append(np.zeros(free), 1.0)
    return cheapest_points(f, with_t, load.friction, first, slope, tolerance)[:, -1]
