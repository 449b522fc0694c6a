"""Friction demand of foot forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

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
        found = {}
        for name, values in vars(self).items():
            # No interpolation: a demand may be infinite.
            percentiles = np.percentile(values[stands], (0, 5, 95, 100), method="nearest")
            numbers = dict(zip(("min", "p5", "p95", "max"), percentiles.tolist(), strict=True))
            found[name] = {"mean": float(values[stands].mean()), **numbers}
        return found


def friction_statistics(
    contacts: Contacts, force: Float[np.ndarray, "*batch legs 3"]
) -> FrictionStatistics:
    """Return the friction demand of modelled or measured forces.

    Args:
        contacts: Feet, stance and ground.
        force: Ground reaction forces in the axes of the contacts [N], shape (..., L, 3); those of
            feet in the air are ignored.
    """
    force = np.where(contacts.stance[..., None], force, np.nan)
    normal = np.sum(force * contacts.normals, axis=-1)
    tangential = np.linalg.norm(force - normal[..., None] * contacts.normals, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        demand = np.where(normal > 0, tangential / normal, np.inf)
    demand[(normal == 0) & (tangential == 0)] = 0.0
    demand[~contacts.stance] = np.nan
    margin = contacts.friction * normal - tangential
    return FrictionStatistics(normal, tangential, demand, margin)
