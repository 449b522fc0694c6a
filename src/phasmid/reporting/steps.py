"""Intervals of stance, and the samples away from lift-off and touchdown."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Bool, Float

from phasmid.robot.similarity import Scale

SETTLING = 0.080
"""Time around a switch of legs in which impacts dominate, for ``phantomx-ax`` [s]."""

SETTLING_LIFT = 0.030
"""Lift of the feet for which it was chosen [m]."""


def settling(scale: Scale, lift: float) -> float:
    """Return the time around a switch of legs in which impacts dominate [s], in steps of 10 ms.

    A foot touches the ground before its touchdown, by the depth to which the stance feet sink in.
    Near its touchdown its height is the lift times the cube of the time, so that the time of a lift
    that is low for the legs is longer by the cube root; lifts below a tenth count as one.

    Args:
        scale: Of the robot.
        lift: Height to which the feet lift [m].
    """
    similar = SETTLING_LIFT * scale.length
    low = max(similar / max(lift, similar / 10), 1.0)
    time = SETTLING * scale.time * math.cbrt(low)
    return max(math.floor(100 * time + 1e-9) / 100, 0.01)


def intervals(mask: Bool[np.ndarray, " time"]) -> list[tuple[int, int]]:
    """Return runs of true samples: the first sample of each, and the one after its last."""
    edges = np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8))
    starts, stops = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    return [(int(a), int(b)) for a, b in zip(starts, stops, strict=True)]


def away_from_switches(
    time: Float[np.ndarray, " time"],
    stance: Bool[np.ndarray, "time legs"],
    margin: float = SETTLING,
) -> Bool[np.ndarray, "time legs"]:
    """Return the samples of each leg at least a margin from its own lift-off and touchdown.

    The beginning counts as a switch, since all feet stand before it. So does the end: a switch just
    after the last sample is not recorded, but its foot may touch down before it.

    Args:
        time: Time of the samples [s].
        stance: Planned stance, shape (N, L).
        margin: Time around each of these [s].
    """
    away = np.ones(stance.shape, dtype=bool)
    for leg in range(stance.shape[1]):
        changed = np.flatnonzero(np.diff(stance[:, leg].astype(np.int8))) + 1
        moments = np.concatenate([[-np.inf], time[:1], time[changed], time[-1:], [np.inf]])
        following = np.searchsorted(moments, time)
        nearest = np.minimum(moments[following] - time, time - moments[following - 1])
        # Half a sample's round-off must not drop the sample that lies exactly at the limit.
        away[:, leg] = nearest >= margin - 1e-9
    return away


def middle_halves(stance: Bool[np.ndarray, "time legs"]) -> Bool[np.ndarray, "time legs"]:
    """Return the samples in the middle half of each whole stance of each leg.

    A stance that touches the first or the last sample is left out, as it may be cut short.
    """
    middle = np.zeros(stance.shape, dtype=bool)
    for leg in range(stance.shape[1]):
        for start, stop in intervals(stance[:, leg]):
            if start == 0 or stop == len(stance):
                continue
            quarter = (stop - start) // 4
            middle[start + quarter : stop - quarter, leg] = stop - start >= 4
    return middle


def durations(time: Float[np.ndarray, " time"]) -> Float[np.ndarray, " time"]:
    """Return the weight of each sample in means over time [s], by the trapezoidal rule."""
    weights = np.zeros(len(time))
    steps = np.diff(time) / 2
    weights[:-1] += steps
    weights[1:] += steps
    return weights if len(time) > 1 else np.ones(1)


def rms(values: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Return the root mean square over time where the mask holds; NaN where it never does.

    Args:
        values: Shape (N, ...).
        mask: Of the same shape.
    """
    count = mask.sum(axis=0)
    total = np.sum(np.where(mask, values, 0.0) ** 2, axis=0)
    return np.where(count > 0, np.sqrt(total / np.maximum(count, 1)), np.nan)
