"""Sway of the body away from swinging feet."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.gait.gait import Gait


class Sway(NamedTuple):
    """Displacement of the body from its path, forward and left.

    Attributes:
        way: Displacement [m], shape (N, 2).
        speed: Its first derivative by time [m/s], shape (N, 2).
        acceleration: Its second derivative by time [m/s²], shape (N, 2).
    """

    way: Float[np.ndarray, "time 2"]
    speed: Float[np.ndarray, "time 2"]
    acceleration: Float[np.ndarray, "time 2"]


def sway(
    gait: Gait,
    neutral: Float[np.ndarray, "legs axes"],
    period: float,
    time: Float[np.ndarray, " time"],
) -> Sway:
    """Return the sway of the body in a gait.

    Each foot adds a cosine of one cycle: away from the foot at mid-swing, by a share of its
    distance from the centroid of all feet, and towards it half a cycle later.

    Args:
        gait: The gait; its sway is that share.
        neutral: Neutral feet in the body frame, x and y first [m], shape (L, 2) or (L, 3).
        period: Time of a cycle [s].
        time: Times [s], shape (N,).
    """
    neutral = np.asarray(neutral, dtype=float)
    arm = gait.sway * (neutral[:, :2].mean(axis=0) - neutral[:, :2])
    middle = np.asarray(gait.offsets) + gait.swing_fraction / 2
    angle = 2 * np.pi * (np.asarray(time, dtype=float)[:, None] / period - middle)
    rate = 2 * np.pi / period
    # Summed in one order whatever the shapes, so that single samples are the same bits.
    c, s = (
        np.stack([sum((wave[:, i] * p[k] for i, p in enumerate(arm)), 0.0) for k in (0, 1)], -1)
        for wave in (np.cos(angle), np.sin(angle))
    )
    return Sway(c, -rate * s, -(rate**2) * c)
