"""Foot-force distribution: the forces of the standing feet that give a wrench."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from phasmid.errors import InvalidInput
from phasmid.forces.arguments import broadcast, finite
from phasmid.forces.contacts import Contacts, JointLoad
from phasmid.forces.equilibrium import cheapest_forces
from phasmid.forces.infeasibility import explain
from phasmid.forces.limits import admissible_forces
from phasmid.forces.models import ForceModel, Limited, force_model, unlimited
from phasmid.forces.problem import Problem, shared_axes


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
    if isinstance(model, str):
        model = force_model(model)
    wrench = finite(wrench, "wrench")
    if wrench.shape[-1:] != (6,):
        raise InvalidInput(f"wrench has shape {wrench.shape}; its last axis must have 6 entries.")
    batch = shared_axes(contacts, wrench, joints)
    shape = (*batch, *contacts.feet.shape[-2:])
    if time is not None:
        time = broadcast(finite(time, "time"), batch, "time")
    cost, limited = unlimited(model), model if isinstance(model, Limited) else None
    problem = Problem.of(contacts, wrench, joints, batch, *cost.cost(contacts, joints))
    if 0 in batch:
        return np.zeros(shape)
    force, missing = cheapest_forces(problem.grasp, problem.inverse, problem.gain, problem.wrench)
    feasible = ~missing.any(axis=-1)
    if limited is not None and feasible.all():
        force = admissible_forces(problem, force, limited)
        feasible = np.isfinite(force).all(axis=(-2, -1))
    if not feasible.all():
        sample = int(np.argmin(feasible))
        least = limited.least_normal if limited is not None else 0.0
        raise explain(problem, sample, missing[sample], least, cost, batch, time)
    return force.reshape(shape)


def minimum_norm(
    feet: Float[np.ndarray, "*batch legs 3"],
    stance: Bool[np.ndarray, "*batch legs"],
    wrench: Float[np.ndarray, "*batch 6"],
) -> Float[np.ndarray, "*batch legs 3"]:
    """Return the ground reaction forces of least norm that give a wrench.

    On level ground, with the centre of mass between three standing feet at rest, they are vertical
    and push. In general they know neither friction nor that the ground cannot pull.

    Args:
        feet: Feet from the point of the moment [m], shape (..., L, 3).
        stance: Feet that stand; the others have no force, shape (..., L).
        wrench: Force [N] and moment [N·m] of the ground, shape (..., 6).

    Raises:
        InfeasibleLoad: Fewer than three feet stand, or they stand in a line.
        InvalidInput: A number is not finite, or the shapes do not fit.

    Source: minimisation of the norm of the feet forces, as named in the paper's abstract.
    """
    return share_load(Contacts(feet, stance), wrench)
