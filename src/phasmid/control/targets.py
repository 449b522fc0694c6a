"""Joint targets of a controller."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True, slots=True, eq=False)
class JointTargets:
    """Joint targets until the next update.

    Attributes:
        position: Angles [rad], shape (L, 3).
        velocity: Speeds [rad/s], shape (L, 3).
        torque: Feed-forward torque [N·m], shape (L, 3); None for none.
    """

    position: Float[np.ndarray, "legs 3"]
    velocity: Float[np.ndarray, "legs 3"]
    torque: Float[np.ndarray, "legs 3"] | None = None
