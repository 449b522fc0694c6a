"""Friction demand of foot forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.arguments import numbers
from phasmid.errors import InvalidInput
from phasmid.forces.arguments import between, finite
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

    def summary(self, percentile: float = 95.0) -> dict[str, dict[str, float]]:
        """Return extremes, means and a percentile over all samples and standing feet.

        Args:
            percentile: 0 to 100.

        Returns:
            For ``demand``, ``normal_force`` and ``tangential_force`` the ``mean``, ``max`` and
            ``percentile``; for ``normal_force`` also the ``min``; for ``margin`` the ``mean``,
            ``min`` and the percentile from below. Empty where no foot stands.

        Raises:
            InvalidInput: The percentile is not between 0 and 100.
        """
        between(percentile, "percentile", 0, 100)
        stands = np.isfinite(self.normal_force)
        if not stands.any():
            return {}
        found = {}
        for name in ("demand", "normal_force", "tangential_force", "margin"):
            values = getattr(self, name)[stands]
            least = name == "margin"
            # No interpolation: a demand may be infinite.
            rank = np.percentile(
                values, 100 - percentile if least else percentile, method="nearest"
            )
            found[name] = {
                "mean": float(values.mean()),
                "min" if least else "max": float(values.min() if least else values.max()),
                "percentile": float(rank),
            }
        found["normal_force"]["min"] = float(self.normal_force[stands].min())
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
    force = numbers(force, "force")
    if force.shape != contacts.feet.shape:
        raise InvalidInput(f"force has shape {force.shape}; it must be {contacts.feet.shape}.")
    stands = contacts.stance
    force[~stands] = 0.0
    finite(force, "force")
    n = contacts.normals
    normal = np.sum(force * n, axis=-1)
    tangential = np.linalg.norm(force - normal[..., None] * n, axis=-1)
    pushes = normal > 0
    demand = np.where(pushes, tangential / np.where(pushes, normal, 1.0), np.inf)
    demand = np.where((normal == 0) & (tangential == 0), 0.0, demand)
    margin = contacts.friction * normal - tangential
    return FrictionStatistics(
        *(np.where(stands, values, np.nan) for values in (normal, tangential, demand, margin))
    )
