"""Gaits by name."""

from __future__ import annotations

from phasmid.arguments import check_type
from phasmid.errors import InvalidGait, nearest
from phasmid.gait.gait import Gait

HEXAPOD_GAITS = {
    gait.name: gait
    for gait in (
        Gait("tripod", 1 / 2, (0, 1 / 2, 0, 1 / 2, 0, 1 / 2)),
        Gait("wave", 5 / 6, (0, 5 / 6, 4 / 6, 1 / 6, 2 / 6, 3 / 6)),
        Gait("ripple", 2 / 3, (0, 2 / 6, 4 / 6, 1 / 6, 5 / 6, 3 / 6)),
        Gait("amble", 2 / 3, (0, 2 / 3, 1 / 3, 0, 2 / 3, 1 / 3)),
    )
}
"""The gaits of a hexapod, legs in the paper's order; phases at which each leg lifts."""


def load_gait(name: str, leg_count: int = 6) -> Gait:
    """The gait of this name.

    Args:
        name: Such as ``tripod``.
        leg_count: Number of legs of the robot that shall walk.

    Raises:
        InvalidGait: There is no such gait for that number of legs.
    """
    check_type("gait", name, (str,), "the name of a gait", error=InvalidGait)
    known = HEXAPOD_GAITS if leg_count == 6 else {}
    if name in known:
        return known[name]
    if name in HEXAPOD_GAITS:
        raise InvalidGait(
            f'gait "{name}" is a hexapod\'s; the robot has {leg_count} legs.',
            hint="a gait table with duty_factor and one offset per leg",
        )
    guess = nearest(name, HEXAPOD_GAITS)
    listed = ", ".join(HEXAPOD_GAITS)
    raise InvalidGait(
        f'no gait called "{name}".',
        hint=f'"{guess}" (known: {listed})' if guess else f"one of {listed}",
    )
