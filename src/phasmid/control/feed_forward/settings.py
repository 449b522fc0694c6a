"""Settings of the feed-forward: limits of the foot forces."""

from __future__ import annotations

from dataclasses import dataclass

from phasmid.errors import InvalidInput

_RANGES = {
    "friction": (0.0, 10.0),
    "friction_used": (0.01, 1.0),
    "torque_used": (0.01, 1.0),
    "load_transfer": (0.0, 10.0),
}


@dataclass(frozen=True)
class FeedForwardSettings:
    """Settings of the feed-forward: limits of the foot forces.

    Attributes:
        friction: Assumed coefficient of friction between foot and ground.
        friction_used: Part of it that the forces may use.
        torque_used: Part of the servos' torque that they may use.
        load_transfer: Time in which a foot takes on its load after touchdown, and gives it up
            before lift-off [s].

    Raises:
        InvalidInput: A number is out of range.
    """

    friction: float = 0.7
    friction_used: float = 0.8
    torque_used: float = 1.0
    load_transfer: float = 0.06

    def __post_init__(self) -> None:
        for name, (low, high) in _RANGES.items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise InvalidInput(f"{name} is {value:g}; it must be from {low:g} to {high:g}.")
