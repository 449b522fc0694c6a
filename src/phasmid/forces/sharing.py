"""One interface to the family: how the standing feet share a load."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.arguments import check_type
from phasmid.errors import InfeasibleLoad, InvalidInput
from phasmid.forces.arguments import broadcast, finite
from phasmid.forces.contacts import Contacts, JointLoad
from phasmid.forces.cost import cost_of
from phasmid.forces.equilibrium import cheapest_forces
from phasmid.forces.family import (
    ForceModel,
    FrictionCone,
    MinimumNorm,
    SmallestLargestLoad,
    Unlimited,
    force_model,
    without_limits,
)
from phasmid.forces.infeasibility import explain
from phasmid.forces.limits import admissible_forces
from phasmid.forces.minimum_norm import minimum_norm
from phasmid.forces.problem import in_a_row, shared_axes


def share_load(
    contacts: Contacts,
    wrench: Float[np.ndarray, "*#batch axes"],
    model: ForceModel | str = "minimum-norm",
    *,
    joints: JointLoad | None = None,
    time: Float[np.ndarray, "*times"] | None = None,
) -> Float[np.ndarray, "*all legs 3"]:
    """Forces of the ground on the feet that give a force and a moment.

    All members of the family give the wrench to round-off; they differ in what they make least
    and in the limits that they know.

    Args:
        contacts: The feet, which of them stand, and the ground under them; L legs.
        wrench: Force [N] and moment [N·m] that the ground must give, about the point from which
            the feet are measured, shape (..., 6). Leading axes broadcast.
        model: A member of the family, or its name for one with default options.
        joints: What the joints carry; needed for the least torques and for torque limits.
        time: Times of the samples [s], for messages; its shape must fit the leading axes.

    Returns:
        Forces in the axes of the inputs [N], shape (..., L, 3); 0 where a foot's share is 0.

    Raises:
        InfeasibleLoad: The standing feet cannot give the wrench within the model's limits; it
            tells the first such sample, the feet or joints, the limit, and by how much.
        InvalidInput: A kind, shape or number does not fit, or the model needs the joints' load.

    Source: docs/forces.md.
    """
    check_type("contacts", contacts, (Contacts,), "Contacts", "Contacts(feet, stance)")
    if joints is not None:
        check_type("joints", joints, (JointLoad,), "JointLoad", "JointLoad(jacobian, torque)")
    if not isinstance(model, ForceModel):
        model = force_model(model)
    wrench = finite(wrench, "wrench")
    if wrench.shape[-1:] != (6,):
        raise InvalidInput(f"wrench has shape {wrench.shape}; its last axis must have 6 entries.")
    batch = shared_axes(contacts, wrench, joints)
    shape = (*batch, *contacts.feet.shape[-2:])
    if time is not None:
        time = broadcast(finite(time, "time"), batch, "time")

    share = np.asarray(contacts.share)
    plain = np.all((share == 0) | (share == 1)) and np.all(share.sum(axis=-1) >= 3)
    if isinstance(model, MinimumNorm) and plain and shape == contacts.feet.shape:
        try:
            return minimum_norm(
                contacts.feet, contacts.stance, np.broadcast_to(wrench, (*batch, 6))
            )
        except InfeasibleLoad:
            pass  # Feet on one line; the general way tells whether they can give this load.

    limited = model if isinstance(model, FrictionCone | SmallestLargestLoad) else None
    cost = _unlimited(model)
    inverse, gain = cost_of(cost, contacts, joints)
    if 0 in batch:
        return np.zeros(shape)
    problem = in_a_row(contacts, wrench, joints, batch, inverse, gain)
    force, missing = cheapest_forces(problem.grasp, problem.inverse, problem.gain, problem.wrench)
    given = ~missing.any(axis=-1)
    if limited is not None and given.all():
        force = admissible_forces(problem, force, limited)
        given = np.isfinite(force).all(axis=(-2, -1))
    if not given.all():
        lost = int(np.argmin(given))
        least = limited.least_normal if limited is not None else 0.0
        raise explain(problem, lost, missing[lost], least, cost, batch, time)
    return force.reshape(shape)


def _unlimited(model: ForceModel) -> Unlimited:
    """What a model would make least without limits."""
    if isinstance(model, FrictionCone):
        return without_limits(model.cost)
    return MinimumNorm() if isinstance(model, SmallestLargestLoad) else model
