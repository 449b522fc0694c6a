"""Estimation of contact, ground, attitude and body motion from the robot's sensors."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from phasmid.control.estimation.settings import EstimatorSettings

if TYPE_CHECKING:
    from phasmid.control.estimation.body_state import (
        BodyState,
        BodyStateEstimator,
        BodyStateSettings,
    )

__all__ = ["BodyState", "BodyStateEstimator", "BodyStateSettings", "EstimatorSettings"]


def __getattr__(name: str) -> Any:
    # Lazy import: the engine's settings import this package, and compiled functions take a while.
    if name in __all__:
        return getattr(import_module(f"{__name__}.body_state"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*globals(), *__all__]
