"""Gaits by name and number of legs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path

from phasmid.errors import InvalidGait, located, nearest
from phasmid.gait.file import is_gait_file, offsets_in_order, read_gait
from phasmid.gait.gait import FEWEST_FEET, Gait
from phasmid.robot.table import MOST_LEGS


def wave_gait(leg_count: int, in_air: int = 1, name: str | None = None) -> Gait:
    """Return a gait with a number of feet in the air at once, spread over the body.

    An even number of legs stands in two rows. On each side the legs lift from rear to front, and
    the sides are half a cycle apart. An odd number of legs stands around the body: the legs lift
    one after the other, those in the air together as far apart as possible.

    Args:
        leg_count: Number of legs, in order around the body.
        in_air: Number of feet in the air at any time.
        name: Of the gait; by default ``wave`` with one foot in the air, else ``ripple``.

    Raises:
        InvalidGait: Fewer than three feet would stand.
    """
    name = name or ("wave" if in_air == 1 else "ripple")
    if in_air < 1 or leg_count - in_air < FEWEST_FEET:
        raise InvalidGait(
            f'gait "{name}" with {in_air} of {leg_count} feet in the air leaves '
            f"{max(0, leg_count - in_air)} on the ground; at least {FEWEST_FEET} are needed."
        )
    places = _two_rows(leg_count) if leg_count % 2 == 0 else _around(leg_count, in_air)
    offsets = tuple(float(Fraction(place, leg_count)) for place in places)
    return Gait(name, float(Fraction(leg_count - in_air, leg_count)), offsets)


def _two_rows(count: int) -> list[int]:
    """Return the step at which each leg lifts: rear to front, the sides half a cycle apart."""
    side = count // 2
    right = [2 * (side - 1 - leg) for leg in range(side)]
    # An odd number of steps apart, so that no two legs lift at once.
    left = [(2 * leg + side + 1 - side % 2) for leg in range(side)]
    return [(place - right[0]) % count for place in right + left]


def _around(count: int, in_air: int) -> list[int]:
    """Return the step at which each leg lifts, feet in the air as far apart as possible."""

    def separation(stride: int) -> int:
        gaps = ((lag * stride) % count for lag in range(1, in_air))
        return min((min(gap, count - gap) for gap in gaps), default=0)

    # Legs are numbered clockwise from above: the other way around goes from rear to front.
    strides = [k for k in range(count - 1, 0, -1) if math.gcd(k, count) == 1]
    inverse = pow(max(strides, key=separation), -1, count)
    return [leg * inverse % count for leg in range(count)]


def alternating_gait(leg_count: int, name: str = "alternating") -> Gait:
    """Return the gait with every other leg in the air: the tripod of six legs.

    Args:
        leg_count: Even number of legs, in order around the body.
        name: Of the gait.

    Raises:
        InvalidGait: Fewer than three feet would stand, or the number is odd.
    """
    if leg_count % 2:
        raise InvalidGait(f"leg_count is {leg_count}; every other leg is half of an even number.")
    return Gait(name, 1 / 2, tuple(leg % 2 / 2 for leg in range(leg_count)))


def _by_name(*gaits: Gait) -> dict[str, Gait]:
    return {gait.name: gait for gait in gaits}


QUADRUPED_GAITS = _by_name(
    # Each side's rear foot, then its front foot, half a cycle apart: its own mirror image.
    Gait("crawl", 0.85, (0, 0.85, 0.35, 0.5), sway=0.1),
)
"""The gaits of a quadruped: right front, right rear, left rear, left front."""

HEXAPOD_GAITS = _by_name(
    Gait("tripod", 1 / 2, (0, 1 / 2, 0, 1 / 2, 0, 1 / 2)),
    Gait("wave", 5 / 6, (0, 5 / 6, 4 / 6, 1 / 6, 2 / 6, 3 / 6)),
    Gait("ripple", 2 / 3, (0, 2 / 6, 4 / 6, 1 / 6, 5 / 6, 3 / 6)),
    Gait("amble", 2 / 3, (0, 2 / 3, 1 / 3, 0, 2 / 3, 1 / 3)),
    # Pairs from rear to front on each side, the left side a third of a cycle ahead.
    Gait("tetrapod", 2 / 3, (0, 2 / 3, 1 / 3, 2 / 3, 0, 1 / 3)),
    wave_gait(6, 2, "metachronal"),
    # The gaits of the PhantomX's original firmware; docs/gaits.md has its tables.
    Gait("firmware-ripple", 2 / 3, (0, 4 / 6, 2 / 6, 5 / 6, 1 / 6, 3 / 6)),
    Gait("firmware-tripod", 1 / 2, (0, 1 / 2, 0, 1 / 2, 0, 1 / 2)),
    Gait("firmware-wave", 5 / 6, (0, 5 / 6, 4 / 6, 1 / 6, 2 / 6, 3 / 6)),
)
"""The gaits of a hexapod, legs in the paper's order; phases at which each leg lifts."""

