"""Mass and inertia of bodies, in any frame, possible or not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True, eq=False)
class Inertial:
    """Mass of a body and its distribution.

    Attributes:
        mass: Mass [kg].
        com: Centre of mass in the body's frame [m], shape (3,).
        inertia: About the centre of mass, in the axes of that frame [kg·m²], shape (3, 3).
    """

    mass: float
    com: Float[np.ndarray, "3"]
    inertia: Float[np.ndarray, "3 3"]

    def at(self, X: Float[np.ndarray, "4 4"]) -> Inertial:
        """Return the same in another frame.

        Args:
            X: Pose of the body's frame in the other, shape (4, 4).
        """
        R = X[:3, :3]
        com = R @ np.asarray(self.com, dtype=float) + X[:3, 3]
        tensor = R @ np.asarray(self.inertia, dtype=float) @ R.T
        # Round-off leaves the two halves a little apart.
        return Inertial(float(self.mass), com, (tensor + tensor.T) / 2)

    def scaled(self, factor: float) -> Inertial:
        """Return the same body with another density."""
        return Inertial(factor * self.mass, self.com, factor * self.inertia)


def merged(bodies: Sequence[Inertial]) -> Inertial | None:
    """Merge bodies of one frame that are fixed to each other; None where there is none.

    Source: the parallel axis theorem, I + m (d·d 1 − d dᵀ).
    """
    if len(bodies) < 2:
        return bodies[0] if bodies else None
    mass = sum(body.mass for body in bodies)
    if mass <= 0:
        # Nothing to weigh the places with: bodies without mass.
        return Inertial(mass, bodies[0].com, sum((b.inertia for b in bodies), np.zeros((3, 3))))
    com = sum((body.mass * body.com for body in bodies), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for body in bodies:
        d = body.com - com
        inertia += body.inertia + body.mass * (d @ d * np.eye(3) - np.outer(d, d))
    return Inertial(mass, com, inertia)
