"""Settings of the feed-forward: cost of the foot forces, and limits."""

from __future__ import annotations

from dataclasses import dataclass

from phasmid.errors import InvalidInput
from phasmid.forces import MinimumNorm, MinimumTorque, WeightedMinimumNorm, force_model

MINIMUM_NORM, WEIGHTED, MINIMUM_TORQUE = 0, 1, 2
"""Costs: squares of forces, the same with tangential ones weighted, or squares of torques."""


@dataclass(frozen=True)
class FeedForwardSettings:
    """Settings of the feed-forward: cost of the foot forces, and limits.

    Attributes:
        force_model: Name of a force model without limits, by which the stance feet share the load.
        tangential_weight: Of ``weighted-minimum-norm``.
        friction: Assumed coefficient of friction between foot and ground.
        friction_used: Part of it that the forces may use.
        torque_used: Part of the servos' torque that they may use.
        load_transfer: Time in which a foot takes on its load after touchdown, and gives it up
            before lift-off [s].

    Raises:
        InvalidInput: A number is out of range, or there is no such model.
    """

    force_model: str = "minimum-norm"
    tangential_weight: float = 10.0
    friction: float = 0.7
    friction_used: float = 0.8
    torque_used: float = 1.0
    load_transfer: float = 0.06

    def __post_init__(self) -> None:
        ranges = {
            "friction": (0.0, 10.0),
            "friction_used": (0.01, 1.0),
            "torque_used": (0.01, 1.0),
            "load_transfer": (0.0, 10.0),
        }
        for name, (low, high) in ranges.items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise InvalidInput(f"{name} is {value:g}; it must be from {low:g} to {high:g}.")
        self.cost()

    def cost(self) -> tuple[int, float]:
        """Return the cost and its option.

        Raises:
            InvalidInput: There is no such force model without limits.
        """
        model = force_model(self.force_model)
        if isinstance(model, MinimumNorm):
            return MINIMUM_NORM, 1.0
        if isinstance(model, WeightedMinimumNorm):
            return WEIGHTED, WeightedMinimumNorm(self.tangential_weight).tangential_weight
        if isinstance(model, MinimumTorque):
            return MINIMUM_TORQUE, model.lever
        raise InvalidInput(
            f'force_model is "{self.force_model}"; it must be one without limits of its own: '
            "friction and torque limits are kept with each of them.",
            hint='"minimum-norm", "weighted-minimum-norm" or "minimum-torque"',
        )
