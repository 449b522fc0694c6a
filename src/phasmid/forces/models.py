"""Force models: the cost that each one minimises, and the limits that it keeps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from phasmid.arguments import described
from phasmid.errors import InvalidInput, nearest
from phasmid.forces.arguments import between
from phasmid.forces.contacts import Contacts, JointLoad

Cost = tuple[Float[np.ndarray, "*batch legs 3 3"], Float[np.ndarray, "*batch legs 3"]]
"""H⁻¹ and c of each foot's cost ½ Fᵀ H F - cᵀ F, shapes (..., L, 3, 3) and (..., L, 3)."""

HEAVIEST = 1e6
"""Bound of a tangential weight and of its inverse; beyond it round-off exceeds 1e-9 of the load."""

SHORTEST = 1e-5
"""Bound of a lever, for the same reason [m]."""

MOST_NORMAL = 1e6
"""Bound of a least normal force [N]."""


@dataclass(frozen=True)
class MinimumNorm:
    """Least sum of squares of the foot forces, the paper's model."""

    name: ClassVar[str] = "minimum-norm"

    def cost(self, contacts: Contacts, joints: JointLoad | None) -> Cost:
        """Return the cost |F|²/2 of each foot."""
        del joints
        shape = contacts.feet.shape
        return np.broadcast_to(np.eye(3), (*shape, 3)), np.zeros(shape)


@dataclass(frozen=True)
class WeightedMinimumNorm:
    """Least sum of squares in which tangential forces have a weight.

    Attributes:
        tangential_weight: Cost of a tangential force relative to a normal one.

    Raises:
        InvalidInput: The weight is not between 1e-6 and 1e6.
    """

    name: ClassVar[str] = "weighted-minimum-norm"
    tangential_weight: float = 10.0

    def __post_init__(self) -> None:
        between(self.tangential_weight, "tangential_weight", 1 / HEAVIEST, HEAVIEST)

    def cost(self, contacts: Contacts, joints: JointLoad | None) -> Cost:
        """Return the cost (normal² + weight tangential²)/2 of each foot."""
        del joints
        inverse, n = 1.0 / self.tangential_weight, contacts.normals
        H_inverse = inverse * np.eye(3) + (1.0 - inverse) * n[..., :, None] * n[..., None, :]
        return H_inverse, np.zeros(contacts.feet.shape)


@dataclass(frozen=True)
class MinimumTorque:
    """Least sum of squares of the joint torques.

    Attributes:
        lever: Length at whose end each force also counts as a torque [m]. A stretched or folded
            leg needs no torque for some force; the lever keeps the cost regular there, and changes
            torques by about the square of its ratio to the links' lengths.

    Raises:
        InvalidInput: The lever is not between 1e-5 m and 1000 m.
    """

    name: ClassVar[str] = "minimum-torque"
    lever: float = 1e-3

    def __post_init__(self) -> None:
        between(self.lever, "lever", SHORTEST, 1e3, " m")

    def cost(self, contacts: Contacts, joints: JointLoad | None) -> Cost:
        """Return the cost (|τ - Jᵀ F|² + lever² |F|²)/2 of each foot.

        Raises:
            InvalidInput: There are no joints.
        """
        del contacts
        if joints is None:
            raise InvalidInput(
                f"{self.name} needs the load of the joints; none is given.",
                hint="joints = JointLoad(jacobian, torque)",
            )
        J = joints.jacobian
        H = J @ np.swapaxes(J, -1, -2) + self.lever**2 * np.eye(3)
        # By eigenvalues: the inverse stays positive for the shortest levers.
        sizes, axes = np.linalg.eigh(H)
        H_inverse = (axes / sizes[..., None, :]) @ np.swapaxes(axes, -1, -2)
        return H_inverse, np.einsum("...ij,...j->...i", J, joints.torque)


Unlimited = MinimumNorm | WeightedMinimumNorm | MinimumTorque
"""Models without limits."""

UNLIMITED: dict[str, type[Unlimited]] = {
    model.name: model for model in (MinimumNorm, WeightedMinimumNorm, MinimumTorque)
}


@dataclass(frozen=True)
class FrictionCone:
    """Least cost within friction cones and torque limits.

    No foot pulls, each force is in its circular friction cone, and each joint of a standing leg is
    within its torque limit where there is one.

    Attributes:
        cost: A model without limits, or its name; kept as the model.
        least_normal: Least normal force of a standing foot, times its share [N].

    Raises:
        InvalidInput: The cost is no such model, or the least normal force is not between 0 and
            1e6 N.
    """

    name: ClassVar[str] = "friction-cone"
    cost: Unlimited | str = MinimumNorm()
    least_normal: float = 0.0

    def __post_init__(self) -> None:
        if isinstance(self.cost, str) and self.cost in UNLIMITED:
            object.__setattr__(self, "cost", UNLIMITED[self.cost]())
        if not isinstance(self.cost, Unlimited):
            raise InvalidInput(
                f"the cost is {described(self.cost)}; it must be a force model without limits.",
                hint=f"one of {', '.join(UNLIMITED)}",
            )
        between(self.least_normal, "least_normal", 0.0, MOST_NORMAL, " N")


@dataclass(frozen=True)
class SmallestLargestLoad:
    """Smallest largest ratio of normal force to share, within the limits of `FrictionCone`.

    Of all forces with that ratio, those of least norm.

    Attributes:
        least_normal: Least normal force of a standing foot, times its share [N].
        slack: Relative excess of the largest load that is allowed when the norm is minimised.
            Without it the least norm is ill-conditioned wherever friction bounds the load.

    Raises:
        InvalidInput: The least normal force is not between 0 and 1e6 N, or the slack is not
            between 1e-5 and 1.
    """

    name: ClassVar[str] = "smallest-largest-load"
    least_normal: float = 0.0
    slack: float = 1e-5

    def __post_init__(self) -> None:
        between(self.least_normal, "least_normal", 0.0, MOST_NORMAL, " N")
        between(self.slack, "slack", 1e-5, 1.0)


Limited = FrictionCone | SmallestLargestLoad
"""Models with friction and torque limits."""

ForceModel = Unlimited | Limited

_BY_NAME: dict[str, type[ForceModel]] = {
    **UNLIMITED,
    FrictionCone.name: FrictionCone,
    SmallestLargestLoad.name: SmallestLargestLoad,
}

FORCE_MODELS = tuple(_BY_NAME)
"""Names of the force models."""


def force_model(name: str) -> ForceModel:
    """Return the force model of a name, with its default options.

    Raises:
        InvalidInput: There is none; the hint is the nearest name.
    """
    if name not in FORCE_MODELS:
        known, guess = ", ".join(FORCE_MODELS), nearest(str(name), FORCE_MODELS)
        raise InvalidInput(
            f"no force model is called {described(name)}.",
            hint=f'"{guess}" (known: {known})' if guess else f"one of {known}",
        )
    return _BY_NAME[name]()


def unlimited(model: ForceModel) -> Unlimited:
    """Return the model that has the same cost and no limits."""
    if isinstance(model, FrictionCone):
        assert not isinstance(model.cost, str)
        return model.cost
    return MinimumNorm() if isinstance(model, SmallestLargestLoad) else model
