"""How the body sways away from lifted feet, so that those that stand hold it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from phasmid.gait import Gait
from phasmid.motion.curves import Path
from phasmid.motion.trunk import TrunkMotion


def sway(
    gait: Gait,
    neutral: Float[np.ndarray, "legs axes"],
    period: float,
    time: Float[np.ndarray, " time"],
) -> Path:
    """The body's way aside from its path, ahead and to the left.

    Each foot drives it away from itself by a share of its distance from the feet's middle, most
    when its swing is half over and as much towards itself half a cycle later: one smooth wave per
    cycle and leg, so that a sway never jerks.

    Args:
        gait: Its sway is that share; it tells when feet swing.
        neutral: Neutral feet in the body frame, x and y first [m], shape (L, 2) or (L, 3).
        period: Time of a cycle [s].
        time: Times [s], shape (N,).

    Returns:
        Way, speed and acceleration [m, s], shape (N, 2).
    """
    arm = gait.sway * (neutral[:, :2].mean(axis=0) - neutral[:, :2])
    middle = np.asarray(gait.offsets) + gait.swing_fraction / 2
    angle = 2 * np.pi * (np.asarray(time, dtype=float)[:, None] / period - middle)
    rate = 2 * np.pi / period
    c, s = np.cos(angle) @ arm, np.sin(angle) @ arm
    return Path(c, -rate * s, -(rate**2) * c)


def swayed(trunk: TrunkMotion, aside: Path) -> TrunkMotion:
    """A level trunk's motion that sways about its path.

    Args:
        trunk: The motion along the path, without pitch and roll.
        aside: The way aside in the body's axes, shape (N, 2).
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
