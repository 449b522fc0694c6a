"""Search of the lifting order with the largest support margin."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidGait
from phasmid.gait.cycle import COMFORTABLE_STEP, foot_way, sample_count, timing
from phasmid.gait.gait import FEWEST_FEET, Gait
from phasmid.gait.support import support_margin

MOST_LEGS = 8
"""Largest number of legs; above it there are too many orders to try them all."""

EQUAL_MARGIN = 1e-9
"""Margins that differ by less count as equal [m]."""


class SearchedGait(NamedTuple):
    """A gait that was searched.

    Attributes:
        gait: The gait.
        margin: Least support margin of a cycle [m].
    """

    gait: Gait
    margin: float


def best_order(
    neutral: Float[np.ndarray, "legs axes"],
    centre_of_mass: Float[np.ndarray, "2"] | tuple[float, float] = (0.0, 0.0),
    *,
    duty_factor: float | None = None,
    step: Float[np.ndarray, "3"] | tuple[float, float, float] = COMFORTABLE_STEP,
    sway: float = 0.0,
    name: str = "searched",
) -> SearchedGait:
    """Return the lifting order with the largest least support margin of a cycle.

    All orders are tried in which legs lift one by one at evenly spaced instants. Of orders with
    equal margins the first in the order of the legs is returned.

    Args:
        neutral: Neutral feet in the body frame, x and y first [m], shape (L, 2) or (L, 3).
        centre_of_mass: In the body frame, x and y [m], shape (2,).
        duty_factor: Fraction of the cycle for which each foot stands; absent: the smallest with
            which each leg lands before the next one lifts.
        step: Motion of the body while a foot stands: forward, left [m], yaw [rad].
        sway: Sway of the body, as `Gait` has it.
        name: Name of the gait.

    Raises:
        InvalidGait: No such gait stands on three feet, or there are too many orders.
    """
    feet = np.asarray(neutral, dtype=float)[:, :2]
    count = len(feet)
    if not FEWEST_FEET < count <= MOST_LEGS:
        raise InvalidGait(
            f"orders are searched for {FEWEST_FEET + 1} to {MOST_LEGS} legs; here are {count}.",
            hint="wave_gait, which goes around the body" if count > MOST_LEGS else "",
        )
    duty_factor = 1 - 1 / count if duty_factor is None else duty_factor
    legs, lifts = np.arange(count), np.arange(count) / count
    # The constructor refuses duty factors and sways that no gait can have.
    gait = Gait(name, duty_factor, tuple(lifts.tolist()), sway)
    com, way = np.asarray(centre_of_mass, dtype=float)[:2], np.asarray(step, dtype=float)
    cycle = timing(gait, sample_count(gait, way))
    # Place, stance and share of the sway of each leg if it lifts at each instant.
    at = foot_way(feet, way, np.repeat(cycle.share[:, :, None], count, axis=2))
    wave = np.cos(2 * np.pi * (cycle.phase[:, None] - lifts - (1 - duty_factor) / 2))
    arm = sway * (feet.mean(axis=0) - feet)
    orders = np.array([(0, *order) for order in permutations(range(1, count))])
    body = com + wave[:, orders] @ arm
    margins = support_margin(at[:, orders, legs], cycle.stance[:, orders], body).min(axis=0)
    best = int(np.argmax(margins >= margins.max() - EQUAL_MARGIN))
    gait = replace(gait, offsets=tuple((orders[best] / count).tolist()))
    return SearchedGait(gait, float(margins[best]))
