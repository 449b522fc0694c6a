"""Force models: the cost that each one minimises, and the limits that it keeps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, get_args

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, nearest
from phasmid.forces.contacts import Contacts, JointLoad


@dataclass(frozen=True)
class MinimumNorm:
    """Least sum of squares of the foot forces, the paper's model."""

    name: ClassVar[str] = "minimum-norm"


@dataclass(frozen=True)
class WeightedMinimumNorm:
    """Least sum of squares in which tangential forces have a weight.

    Attributes:
        tangential_weight: Cost of a tangential force relative to a normal one, 1e-6 to 1e6.
            Beyond these bounds the round-off exceeds 1e-9 of the load.
    """

    name: ClassVar[str] = "weighted-minimum-norm"
    tangential_weight: float = 10.0

    def __post_init__(self) -> None:
        _check(self.tangential_weight, "tangential_weight", 1e-6, 1e6)


@dataclass(frozen=True)
class MinimumTorque:
    """Least sum of squares of the joint torques.

    Attributes:
        lever: Length at whose end each force also counts as a torque [m], 1e-5 to 1000. A
            stretched or folded leg needs no torque for some force. The lever keeps the cost
            regular there, and changes torques by about the square of its ratio to the links'
            lengths.
    """

    name: ClassVar[str] = "minimum-torque"
    lever: float = 1e-3

    def __post_init__(self) -> None:
        _check(self.lever, "lever", 1e-5, 1e3)


@dataclass(frozen=True)
class FrictionCone:
    """Least cost within friction cones and torque limits.

    No foot pulls, each force is in its circular friction cone, and each joint of a standing leg is
    within its torque limit where there is one.

    Attributes:
        cost: A model without limits.
    """

    name: ClassVar[str] = "friction-cone"
    cost: MinimumNorm | WeightedMinimumNorm | MinimumTorque = MinimumNorm()


@dataclass(frozen=True)
class SmallestLargestLoad:
    """Smallest largest ratio of normal force to share, within the limits of `FrictionCone`.

    Among the forces with that ratio, those of least norm.
    """

    name: ClassVar[str] = "smallest-largest-load"


Limited = FrictionCone | SmallestLargestLoad
"""Models with friction and torque limits."""

ForceModel = MinimumNorm | WeightedMinimumNorm | MinimumTorque | Limited

_BY_NAME: dict[str, type[ForceModel]] = {model.name: model for model in get_args(ForceModel)}

FORCE_MODELS = tuple(_BY_NAME)
"""Names of the force models."""


def cost(
    model: ForceModel, contacts: Contacts, joints: JointLoad | None
) -> tuple[Float[np.ndarray, "*batch legs 3 3"], Float[np.ndarray, "*batch legs 3"]]:
    """Return H⁻¹ and c of each foot's cost ½ Fᵀ H F - cᵀ F, shapes (..., L, 3, 3), (..., L, 3).

    They follow from |F|²/2, (normal² + weight tangential²)/2 or (|τ - Jᵀ F|² + lever² |F|²)/2.

    Raises:
        InvalidInput: The model needs joints, and there are none.
    """
    if isinstance(model, FrictionCone):
        model = model.cost
    none = np.zeros(contacts.feet.shape)
    if isinstance(model, WeightedMinimumNorm):
        inverse, n = 1.0 / model.tangential_weight, contacts.normals
        return inverse * np.eye(3) + (1.0 - inverse) * n[..., :, None] * n[..., None, :], none
    if not isinstance(model, MinimumTorque):
        return np.broadcast_to(np.eye(3), (*none.shape, 3)), none
    if joints is None:
        raise InvalidInput(
            f"{model.name} needs the load of the joints.",
            hint="joints = JointLoad(jacobian, torque)",
        )
    J = joints.jacobian
    # By eigenvalues: the inverse stays positive for the shortest levers.
    sizes, axes = np.linalg.eigh(J @ np.swapaxes(J, -1, -2) + model.lever**2 * np.eye(3))
    H_inverse = (axes / sizes[..., None, :]) @ np.swapaxes(axes, -1, -2)
    return H_inverse, np.einsum("...ij,...j->...i", J, joints.torque)


def force_model(name: str) -> ForceModel:
    """Return the force model of a name, with its default options.

    Raises:
        InvalidInput: There is none; the hint is the nearest name.
    """
    if name not in _BY_NAME:
        known, guess = ", ".join(FORCE_MODELS), nearest(name, FORCE_MODELS)
        raise InvalidInput(
            f'no force model is called "{name}".',
            hint=f'"{guess}" (known: {known})' if guess else f"one of {known}",
        )
    return _BY_NAME[name]()


def _check(value: float, name: str, low: float, high: float) -> None:
    if not low <= value <= high:
        raise InvalidInput(f"{name} is {value:g}; it must be between {low:g} and {high:g}.")
