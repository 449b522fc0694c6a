"""Gaits by name and number of legs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

from phasmid.arguments import check_type
from phasmid.errors import InvalidGait, nearest
from phasmid.gait.file import gait_from_file, is_gait_file
from phasmid.gait.forms import alternating_gait, gait_of_steps, wave_gait
from phasmid.gait.gait import FEWEST_FEET, Gait
from phasmid.robot.table import MOST_LEGS

QUADRUPED_GAITS = {
    gait.name: gait
    for gait in (
        # One foot after the other around the body, which goes around ahead of them.
        Gait("crawl", 5 / 6, (0, 3 / 4, 2 / 4, 1 / 4), sway=0.08),
    )
}
"""The gaits of a quadruped: right front, right rear, left rear, left front."""

HEXAPOD_GAITS = {
    gait.name: gait
    for gait in (
        Gait("tripod", 1 / 2, (0, 1 / 2, 0, 1 / 2, 0, 1 / 2)),
        Gait("wave", 5 / 6, (0, 5 / 6, 4 / 6, 1 / 6, 2 / 6, 3 / 6)),
        Gait("ripple", 2 / 3, (0, 2 / 6, 4 / 6, 1 / 6, 5 / 6, 3 / 6)),
        Gait("amble", 2 / 3, (0, 2 / 3, 1 / 3, 0, 2 / 3, 1 / 3)),
        # Pairs from rear to front on each side, the left side a third of a cycle ahead.
        Gait("tetrapod", 2 / 3, (0, 2 / 3, 1 / 3, 2 / 3, 0, 1 / 3)),
        wave_gait(6, 2, "metachronal"),
        gait_of_steps("firmware-ripple", 12, 3, 8, (3, 11, 7, 1, 5, 9)),
        gait_of_steps("firmware-tripod", 8, 3, 4, (1, 5, 1, 5, 1, 5)),
        gait_of_steps("firmware-wave", 24, 3, 20, (21, 17, 13, 1, 5, 9)),
    )
}
"""The gaits of a hexapod, legs in the paper's order; phases at which each leg lifts."""

OCTOPOD_GAITS = {
    gait.name: gait
    for gait in (
        Gait("tetrapod", 1 / 2, (0, 1 / 2, 0, 1 / 2, 0, 1 / 2, 0, 1 / 2)),
        Gait("wave", 7 / 8, (0, 7 / 8, 6 / 8, 5 / 8, 1 / 8, 2 / 8, 3 / 8, 4 / 8)),
        Gait("ripple", 3 / 4, (0, 2 / 8, 4 / 8, 6 / 8, 3 / 8, 1 / 8, 7 / 8, 5 / 8)),
        wave_gait(8, 2, "metachronal"),
    )
}
"""The gaits of an octopod: right legs from front to rear, then left legs from rear to front."""

GAITS = {4: QUADRUPED_GAITS, 6: HEXAPOD_GAITS, 8: OCTOPOD_GAITS}
"""The library: gaits by number of legs and name; `gaits_of` makes them for other numbers."""

KNOWN = (*GAITS.values(), {"alternating": alternating_gait(10)})
"""Every name of a gait, of whatever number of legs."""

FEET_OF_FAST_GAITS = {"trot": 2, "pace": 2, "bound": 2, "gallop": 1, "hop": 0}
"""Gaits that keep their balance by speed, and on how few feet."""


@cache
def gaits_of(leg_count: int) -> Mapping[str, Gait]:
    """Gaits by name for a number of legs, the plainest first; none for fewer than four.

    Args:
        leg_count: Number of legs.
    """
    if leg_count in GAITS or not FEWEST_FEET + 1 < leg_count <= MOST_LEGS:
        return GAITS.get(leg_count, {})
    made = [wave_gait(leg_count), wave_gait(leg_count, 2)]
    if leg_count % 2 == 0:
        made.insert(0, alternating_gait(leg_count))
    return {gait.name: gait for gait in made}


def check_gait_name(name: str) -> None:
    """Refuse a name that no gait has, whatever the number of legs.

    Raises:
        InvalidGait: There is no such gait; with the nearest name.
    """
    check_type("gait", name, (str,), "the name of a gait", error=InvalidGait)
    if name in FEET_OF_FAST_GAITS or any(name in known for known in KNOWN):
        # Whether it has a meaning is told with the robot's number of legs.
        return
    load_gait(name, next((count for count in (6, 4, 8) if nearest(name, GAITS[count])), 6))


def load_gait(name: str | Path, leg_count: int = 6, leg_names: Sequence[str] = ()) -> Gait:
    """The gait of this name, or in this file.

    Args:
        name: Such as ``tripod``, or the path of a ``.toml`` file.
        leg_count: Number of legs of the robot that shall walk.
        leg_names: Names of its legs, in their order, for a file that goes by them.

    Raises:
        InvalidGait: There is no such gait for that number of legs, or it is no number.
        InvalidInput: The file is absent or not well formed.
    """
    check_type("gait", name, (str, Path), "the name of a gait, or a .toml file", error=InvalidGait)
    check_type("leg_count", leg_count, (int,), "a whole number", error=InvalidGait)
    if is_gait_file(name):
        return gait_from_file(Path(name), leg_count, leg_names)
    name = str(name)
    known = gaits_of(leg_count)
    if name in known:
        return known[name]
    listed = ", ".join(known)
    works = f"one of {listed}" if len(known) > 1 else f'gait = "{listed}"'
    if not known:
        works = "a gait table with duty_factor and one offset per leg"
    others = [count for count, gaits in GAITS.items() if name in gaits]
    if others or name == "alternating":
        raise InvalidGait(
            f'gait "{name}" has no meaning for {leg_count} legs; it is one of '
            f"{' or '.join(map(str, others)) or '10, 12 or more'} legs.",
            hint=works,
        )
    if name in FEET_OF_FAST_GAITS:
        raise InvalidGait(
            f'gait "{name}" leaves {FEET_OF_FAST_GAITS[name]} feet on the ground and keeps its '
            f"balance by speed; at least {FEWEST_FEET} are needed here.",
            hint=works,
        )
    guess = nearest(name, known)
    raise InvalidGait(
        f'no gait called "{name}".',
        hint=f'"{guess}" (known: {listed})' if guess else works,
    )
