"""Gait and cycle time for a commanded speed."""

from __future__ import annotations

import math
from collections.abc import Mapping

from phasmid.errors import InvalidInput

COMFORT = 0.8
"""Share of its largest speed up to which a gait is used."""

HYSTERESIS = 0.2
"""Share of that bound by which the speed must fall below it before a slower gait is used again."""

COMFORTABLE_STEP_SHARE = 0.6
"""Share of the longest step; the rest is for turning and for disturbances."""


def choose_gait(
    speed: float,
    largest: Mapping[str, float],
    present: str | None = None,
    *,
    comfort: float = COMFORT,
    hysteresis: float = HYSTERESIS,
) -> str:
    """Return the slowest gait that reaches a speed with ease.

    Slow gaits have the most feet on the ground. A hysteresis keeps a speed near a bound from
    changing the gait to and fro.

    Args:
        speed: Commanded speed in any one direction and unit.
        largest: Largest speed of each gait in that direction and unit, by name.
        present: Name of the present gait; None: the robot stands.
        comfort: Share of its largest speed up to which a gait is used, in (0, 1].
        hysteresis: Share of that bound by which the speed must fall below it, in [0, 1).

    Returns:
        Name of the gait; the fastest where none is fast enough.

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
    slowest_first = sorted(largest, key=largest.__getitem__)

    def slowest(share: float) -> str:
        enough = (name for name in slowest_first if speed <= share * largest[name])
        return next(enough, slowest_first[-1])

    wanted = slowest(comfort)
    if present is None or present not in largest:
        return wanted
    if largest[wanted] >= largest[present]:
        keeps = speed <= comfort * largest[present] or largest[wanted] == largest[present]
        return present if keeps else wanted
    slower = slowest(comfort * (1 - hysteresis))
    return slower if largest[slower] < largest[present] else present


def choose_period(
    speed: float,
    duty_factor: float,
    longest_step: float,
    *,
    shortest: float,
    longest: float,
    share: float = COMFORTABLE_STEP_SHARE,
) -> float:
    """Return the cycle time with which a step is a comfortable share of the longest one [s].

    The body moves by one step while a foot stands, which takes duty factor times cycle time.

    Args:
        speed: Of the body [m/s], or yaw rate [rad/s].
        duty_factor: Fraction of the cycle for which each foot stands.
        longest_step: Longest motion of the body while a foot stands [m], or turn [rad].
        shortest: Shortest cycle time of the servos [s].
        longest: Longest cycle time [s], used near standstill.
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
    motion = speed * duty_factor
    period = share * longest_step / motion if motion > 0 else longest
    return min(max(period, shortest), longest)


def _check(name: str, value: float, least: float, most: float) -> None:
    if not (math.isfinite(value) and least <= value <= most):
        bound = f" and {most:g} or less" if math.isfinite(most) else ""
        raise InvalidInput(
            f"{name} is {value:g}; it must be a finite number, {least:g} or more{bound}."
        )
