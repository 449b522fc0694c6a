"""Gaits as other programs write them, and gaits for any number of legs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

from phasmid.arguments import check_type
from phasmid.errors import InvalidGait
from phasmid.gait.gait import FEWEST_FEET, Gait


def gait_of_phases(
    name: str, stance: int, swing: int, offset: int, multipliers: Sequence[int], sway: float = 0.0
) -> Gait:
    """A gait as a table of phases: stance, swing and offset, and a multiplier of each leg.

    The cycle has stance and swing as its parts. A leg is ahead of the cycle by its multiplier times
    the offset: that much earlier it lifts. What is often read as the order of lifting is the
    order reversed.

    Args:
        name: Of the gait.
        stance: Parts of the cycle in which a foot stands.
        swing: Parts of the cycle in which it is in the air.
        offset: Parts of the cycle that a multiplier counts.
        multipliers: Of each leg, in the legs' order.
        sway: As a gait has it.

    Raises:
        InvalidGait: There is no such gait.

    Source: The form of OpenSHC's gait parameters.
    """
    _check_positive("stance", stance)
    _check_positive("swing", swing)
    period = stance + swing
    ahead = [Fraction(multiplier * offset, period) for multiplier in multipliers]
    lifts = (_part(ahead[0] - own) for own in ahead)
    return Gait(name, float(Fraction(stance, period)), tuple(lifts), sway)


def gait_of_steps(
    name: str, steps: int, lifted: int, divisor: int, starts: Sequence[int], sway: float = 0.0
) -> Gait:
    """A gait as a table of steps: of the cycle, lifted, pushing, and where each leg starts.

    Of a cycle a foot pushes for as many steps as the stroke is divided by. From the last place on
    the ground it goes over the lifted places and back to the ground, which is one step more than
    there are lifted places. It lifts two steps before its start step, with three lifted
    places; and as all legs do, only the difference of their starts counts.

    Args:
        name: Of the gait.
        steps: Of the cycle.
        lifted: Places above the ground; the foot is in the air for one step more.
        divisor: Steps in which the foot pushes, each by this part of the stroke.
        starts: Start step of each leg, in the legs' order.
        sway: As a gait has it.

    Raises:
        InvalidGait: The steps do not add up, or there is no such gait.

    Source: The form of the PhantomX's original firmware.
    """
    _check_positive("steps", steps)
    _check_positive("lifted", lifted)
    _check_positive("divisor", divisor)
    if divisor + lifted + 1 != steps:
        raise InvalidGait(
            f"gait.steps is {steps}; it must be divisor + lifted + 1, {divisor + lifted + 1}.",
            hint="steps = 12, lifted = 3, divisor = 8",
        )
    lifts = (_part(Fraction(start - starts[0], steps)) for start in starts)
    return Gait(name, float(Fraction(divisor, steps)), tuple(lifts), sway)


def wave_gait(leg_count: int, in_air: int = 1, name: str | None = None) -> Gait:
    """A gait in which as many legs as wanted are in the air at once, spread over the body.

    An even number of legs stands in two rows: on each side they lift from rear to front, the two
    sides half a cycle apart. An odd number stands around the body: they lift one after the other,
    each as many places after the one before as keeps those in the air together farthest apart.

    Args:
        leg_count: Number of legs, which go around the body in their order.
        in_air: Number of feet in the air at any time.
        name: Of the gait; absent: ``wave`` with one foot in the air, ``ripple`` with more.

    Raises:
        InvalidGait: Fewer than three feet would stand.
    """
    _check_positive("leg_count", leg_count)
    _check_positive("in_air", in_air)
    name = name or ("wave" if in_air == 1 else "ripple")
    if leg_count - in_air < FEWEST_FEET:
        raise InvalidGait(
            f'gait "{name}" with {in_air} of {leg_count} feet in the air leaves '
            f"{max(0, leg_count - in_air)} on the ground; at least {FEWEST_FEET} are needed."
        )

    turn = _two_rows(leg_count) if leg_count % 2 == 0 else _around(leg_count, in_air)
    lifts = tuple(float(Fraction(place, leg_count)) for place in turn)
    return Gait(name, float(Fraction(leg_count - in_air, leg_count)), lifts)


def _two_rows(count: int) -> list[int]:
    """When each leg lifts, in steps: from rear to front on both sides, half a cycle apart."""
    side = count // 2
    right = [2 * (side - 1 - leg) for leg in range(side)]
    # An odd number of steps apart, so that no two legs lift at once.
    left = [(2 * leg + side + 1 - side % 2) for leg in range(side)]
    return [(place - right[0]) % count for place in right + left]


def _around(count: int, in_air: int) -> list[int]:
    """When each leg lifts, in steps: those that are in the air together as far apart as can be."""

    def apart(stride: int) -> int:
        ways = ((lag * stride) % count for lag in range(1, in_air))
        return min((min(way, count - way) for way in ways), default=0)

    # Legs are numbered clockwise from above: the other way around goes from rear to front.
    strides = [k for k in range(count - 1, 0, -1) if math.gcd(k, count) == 1]
    turn = pow(max(strides, key=apart), -1, count)
    return [leg * turn % count for leg in range(count)]


def alternating_gait(leg_count: int, name: str = "alternating") -> Gait:
    """Every other leg in the air: the tripod of six legs, the tetrapods of eight.

    Args:
        leg_count: Number of legs, an even one; they go around the body in their order.
        name: Of the gait.

    Raises:
        InvalidGait: Fewer than three feet would stand, or the number is odd.
    """
    if leg_count % 2:
        raise InvalidGait(f"leg_count is {leg_count}; every other leg is half of an even number.")
    return Gait(name, 1 / 2, tuple(leg % 2 / 2 for leg in range(leg_count)))


def _part(way: Fraction) -> float:
    return float(way % 1)


def _check_positive(name: str, value: int) -> None:
    check_type(f"gait.{name}", value, (int,), "a whole number greater than 0", error=InvalidGait)
    if value < 1:
        raise InvalidGait(f"gait.{name} is {value}; it must be a whole number greater than 0.")
