"""The order of lifting that holds a robot best."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from phasmid.arguments import check_number, check_type, numbers
from phasmid.errors import InvalidGait
from phasmid.gait.cycle import COMFORTABLE_STEP, foot_way, sample_count, timing
from phasmid.gait.gait import FEWEST_FEET, Gait
from phasmid.gait.support import support_margin

MOST_LEGS = 8
"""Above it there are too many orders to try them all."""

EQUAL_MARGIN = 1e-9
"""Margins that differ by less are one: then the first order in the legs' own order is taken [m]."""

SCOUTS = 40
"""Orders that are looked at first, to know what the others must beat."""

AT_ONCE = 2000
"""Polygons that are looked at in one go."""


class Ordered(NamedTuple):
    """A gait that was searched for.

    Attributes:
        gait: Which legs stand, when.
        margin: Its least support margin over a cycle [m].
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
) -> Ordered:
    """The order of lifting whose least support margin over a cycle is the largest.

    All orders are tried in which legs lift at evenly spaced instants; of those that hold the
    robot equally well the first in the legs' own order is taken, so that the answer is one.

    Args:
        neutral: Neutral feet in the body frame, x and y first [m], shape (L, 2) or (L, 3).
        centre_of_mass: In the body frame, x and y [m], shape (2,).
        duty_factor: Fraction of the cycle for which each foot stands; absent: the smallest with
            which no leg lifts before those of the instant before it stand.
        slots: Number of instants in a cycle at which legs lift, as many at each as can be;
            absent: one for each leg.
        step: The body's way while a foot stands: ahead, to the left [m], turn to the left [rad].
        sway: How far the body sways, as a gait has it.
        name: Of the gait.

    Raises:
        InvalidGait: No such gait holds a robot of so many legs, or there are too many orders.
    """
    feet = numbers(neutral, "neutral")[:, :2]
    count = len(feet)
    slots = count if slots is None else slots
    check_type("slots", slots, (int,), "a whole number", error=InvalidGait)
    if not FEWEST_FEET < count <= MOST_LEGS:
        raise InvalidGait(
            f"orders are searched for {FEWEST_FEET + 1} to {MOST_LEGS} legs; here are {count}.",
            hint="wave_gait, which goes around the body" if count > MOST_LEGS else "",
        )
    if not 2 <= slots <= count:
        raise InvalidGait(f"slots is {slots}; it must be at least 2 and at most {count}.")
    duty_factor = 1 - 1 / slots if duty_factor is None else duty_factor
    check_number("duty_factor", duty_factor, error=InvalidGait)
    # Its own check tells which duty factors and sways no gait can have.
    Gait(name, duty_factor, tuple(i * slots // count / slots for i in range(count)), sway)
    ahead, left, turn = numbers(step, "step").tolist()
    x, y = numbers(centre_of_mass, "centre_of_mass")[:2].tolist()
    places = tuple((float(p), float(q)) for p, q in feet)
    return _best(places, (x, y), float(duty_factor), slots, (ahead, left, turn), sway, name)


@lru_cache(maxsize=256)
def _best(
    places: tuple[tuple[float, float], ...],
    com: tuple[float, float],
    duty_factor: float,
    slots: int,
    step: tuple[float, float, float],
    sway: float,
    name: str,
) -> Ordered:
    orders = np.array(list(_orders(len(places), slots)), dtype=int)
    table = _table(np.array(places), np.array(com), duty_factor, slots, np.array(step), sway)
    bound = -np.inf
    if len(orders) > 2 * SCOUTS:
        bound = float(_margins(table, orders[:: len(orders) // SCOUTS]).max())
    margins = _margins(table, orders, bound)
    best = int(np.argmax(margins >= margins.max() - EQUAL_MARGIN))
    gait = Gait(name, duty_factor, tuple((orders[best] / slots).tolist()), sway)
    return Ordered(gait, float(margins[best]))


def _orders(count: int, slots: int) -> Iterator[tuple[int, ...]]:
    """Every way to give legs to instants, as evenly as can be, the first leg to the first instant.

    They come in the order of their numbers.
    """
    few, more = divmod(count, slots)

    def grown(
        given: tuple[int, ...], taken: tuple[int, ...], large: int
    ) -> Iterator[tuple[int, ...]]:
        if len(given) == count:
            yield given
            return
        for slot, legs in enumerate(taken):
            if legs < few or (legs == few and large < more):
                now = (*taken[:slot], legs + 1, *taken[slot + 1 :])
                yield from grown((*given, slot), now, large + (legs == few))

    yield from grown((0,), (1, *[0] * (slots - 1)), int(few == 0))


class _Table(NamedTuple):
    """What a leg does if it lifts at an instant, whatever the others do.

    Attributes:
        feet: Where it stands, without the body's sway [m], shape (N, slots, L, 2).
        stance: Whether it stands, shape (N, slots).
        way: What it adds to the centre of mass by its sway [m], shape (N, slots, L, 2).
        com: The centre of mass without that [m], shape (2,).
    """

    feet: Float[np.ndarray, "samples slots legs 2"]
    stance: Bool[np.ndarray, "samples slots"]
    way: Float[np.ndarray, "samples slots legs 2"] | None
    com: Float[np.ndarray, "2"]


def _table(
    neutral: Float[np.ndarray, "legs 2"],
    com: Float[np.ndarray, "2"],
    duty_factor: float,
    slots: int,
    step: Float[np.ndarray, "3"],
    sway: float,
) -> _Table:
    lifts = np.arange(slots) / slots
    told = timing(lifts, duty_factor, sample_count(step, sway))
    feet = foot_way(neutral, step, np.repeat(told.share[:, :, None], len(neutral), axis=2))
    if not sway:
        return _Table(feet, told.stance, None, com)
    arm = sway * (neutral.mean(axis=0) - neutral)
    wave = np.cos(2 * np.pi * (told.phase[:, None] - lifts - (1 - duty_factor) / 2))
    return _Table(feet, told.stance, wave[..., None, None] * arm, com)


def _margins(
    table: _Table, orders: Int[np.ndarray, "orders legs"], bound: float = -np.inf
) -> Float[np.ndarray, " orders"]:
    """Least support margin of each order [m]; of those below the bound, something below it."""
    margins = np.full(len(orders), np.inf)
    alive = np.arange(len(orders))
    legs = np.arange(orders.shape[1])
    samples = len(table.stance)
    done = 0
    while done < samples:
        # Many orders are thinned out after each sample, few are looked at over many at once.
        now = np.arange(done, min(samples, done + max(1, AT_ONCE // len(alive))))[:, None, None]
        own = orders[alive]
        com = np.broadcast_to(table.com, (len(now), len(alive), 2))
        if table.way is not None:
            com = com + table.way[now, own, legs].sum(axis=2)
        here = support_margin(table.feet[now, own, legs], table.stance[now, own], com)
        margins[alive] = np.minimum(margins[alive], here.min(axis=0))
        alive = alive[margins[alive] >= bound - EQUAL_MARGIN]
        done += len(now)
    return margins
