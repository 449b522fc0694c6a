"""The family of force models: what each one makes least."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from phasmid.errors import InvalidInput, nearest


@dataclass(frozen=True)
class MinimumNorm:
    """The least sum of squares of the foot forces, the paper's model."""

    name: ClassVar[str] = "minimum-norm"


@dataclass(frozen=True)
class WeightedMinimumNorm:
    """The least sum of squares in which forces along the ground count more than those across it.

    Attributes:
        tangential_weight: Cost of a force along the ground, that of a normal one being 1; with 1
            it is the minimum norm.

    Raises:
        InvalidInput: The weight is not a finite number above 0.
    """

    name: ClassVar[str] = "weighted-minimum-norm"
    tangential_weight: float = 10.0

    def __post_init__(self) -> None:
        _above_zero(self.tangential_weight, "tangential_weight")


@dataclass(frozen=True)
class MinimumTorque:
    """The least sum of squares of the joint torques.

    Attributes:
        lever: Where a leg is stretched or folded flat some force needs no torque at all; so each
            force also counts as if it had to be held at the end of this lever [m]. It moves the
            torques by about the square of its ratio to the links' lengths.

    Raises:
        InvalidInput: The lever is not a finite number above 0.
    """

    name: ClassVar[str] = "minimum-torque"
    lever: float = 1e-3

    def __post_init__(self) -> None:
        _above_zero(self.lever, "lever")


@dataclass(frozen=True)
class FrictionCone:
    """The cheapest forces that the ground can give and the joints can hold.

    No foot pulls, each force stays within the circular friction cone, and where torque limits are
    given each joint of a standing leg stays within its own.

    Attributes:
        cost: What is made least.
        least_normal: Least normal force of a standing foot, times its share [N].

    Raises:
        InvalidInput: The least normal force is negative or not finite.
    """

    name: ClassVar[str] = "friction-cone"
    cost: MinimumNorm | WeightedMinimumNorm | MinimumTorque = MinimumNorm()
    least_normal: float = 0.0

    def __post_init__(self) -> None:
        _zero_or_more(self.least_normal, "least_normal")


@dataclass(frozen=True)
class SmallestLargestLoad:
    """The smallest largest normal force, within the limits of `FrictionCone`.

    What is made least is the largest ratio of normal force to share. Many forces may share that
    least; of those the ones of least norm are taken.

    Attributes:
        least_normal: Least normal force of a standing foot, times its share [N].
        slack: By this part the largest load may exceed its smallest, when the norm is made least.
            With none the least norm would be ill-conditioned wherever friction bounds the load.

    Raises:
        InvalidInput: The least normal force is negative or not finite, or the slack is not
            between 1e-6 and 1.
    """

    name: ClassVar[str] = "smallest-largest-load"
    least_normal: float = 0.0
    slack: float = 1e-5

    def __post_init__(self) -> None:
        _zero_or_more(self.least_normal, "least_normal")
        if not 1e-6 <= self.slack <= 1:
            raise InvalidInput(f"slack is {self.slack:g}; it must be 1e-6 or more and 1 or less.")


Unlimited = MinimumNorm | WeightedMinimumNorm | MinimumTorque
"""Members that only give the wrench and make a cost least."""

Limited = FrictionCone | SmallestLargestLoad
"""Members that know what the ground can give and the joints can hold."""

ForceModel = Unlimited | Limited

_BY_NAME: dict[str, type[ForceModel]] = {
    MinimumNorm.name: MinimumNorm,
    WeightedMinimumNorm.name: WeightedMinimumNorm,
    MinimumTorque.name: MinimumTorque,
    FrictionCone.name: FrictionCone,
    SmallestLargestLoad.name: SmallestLargestLoad,
}

FORCE_MODELS = tuple(_BY_NAME)
"""Names of the family."""


def force_model(name: str) -> ForceModel:
    """The member of this name, with its default options.

    Args:
        name: One of `FORCE_MODELS`.

    Raises:
        InvalidInput: There is none.
    """
    if name not in _BY_NAME:
        guess = nearest(name, FORCE_MODELS)
        known = ", ".join(FORCE_MODELS)
        raise InvalidInput(
            f'no force model is called "{name}".',
            hint=f'"{guess}" (known: {known})' if guess else f"one of {known}",
        )
    return _BY_NAME[name]()


def _above_zero(value: float, name: str) -> None:
    if not 0 < value < np.inf:
        raise InvalidInput(f"{name} is {value:g}; it must be a finite number greater than 0.")


def _zero_or_more(value: float, name: str) -> None:
    if not 0 <= value < np.inf:
        raise InvalidInput(f"{name} is {value:g} N; it must be a finite number, 0 or more.")
