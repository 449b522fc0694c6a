"""Foot-force distribution: the forces of the standing feet that give a wrench."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from phasmid.errors import InvalidInput
from phasmid.forces.cones import Rows, cheapest_points
from phasmid.forces.contacts import Contacts, JointLoad
from phasmid.forces.infeasibility import explain
from phasmid.forces.load import Load, grasp_matrix, push_limits
from phasmid.forces.models import ForceModel, Limited, SmallestLargestLoad, cost, force_model

NEGLIGIBLE = 1e-9
"""Share below which a foot carries nothing."""

DEPENDENT = 1e-11
"""Relative size of a singular value of the six equations that counts as zero."""

MISSING = 1e-9
"""Relative residual above which a wrench cannot be given."""

WITHIN = 1e-12
"""Tolerance of the limits, relative to the load."""

LARGEST_COST = 1e4
"""Cost of the largest load, beside half of the square of a force, both in units of the load."""


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
        InvalidInput: The wrench has no six numbers, or the model needs the joints.

    Source: docs/forces.md.
    """
    model = force_model(model) if isinstance(model, str) else model
    if wrench.shape[-1:] != (6,) or not np.isfinite(wrench).all():
        raise InvalidInput(
            f"wrench has shape {wrench.shape}; it must be finite, and its last axis have 6 entries."
        )
    inverse, gain = cost(model, contacts, joints)
    legs = contacts.feet.shape[-2]
    joints = joints or JointLoad(np.zeros((legs, 3, 3)), np.zeros((legs, 3)))
    batch = np.broadcast_shapes(
        contacts.feet.shape[:-2], wrench.shape[:-1], joints.jacobian.shape[:-3]
    )

    def flat(values: float | np.ndarray, axes: int) -> np.ndarray:
        shape = np.shape(values)[np.ndim(values) - axes :]
        return np.broadcast_to(values, (*batch, *shape)).reshape(-1, *shape)

    share = flat(contacts.share, 1)
    loads = Load(
        wrench=flat(wrench, 1),
        feet=flat(contacts.feet, 2),
        share=share,
        axes=flat(contacts.axes, 3),
        friction=flat(contacts.friction, 1),
        inverse=flat(inverse, 3) * share[..., None, None],
        gain=flat(gain, 2),
        jacobian=flat(joints.jacobian, 3),
        torque=flat(joints.torque, 2),
        limit=flat(joints.limit, 2),
    )
    force, missing = np.zeros(loads.feet.shape), np.zeros(loads.wrench.shape)
    stands = share >= NEGLIGIBLE
    for stance in np.unique(stands, axis=0):
        samples = np.flatnonzero((stands == stance).all(axis=-1))
        found = _forces(loads.of(samples, stance), model)
        force[samples[:, None], stance], missing[samples] = found
    failed = np.flatnonzero(~np.isfinite(force).all(axis=(1, 2)) | missing.any(axis=1))
    if len(failed):
        first = failed[0]
        stance = stands[first]
        index = tuple(int(i) for i in np.unravel_index(first, batch))
        names = [name for name, on in zip(contacts.leg_names, stance, strict=True) if on]
        raise explain(
            loads.of(failed[:1], stance),
            names,
            missing[first],
            index,
            None if time is None else float(np.broadcast_to(time, batch)[index]),
        )
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
    W, A = np.linalg.cholesky(load.inverse), grasp_matrix(load.feet)
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
        # All samples need equally many columns; those inside the equations' rows are set to 0.
        common = independent.sum(axis=1).min()
        null = V * ~np.pad(independent, ((0, 0), (0, 3 * k - rank)))[:, None]
        todo = np.arange(n)
        if not isinstance(model, SmallestLargestLoad):
            todo = np.flatnonzero(~_within(load, force))
        if len(todo):
            V = W[todo] @ null[todo, :, common:].reshape(len(todo), k, 3, -1)
            force[todo] = _limited(load.of(todo), force[todo], V, model)
    return force, left


def _within(load: Load, force: np.ndarray) -> np.ndarray:
    """Return the samples that keep all limits, shape (n,)."""
    f = np.einsum("nlij,nli->nlj", load.axes, force)
    slack = WITHIN * np.abs(force).max(axis=(-2, -1))[:, None]
    torque = load.torque_with(force)
    good = np.hypot(f[..., 1], f[..., 2]) <= load.friction * f[..., 0] + slack
    good &= f[..., 0] >= -slack
    good &= (np.abs(torque) <= load.limit).all(axis=-1)
    return np.asarray(good.all(axis=-1))


def _limited(load: Load, force: np.ndarray, V: np.ndarray, model: Limited) -> np.ndarray:
    """Return the cheapest forces force + V x within the limits; NaN where there are none."""
    U = np.swapaxes(load.axes, -1, -2) @ V
    scale = np.abs(force).max(axis=(-2, -1))
    scale = np.where(scale > 0, scale, 1.0)[:, None]
    f = np.einsum("nlij,nli->nlj", load.axes, force) / scale[..., None]
    slope = np.zeros(U.shape[-1])
    if isinstance(model, SmallestLargestLoad):
        # One more unknown t, at least each foot's normal force over its share.
        V, U = (np.pad(part, ((0, 0), (0, 0), (0, 0), (0, 1))) for part in (V, U))
        slope = np.append(slope, LARGEST_COST)
    limits = push_limits(f, U)
    if isinstance(model, SmallestLargestLoad):
        below_t = U[..., 0, :].copy()
        below_t[..., -1] = -load.share
        limits = Rows.join(limits, Rows.below(below_t, -f[..., 0]))
    if np.isfinite(load.limit).any():
        limits = Rows.join(limits, load.torque_limits(force, V, scale))
    x = cheapest_points(f, U, load.friction, limits, slope)
    return force + scale[..., None] * (V @ x[:, None, :, None])[..., 0]