OCTOPOD_GAITS = _by_name(
    Gait("tetrapod", 1 / 2, (0, 1 / 2, 0, 1 / 2, 0, 1 / 2, 0, 1 / 2)),
    Gait("wave", 7 / 8, (0, 7 / 8, 6 / 8, 5 / 8, 1 / 8, 2 / 8, 3 / 8, 4 / 8)),
    Gait("ripple", 3 / 4, (0, 2 / 8, 4 / 8, 6 / 8, 3 / 8, 1 / 8, 7 / 8, 5 / 8)),
    wave_gait(8, 2, "metachronal"),
)
"""The gaits of an octopod: right legs from front to rear, then left legs from rear to front."""

GAITS = {4: QUADRUPED_GAITS, 6: HEXAPOD_GAITS, 8: OCTOPOD_GAITS}
"""The library: gaits by number of legs and name; `gaits_of` makes them for other numbers."""


@cache
def gaits_of(leg_count: int) -> Mapping[str, Gait]:
    """Return the gaits for a number of legs by name, the simplest first; none below four legs."""
    if leg_count in GAITS or not FEWEST_FEET + 1 < leg_count <= MOST_LEGS:
        return GAITS.get(leg_count, {})
    made = [wave_gait(leg_count), wave_gait(leg_count, 2)]
    if leg_count % 2 == 0:
        made.insert(0, alternating_gait(leg_count))
    return {gait.name: gait for gait in made}


def default_gait(leg_count: int) -> Gait:
    """Return the gait of a robot where none is named: the first of `gaits_of`.

    Args:
        leg_count: Number of the robot's legs.

    Raises:
        InvalidGait: There is none for that number of legs.
    """
    for gait in gaits_of(leg_count).values():
        return gait
    raise InvalidGait(
        f"there is no gait for {leg_count} legs.", hint="a gait file with one offset per leg"
    )


GAIT_NAMES = (*(HEXAPOD_GAITS | QUADRUPED_GAITS | OCTOPOD_GAITS), "alternating")
"""Names of all gaits."""


def check_gait_name(name: str, leg_count: int) -> None:
    """Refuse a name that no gait has for any number of legs.

    Args:
        name: The name.
        leg_count: Number of the robot's legs, whose gaits are proposed.

    Raises:
        InvalidGait: There is no such gait; the hint is the nearest name.
    """
    if name not in GAIT_NAMES:
        raise InvalidGait(f'no gait called "{name}".', hint=_known_gaits(name, leg_count))


def _known_gaits(name: str, leg_count: int) -> str:
    """Return the gaits for a number of legs, the one with the nearest name first."""
    known = gaits_of(leg_count)
    if not known:
        return "a gait file with one offset per leg"
    guess = nearest(name, known) or next(iter(known))
    return f'"{guess}"' + (f" (known: {', '.join(known)})" if len(known) > 1 else "")


def load_gait(name: str | Path, leg_count: int = 6, leg_names: Sequence[str] = ()) -> Gait:
    """Return a gait of the library, or of a file.

    Args:
        name: Such as ``tripod``, or the path of a ``.toml`` file.
        leg_count: Number of the robot's legs.
        leg_names: Names of the legs in order, for a file with offsets by name.

    Raises:
        InvalidGait: There is no such gait for that number of legs.
        InvalidInput: The file is absent or not well formed.
    """
    if is_gait_file(name):
        return _gait_of_file(Path(name), leg_count, leg_names)
    name = str(name)
    known = gaits_of(leg_count)
    if name not in known:
        check_gait_name(name, leg_count)
        counts = [str(count) for count, gaits in GAITS.items() if name in gaits]
        raise InvalidGait(
            f'gait "{name}" has no meaning for {leg_count} legs; it is one of '
            f"{' or '.join(counts) or '10, 12 or more'} legs.",
            hint=_known_gaits(name, leg_count),
        )
    return known[name]


def _gait_of_file(path: Path, leg_count: int, leg_names: Sequence[str]) -> Gait:
    """Return the gait in a file, its offsets in the order of the robot's legs."""
    gait, legs = read_gait(path)
    with located(path.name):
        if legs and not leg_names:
            raise InvalidGait(
                "gait.offsets go by the names of legs; the robot's are not known here.",
                hint="leg_names=[leg.name for leg in robot.legs]",
            )
        if legs:
            by_leg = dict(zip(legs, gait.offsets, strict=True))
            gait = replace(gait, offsets=offsets_in_order(by_leg, leg_names))
        if leg_count != len(gait.offsets):
            raise InvalidGait(
                f"gait.offsets has {len(gait.offsets)} values; one per leg, {leg_count} in all."
            )
    return gait
