"""Which gait, and how fast its cycle, for a speed that is asked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from phasmid.arguments import check_number
from phasmid.errors import InvalidInput

COMFORT = 0.8
"""Share of its largest speed up to which a gait is taken."""

HYSTERESIS = 0.2
"""By this share of its bound the speed must fall below it before the slower gait comes back."""

COMFORTABLE_STEP_SHARE = 0.6
"""Share of the longest step that a step should have: there is room left to turn and to stumble."""


class Pace(NamedTuple):
    """How a robot walks at a speed.

    Attributes:
        gait: Name of the gait.
        period: Time of a cycle [s].
    """

    gait: str
    period: float


def choose_gait(
    speed: float,
    largest: Mapping[str, float],
    present: str | None = None,
    *,
    comfort: float = COMFORT,
    hysteresis: float = HYSTERESIS,
) -> str:
    """The slowest gait that goes this speed with ease: waves for slow walks, tripods for fast.

    The slowest holds best, as it has the most feet down. A faster gait is taken where the
    speed is above a share of what the present one can; the slower one comes back only once the
    speed is well below that, so that a speed on the bound does not change the gait to and fro.

    Args:
        speed: That is asked, in any one direction and unit.
        largest: Largest speed in that direction of each gait, in the same unit, by its name.
        present: Name of the gait that the robot walks; None: it stands.
        comfort: Share of its largest speed up to which a gait is taken, in (0, 1].
        hysteresis: Share of that bound by which the speed must fall below it, in [0, 1).

    Returns:
        Name of the gait; the fastest where none goes so fast.

    Raises:
        InvalidInput: There are no gaits, or a number is out of range.
    """
    if not largest:
        raise InvalidInput("largest holds no gaits; it must hold one or more.")
    _check("speed", speed, 0.0, math.inf)
    _check("hysteresis", hysteresis, 0.0, 1.0)
    if not 0 < comfort <= 1:
        raise InvalidInput(f"comfort is {comfort:g}; it must be greater than 0 and 1 or less.")
    for name, most in largest.items():
        _check(f'largest["{name}"]', most, 0.0, math.inf)
    # Of equally fast gaits the first is kept, so that the answer is one.
    slowest_first = sorted(largest, key=largest.__getitem__)
    wanted = _first(slowest_first, largest, speed, comfort)
    if present is None or present not in largest:
        return wanted
    if largest[wanted] >= largest[present]:
        keeps = speed <= comfort * largest[present] or largest[wanted] == largest[present]
        return present if keeps else wanted
    # Down only where the speed fits below the bound with the hysteresis off it.
    down = _first(slowest_first, largest, speed, comfort * (1 - hysteresis))
    return down if largest[down] < largest[present] else present


def _first(names: list[str], largest: Mapping[str, float], speed: float, share: float) -> str:
    return next((name for name in names if speed <= share * largest[name]), names[-1])


def choose_period(
    speed: float,
    duty_factor: float,
    longest_step: float,
    *,
    shortest: float,
    longest: float,
    share: float = COMFORTABLE_STEP_SHARE,
) -> float:
    """Time of a cycle with which a step has a comfortable share of its longest [s].

    In the time for which a foot stands, duty factor times period, the body goes one step.

    Args:
        speed: Of the body [m/s], or its turn [rad/s].
        duty_factor: Fraction of the cycle for which each foot stands.
        longest_step: The longest way of the body while a foot stands [m], or turn [rad].
        shortest: Shortest cycle that the servos can do [s].
        longest: Longest cycle [s]; a robot that hardly moves steps so.
        share: Of the longest step.

    Raises:
        InvalidInput: A number is out of range.
    """
    _check("speed", speed, 0.0, math.inf)
    _check("longest_step", longest_step, 0.0, math.inf)
    _check("shortest", shortest, 0.0, math.inf)
    _check("longest", longest, shortest, math.inf)
    if not 0 < duty_factor < 1:
        raise InvalidInput(
            f"duty_factor is {duty_factor:g}; it must be greater than 0 and less than 1."
        )
    way = speed * duty_factor
    period = share * longest_step / way if way > 0 else longest
    return min(max(period, shortest), longest)


def choose_pace(
    speed: float,
    largest: Mapping[str, float],
    duty_factors: Mapping[str, float],
    longest_step: float,
    present: Pace | None = None,
    *,
    shortest: float,
    longest: float,
) -> Pace:
    """Gait and cadence for a speed, the one after the other.

    Args:
        speed: That is asked [m/s], or [rad/s] of a turn.
        largest: Largest speed of each gait at its shortest cycle, in the same unit, by its name.
        duty_factors: Of each gait, by its name.
        longest_step: The longest way of the body while a foot stands [m], or turn [rad].
        present: How the robot walks; None: it stands.
        shortest: Shortest cycle [s].
        longest: Longest cycle [s].

    Raises:
        InvalidInput: There are no gaits, or a number is out of range.
    """
    gait = choose_gait(speed, largest, present.gait if present else None)
    period = choose_period(
        speed, duty_factors[gait], longest_step, shortest=shortest, longest=longest
    )
    return Pace(gait, period)


def _check(name: str, value: float, least: float, most: float) -> None:
    check_number(name, value)
    if not (math.isfinite(value) and least <= value <= most):
        bound = f" and {most:g} or less" if math.isfinite(most) else ""
        raise InvalidInput(
            f"{name} is {value:g}; it must be a finite number, {least:g} or more{bound}."
        )
