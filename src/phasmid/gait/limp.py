"""Gaits without lost legs."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int

from phasmid.errors import InvalidGait
from phasmid.gait.cycle import COMFORTABLE_STEP, least_margin, one_cycle
from phasmid.gait.gait import FEWEST_FEET, Gait
from phasmid.gait.search import MOST_LEGS, best_order
from phasmid.gait.shift import best_place
from phasmid.gait.support import shortfall

ENOUGH, SWAYING = 0.1, 0.07
"""Sufficient margin, as a share of the mean distance of the feet from their centroid; with sway,
which takes reach."""

FARTHEST = 0.16
"""Largest shift of the body, as a share of the same distance: the legs must still reach."""

SWAYS = tuple(0.02 * k for k in range(11))
"""Sways to try until the margin is sufficient."""

CRAWL = 5 / 6
"""Duty factor of four legs: the body sways while all feet stand."""

HALVINGS = 12
"""Bisections of the smallest shift."""

TURNS = 4
"""Iterations between order and shift; they rarely change after the second."""


@dataclass(frozen=True)
class Limp:
    """Gait of the remaining legs, and the shift of the body over them.

    Attributes:
        gait: Gait of the remaining legs, in their order.
        legs: Their numbers, from 1.
        shift: Displacement of the body from its place over all legs: forward, left [m].
        margin: Least support margin over a cycle [m].
    """

    gait: Gait
    legs: tuple[int, ...]
    shift: tuple[float, float]
    margin: float

    @property
    def indices(self) -> Int[np.ndarray, " remaining"]:
        """Indices of the legs in arrays of all legs, shape (R,)."""
        return np.array(self.legs) - 1


def without_legs(
    gait: Gait,
    lost: Collection[int],
    neutral: Float[np.ndarray, "legs axes"],
    centre_of_mass: Float[np.ndarray, "2"] | tuple[float, float] = (0.0, 0.0),
    *,
    step: Float[np.ndarray, "3"] | tuple[float, float, float] = COMFORTABLE_STEP,
    nearest: bool = False,
) -> Limp:
    """Return a gait without lost legs.

    The remaining legs keep their offsets where a shift of the body gives a sufficient margin.
    Otherwise they lift one by one, in the order and with the shift of the largest margin. The body
    sways where that is not sufficient.

    Args:
        gait: Gait of all legs.
        lost: Numbers of the lost legs, from 1.
        neutral: Neutral feet of all legs in the body frame, x and y first [m], shape (L, 2) or
            (L, 3).
        centre_of_mass: In the body frame, with the lost legs in their poses, x and y [m].
        step: Motion of the body while a foot stands: forward, left [m], yaw [rad].
        nearest: Use the smallest shift with a sufficient margin, so that legs reach farther;
            otherwise the shift with the largest margin.

    Raises:
        InvalidGait: Too few legs remain, or no order, shift and sway has a positive margin.
    """
    feet = np.asarray(neutral, dtype=float)[:, :2]
    count = len(feet)
    if len(gait.offsets) != count:
        raise InvalidGait(
            f"gait.offsets has {len(gait.offsets)} values; one per leg, {count} in all."
        )
    for leg in lost:
        if leg not in range(1, count + 1):
            raise InvalidGait(f"leg {leg} is lost; there are legs 1 to {count}.")
    legs = tuple(leg for leg in range(1, count + 1) if leg not in lost)
    if len(legs) <= FEWEST_FEET:
        raise InvalidGait(
            f"{len(legs)} of {count} legs remain; at least {FEWEST_FEET + 1} are needed to walk, "
            f"so that {FEWEST_FEET} stand while one steps."
        )
    com, way = tuple(map(float, centre_of_mass[:2])), tuple(map(float, step))
    limp = _limp(gait, legs, tuple(map(tuple, feet.tolist())), com, way, nearest)
    if limp.margin <= 0:
        names = ", ".join(map(str, sorted(lost)))
        raise InvalidGait(
            f"without leg{'s' if ',' in names else ''} {names} the others do not hold the robot: "
            f"{shortfall(limp.margin)}.",
            hint="feet that stand closer to where the legs are missing",
        )
    return limp


@lru_cache(maxsize=256)
def _limp(
    gait: Gait,
    legs: tuple[int, ...],
    places: tuple[tuple[float, ...], ...],
    com: tuple[float, ...],
    step: tuple[float, ...],
    nearest: bool,
) -> Limp:
    """Return the best limp, cached: each new command asks for it again, also where it falls."""
    lost = ", ".join(str(leg) for leg in range(1, len(places) + 1) if leg not in legs)
    name = f"{gait.name} without {lost}" if lost else gait.name
    feet = np.array(places)
    size = float(np.linalg.norm(feet - feet.mean(axis=0), axis=1).mean())
    rest = _Remaining(
        name, legs, feet[np.array(legs) - 1], np.array(com), np.array(step), FARTHEST * size
    )
    best = rest.kept(gait)
    for share in SWAYS:
        if best is not None and best.margin >= (SWAYING if best.gait.sway else ENOUGH) * size:
            break
        found = rest.searched(share)
        if best is None or found.margin > best.margin:
            best = found
    assert best is not None
    return rest.nearer(best, ENOUGH * size) if nearest and best.margin > ENOUGH * size else best


@dataclass(frozen=True, eq=False)
class _Remaining:
    """Remaining legs, R in number, and the motion of the body over them.

    Attributes:
        name: Name of their gaits.
        legs: Their numbers, from 1.
        feet: Their neutral feet [m], shape (R, 2).
        com: Centre of mass [m], shape (2,).
        step: Motion of the body while a foot stands, shape (3,).
        farthest: Largest shift of the body in either axis [m].
    """

    name: str
    legs: tuple[int, ...]
    feet: Float[np.ndarray, "remaining 2"]
    com: Float[np.ndarray, "2"]
    step: Float[np.ndarray, "3"]
    farthest: float

    def kept(self, gait: Gait) -> Limp | None:
        """Return the gait with unchanged offsets; None where fewer than three feet stand."""
        offsets = tuple(gait.offsets[leg - 1] for leg in self.legs)
        try:
            return self._shifted(replace(gait, name=self.name, offsets=offsets))
        except InvalidGait:
            return None

    def searched(self, share: float) -> Limp:
        """Return the best gait in which legs lift one by one, with its shift."""
        feet, count = self.feet, len(self.legs)
        duty = CRAWL if count == FEWEST_FEET + 1 else 1 - 1 / count
        around = np.arctan2(*(feet - feet.mean(axis=0)).T).argsort(kind="stable").argsort()
        best = self._shifted(Gait(self.name, duty, tuple((around / count).tolist()), share))
        if count > MOST_LEGS:
            return best
        for _ in range(TURNS):
            gait, _ = best_order(
                feet,
                self.com + best.shift,
                duty_factor=duty,
                step=self.step,
                sway=share,
                name=self.name,
            )
            found = self._shifted(gait)
            if found.margin <= best.margin:
                break
            best = found
        return best

    def nearer(self, limp: Limp, enough: float) -> Limp:
        """Return the same gait with the smallest sufficient shift."""
        # Polygons are convex: the margin grows monotonically towards the best place.
        low, high = 0.0, 1.0
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            is_enough = self._limp(limp.gait, middle * np.array(limp.shift)).margin >= enough
            low, high = (low, middle) if is_enough else (middle, high)
        return self._limp(limp.gait, high * np.array(limp.shift))

    def _shifted(self, gait: Gait) -> Limp:
        """Return a gait with the best shift of the body."""
        cycle = one_cycle(gait, self.feet, self.com, self.step)
        return self._limp(gait, best_place(*cycle, self.farthest))

    def _limp(self, gait: Gait, shift: Float[np.ndarray, "2"]) -> Limp:
        x, y = shift.tolist()
        margin = least_margin(gait, self.feet, self.com + shift, self.step)
        return Limp(gait, self.legs, (x, y), margin)
