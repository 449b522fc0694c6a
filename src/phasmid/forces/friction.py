"""Friction demand of foot forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.arguments import numbers
from phasmid.errors import InvalidInput
from phasmid.forces.contacts import Contacts


@dataclass(frozen=True, eq=False)
class FrictionStatistics:
    """Normal and tangential force of each foot, and their friction demand; NaN in the air.

    Attributes:
        normal_force: Along the ground's normal, positive where the ground pushes [N], (..., L).
        tangential_force: Size of the force along the ground [N], (..., L).
        demand: Tangential over normal force: the required coefficient of friction; infinite where
            a foot pulls, or has a tangential force only, (..., L).
        margin: Friction times normal force minus tangential force [N]; negative where the foot
            slips, (..., L).
    """

    normal_force: Float[np.ndarray, "*batch legs"]
    tangential_force: Float[np.ndarray, "*batch legs"]
    demand: Float[np.ndarray, "*batch legs"]
    margin: Float[np.ndarray, "*batch legs"]

    def summary(self) -> dict[str, dict[str, float]]:
        """Return statistics over all samples and standing feet; empty where no foot stands.

        Returns:
            For ``normal_force``, ``tangential_force``, ``demand`` and ``margin`` the ``mean``,
            ``min``, ``max``, and the percentiles ``p5`` and ``p95``.
        """
        stands = np.isfinite(self.normal_force)
        if not stands.any():
            return {}
        # No interpolation: a demand may be infinite.
        found = {}
        for name, values in vars(self).items():
            low, high = np.percentile(values[stands], (5, 95), method="nearest")
            found[name] = {
                "mean": float(values[stands].mean()),
                "min": float(values[stands].min()),
                "max": float(values[stands].max()),
                "p5": float(low),
                "p95": float(high),
            }
        return found


def friction_statistics(contacts: Contacts, force: Float[np.ndarray, "..."]) -> FrictionStatistics:
    """Return the friction demand of modelled or measured forces.

    Args:
        contacts: Feet, stance and ground.
        force: Ground reaction forces in the axes of the contacts [N], shape (..., L, 3); those of
            feet in the air are ignored.

    Raises:
        InvalidInput: The shape does not fit, or the force of a standing foot is not finite.
    """
    force, stands, n = numbers(force, "force"), contacts.stance, contacts.normals
    if force.shape != contacts.feet.shape or not np.isfinite(force[stands]).all():
        raise InvalidInput(
            f"force has shape {force.shape}; it must be {contacts.feet.shape}, and finite where a "
            "foot stands."
        )
    force[~stands] = 0.0
    normal = np.sum(force * n, axis=-1)
    tangential = np.linalg.norm(force - normal[..., None] * n, axis=-1)
    pushes = normal > 0
    demand = np.where(pushes, tangential / np.where(pushes, normal, 1.0), np.inf)
    demand = np.where((normal == 0) & (tangential == 0), 0.0, demand)
    margin = contacts.friction * normal - tangential
    return FrictionStatistics(
        *(np.where(stands, values, np.nan) for values in (normal, tangential, demand, margin))
    )
