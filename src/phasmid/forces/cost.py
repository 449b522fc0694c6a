"""What the foot forces cost, foot by foot."""

from __future__ import annotations

from typing import assert_never

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.forces.contacts import Contacts, JointLoad
from phasmid.forces.family import MinimumNorm, MinimumTorque, Unlimited, WeightedMinimumNorm


def cost_of(
    model: Unlimited, contacts: Contacts, joints: JointLoad | None
) -> tuple[Float[np.ndarray, "*batch legs 3 3"], Float[np.ndarray, "*batch legs 3"]]:
    """The cost ½ Fᵀ H F - cᵀ F of each foot's force.

    Args:
        model: Tells what is made least.
        contacts: The feet.
        joints: What the joints carry.

    Returns:
        H⁻¹ and c of each foot, shapes (..., L, 3, 3) and (..., L, 3).

    Raises:
        InvalidInput: Torques shall be least, and no joints are given.
    """
    if isinstance(model, MinimumTorque):
        if joints is None:
            raise InvalidInput(
                f"{model.name} needs what the joints carry; nothing is given.",
                hint="joints = JointLoad(jacobian, torque)",
            )
        # Half the square of tau - Jᵀ F, and of the lever times F.
        J = joints.jacobian
        H = J @ np.swapaxes(J, -1, -2) + model.lever**2 * np.eye(3)
        # By eigenvalues: the inverse stays positive for the shortest of levers.
        sizes, axes = np.linalg.eigh(H)
        inverse = (axes / sizes[..., None, :]) @ np.swapaxes(axes, -1, -2)
        return inverse, np.einsum("...ij,...j->...i", J, joints.torque)
    zero = np.zeros(contacts.feet.shape)
    if isinstance(model, WeightedMinimumNorm):
        across = 1.0 / model.tangential_weight
        n = contacts.normals
        return across * np.eye(3) + (1.0 - across) * n[..., :, None] * n[..., None, :], zero
    if isinstance(model, MinimumNorm):
        return np.broadcast_to(np.eye(3), (*zero.shape, 3)), zero
    assert_never(model)
