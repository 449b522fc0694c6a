"""How much of the friction a distribution of forces asks for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.arguments import check_type, numbers
from phasmid.errors import InvalidInput
from phasmid.forces.arguments import between, finite
from phasmid.forces.contacts import Contacts


@dataclass(frozen=True, eq=False)
class FrictionStatistics:
    """Normal and tangential forces of each foot, and what friction they need.

    Feet that do not stand have NaN.

    Attributes:
        normal_force: Along the ground's normal, positive where the ground pushes [N], (..., L).
        tangential_force: Size of the force along the ground [N], (..., L).
        demand: Tangential over normal force: the coefficient of friction that is needed; infinite
            where a foot pulls or is pushed sideways without load, (..., L).
        margin: Friction times normal force, less the tangential force [N]; below 0 the foot would
            slip, (..., L).
    """

    normal_force: Float[np.ndarray, "*batch legs"]
    tangential_force: Float[np.ndarray, "*batch legs"]
    demand: Float[np.ndarray, "*batch legs"]
    margin: Float[np.ndarray, "*batch legs"]

    def summary(self, percentile: float = 95.0) -> dict[str, dict[str, float]]:
        """Largest, mean and a percentile over all samples and standing feet.

        Args:
            percentile: Which one, 0 to 100.

        Returns:
            For ``demand``, ``normal_force`` and ``tangential_force`` the ``mean``, ``max`` and
            ``percentile``; for ``normal_force`` also the ``min``; for ``margin`` the ``mean``,
            ``min`` and the ``percentile`` counted from the other end. Empty where no foot stands.

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
            # No interpolation: between an infinite demand and another there is no number.
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
    """What friction some forces need, whatever model or measurement they come from.

    Args:
        contacts: The feet, which of them stand, and the ground under them.
        force: Forces of the ground on the feet, in the axes of the contacts [N], (..., L, 3);
            those of feet that do not stand do not matter.

    Raises:
        InvalidInput: The forces are not of these feet, or that of a standing one is not finite.
    """
    check_type("contacts", contacts, (Contacts,), "Contacts", "Contacts(feet, stance)")
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
