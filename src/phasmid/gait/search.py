"""Search of the lifting order with the largest support margin."""

from __future__ import annotations

from collections.abc import Iterator
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

AT_ONCE = 500
"""Orders whose samples are held in memory at once."""


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
    slots: int | None = None,
    step: Float[np.ndarray, "3"] | tuple[float, float, float] = COMFORTABLE_STEP,
    sway: float = 0.0,
    name: str = "searched",
) -> SearchedGait:
    """Return the lifting order with the largest least support margin of a cycle.

    All orders are tried in which legs lift at evenly spaced instants. Of orders with equal margins
    the first in the order of the legs is returned.

    Args:
        neutral: Neutral feet in the body frame, x and y first [m], shape (L, 2) or (L, 3).
        centre_of_mass: In the body frame, x and y [m], shape (2,).
        duty_factor: Fraction of the cycle for which each foot stands; absent: the smallest with
            which the legs of one instant land before those of the next lift.
        slots: Number of instants in a cycle at which legs lift, as evenly as possible; absent: one
            for each leg.
        step: Motion of the body while a foot stands: forward, left [m], yaw [rad].
        sway: Sway of the body, as `Gait` has it.
        name: Name of the gait.

    Raises:
        InvalidGait: No such gait stands on three feet, or there are too many orders.
    """
    feet = np.asarray(neutral, dtype=float)[:, :2]
    count = len(feet)
    slots = count if slots is None else slots
    if not FEWEST_FEET < count <= MOST_LEGS:
        raise InvalidGait(
            f"orders are searched for {FEWEST_FEET + 1} to {MOST_LEGS} legs; here are {count}.",
            hint="wave_gait, which goes around the body" if count > MOST_LEGS else "",
        )
    if not 2 <= slots <= count:
        raise InvalidGait(f"slots is {slots}; it must be at least 2 and at most {count}.")
    duty_factor = 1 - 1 / slots if duty_factor is None else duty_factor
    # The constructor refuses duty factors and sways that no gait can have.
    Gait(name, duty_factor, tuple(i * slots // count / slots for i in range(count)), sway)
    com, way = np.asarray(centre_of_mass, dtype=float)[:2], np.asarray(step, dtype=float)
    legs = np.arange(count)
    lifts = np.arange(slots) / slots
    cycle = timing(lifts, duty_factor, sample_count(way, sway))
    # Place, stance and share of the sway of each leg if it lifts at each instant.
    at = foot_way(feet, way, np.repeat(cycle.share[:, :, None], count, axis=2))
    wave = np.cos(2 * np.pi * (cycle.phase[:, None] - lifts - (1 - duty_factor) / 2))
    arm = sway * (feet.mean(axis=0) - feet)
    orders = np.array(list(_orders(count, slots)), dtype=int)
    margins = np.empty(len(orders))
    for first in range(0, len(orders), AT_ONCE):
        some = orders[first : first + AT_ONCE]
        body = com + wave[:, some] @ arm
        margin = support_margin(at[:, some, legs], cycle.stance[:, some], body)
        margins[first : first + AT_ONCE] = margin.min(axis=0)
    best = int(np.argmax(margins >= margins.max() - EQUAL_MARGIN))
    gait = Gait(name, duty_factor, tuple((orders[best] / slots).tolist()), sway)
    return SearchedGait(gait, float(margins[best]))


def _orders(count: int, slots: int) -> Iterator[tuple[int, ...]]:
    """Yield the slots of the legs, as evenly as possible, the first leg in the first slot."""
    few, more = divmod(count, slots)

    def extend(
        given: tuple[int, ...], taken: tuple[int, ...], large: int
    ) -> Iterator[tuple[int, ...]]:
        if len(given) == count:
            yield given
            return
        for slot, legs in enumerate(taken):
            if legs < few or (legs == few and large < more):
                now = (*taken[:slot], legs + 1, *taken[slot + 1 :])
                yield from extend((*given, slot), now, large + (legs == few))

    yield from extend((0,), (1, *[0] * (slots - 1)), int(few == 0))
