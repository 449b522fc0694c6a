"""The family of force models: what each one makes least."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from phasmid.arguments import described
from phasmid.errors import InvalidInput, nearest
from phasmid.forces.arguments import between

HEAVIEST = 1e6
"""Bounds of a tangential weight, and its inverse; beyond them round-off passes 1e-9 of the load."""

SHORTEST = 1e-5
"""Bound of a lever [m]; below it the same."""

MOST_NORMAL = 1e6
"""Bound of a least normal force [N]."""


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
        InvalidInput: The weight is not between 1e-6 and 1e6.
    """

    name: ClassVar[str] = "weighted-minimum-norm"
    tangential_weight: float = 10.0

    def __post_init__(self) -> None:
        between(self.tangential_weight, "tangential_weight", 1 / HEAVIEST, HEAVIEST)


@dataclass(frozen=True)
class MinimumTorque:
    """The least sum of squares of the joint torques.

    Attributes:
        lever: Where a leg is stretched or folded flat some force needs no torque at all; so each
            force also counts as if it had to be held at the end of this lever [m]. It moves the
            torques by about the square of its ratio to the links' lengths.

    Raises:
        InvalidInput: The lever is not between 1e-5 m and 1000 m.
    """

    name: ClassVar[str] = "minimum-torque"
    lever: float = 1e-3

    def __post_init__(self) -> None:
        between(self.lever, "lever", SHORTEST, 1e3, " m")


@dataclass(frozen=True)
class FrictionCone:
    """The cheapest forces that the ground can give and the joints can hold.

    No foot pulls, each force stays within the circular friction cone, and where torque limits are
    given each joint of a standing leg stays within its own.

    Attributes:
        cost: What is made least: a member that knows no limits, or its name; kept as the member.
        least_normal: Least normal force of a standing foot, times its share [N].

    Raises:
        InvalidInput: The cost is no such member, or the least normal force is not between 0 and
            1e6 N.
    """

    name: ClassVar[str] = "friction-cone"
    cost: MinimumNorm | WeightedMinimumNorm | MinimumTorque | str = MinimumNorm()
    least_normal: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "cost", without_limits(self.cost))
        between(self.least_normal, "least_normal", 0.0, MOST_NORMAL, " N")


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
        InvalidInput: The least normal force is not between 0 and 1e6 N, or the slack is not
            between 1e-5 and 1.
    """

    name: ClassVar[str] = "smallest-largest-load"
    least_normal: float = 0.0
    slack: float = 1e-5

    def __post_init__(self) -> None:
        between(self.least_normal, "least_normal", 0.0, MOST_NORMAL, " N")
        between(self.slack, "slack", 1e-5, 1.0)


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
    known = ", ".join(FORCE_MODELS)
    if not isinstance(name, str):
        raise InvalidInput(
            f"the force model is {described(name)}; it must be a member of the family or its name.",
            hint=_brackets(name) or f"one of {known}",
        )
    if name not in _BY_NAME:
        guess = nearest(name, FORCE_MODELS)
        raise InvalidInput(
            f'no force model is called "{name}".',
            hint=f'"{guess}" (known: {known})' if guess else f"one of {known}",
        )
    return _BY_NAME[name]()


def without_limits(cost: Unlimited | str) -> Unlimited:
    """A member that knows no limits, given as itself or by its name.

    Raises:
        InvalidInput: It is none.
    """
    member = _BY_NAME[cost]() if isinstance(cost, str) and cost in _BY_NAME else cost
    if isinstance(member, Unlimited):
        return member
    names = [kind.name for kind in _BY_NAME.values() if issubclass(kind, Unlimited)]
    raise InvalidInput(
        f"the cost is {described(cost)}; it must be a force model without limits of its own.",
        hint=_brackets(cost) or f"one of {', '.join(names)}",
    )


def _brackets(value: object) -> str:
    """What to write in place of a member's class."""
    members = isinstance(value, type) and value in _BY_NAME.values()
    return f"{value.__name__}()" if members and isinstance(value, type) else ""
