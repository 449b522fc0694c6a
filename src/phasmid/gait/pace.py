"""Gait and cycle time for a commanded speed."""

from __future__ import annotations

from collections.abc import Mapping

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
) -> str:
    """Return the slowest gait that reaches a speed with ease.

    Slow gaits have the most feet on the ground. A hysteresis keeps a speed near a bound from
    changing the gait to and fro.

    Args:
        speed: Commanded speed in any one direction and unit.
        largest: Largest speed of each gait in that direction and unit, by name.
        present: Name of the present gait; None: the robot stands.

    Returns:
        Name of the gait; the fastest where none is fast enough.
    """
    slowest_first = sorted(largest, key=largest.__getitem__)

    def slowest(share: float) -> str:
        enough = (name for name in slowest_first if speed <= share * largest[name])
        return next(enough, slowest_first[-1])

    wanted = slowest(COMFORT)
    if present is None or present not in largest:
        return wanted
    if largest[wanted] >= largest[present]:
        keeps = speed <= COMFORT * largest[present] or largest[wanted] == largest[present]
        return present if keeps else wanted
    slower = slowest(COMFORT * (1 - HYSTERESIS))
    return slower if largest[slower] < largest[present] else present


def choose_period(
    speed: float,
    duty_factor: float,
    longest_step: float,
    *,
    shortest: float,
    longest: float,
) -> float:
    """Return the cycle time with which a step is a comfortable share of the longest one [s].

    The body moves by one step while a foot stands, which takes duty factor times cycle time.

    Args:
        speed: Of the body [m/s], or yaw rate [rad/s].
        duty_factor: Fraction of the cycle for which each foot stands.
        longest_step: Longest motion of the body while a foot stands [m], or turn [rad].
        shortest: Shortest cycle time of the servos [s].
        longest: Longest cycle time [s], used near standstill.
    """
    motion = speed * duty_factor
    period = COMFORTABLE_STEP_SHARE * longest_step / motion if motion > 0 else longest
    return min(max(period, shortest), longest)
