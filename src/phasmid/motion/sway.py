"""Motion of the trunk with the sway of its gait."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from phasmid.gait import Sway
from phasmid.motion.trunk import TrunkMotion


def swayed(trunk: TrunkMotion, aside: Sway) -> TrunkMotion:
    """Return the motion of a level trunk with its sway.

    Args:
        trunk: The motion along the path, without pitch and roll.
        aside: The sway, in the body's axes.
    """
    yaw, turn, change = (
        values[:, 2, None]
        for values in (trunk.attitude, trunk.attitude_rate, trunk.attitude_acceleration)
    )
    p, v, a = aside
    # d/dt of R p is R (p' + w J p), with J a quarter turn to the left.
    speed = v + turn * _left(p)
    bend = a + 2 * turn * _left(v) + change * _left(p) - turn**2 * p

    def moved(old: np.ndarray, more: np.ndarray) -> np.ndarray:
        more = np.cos(yaw) * more + np.sin(yaw) * _left(more)
        return old + np.concatenate([more, np.zeros((len(more), 1))], axis=1)

    return replace(
        trunk,
        position=moved(trunk.position, p),
        velocity=moved(trunk.velocity, speed),
        acceleration=moved(trunk.acceleration, bend),
    )


def _left(v: Float[np.ndarray, "time 2"]) -> Float[np.ndarray, "time 2"]:
    return np.stack([-v[:, 1], v[:, 0]], axis=1)
