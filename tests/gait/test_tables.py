"""The library held against the tables that others publish."""

from fractions import Fraction

import numpy as np
import pytest

from phasmid.errors import InvalidGait
from phasmid.gait import (
    GAITS,
    HEXAPOD_GAITS,
    alternating_gait,
    gaits_of,
    least_margin,
    load_gait,
    wave_gait,
)

# OpenSHC: stance, swing, offset, and multipliers in the same order of legs.
MULTIPLIERS = {
    "wave": (10, 2, 2, (2, 3, 4, 1, 0, 5)),
    "tripod": (2, 2, 2, (0, 1, 0, 1, 0, 1)),
    "ripple": (4, 2, 1, (2, 0, 4, 1, 3, 5)),
    "amble": (2, 1, 1, (1, 2, 0, 1, 2, 0)),
}

# The PhantomX's original firmware: steps, lifted, divisor, start steps of RR RM RF LR LM LF.
STEPS = {
    "ripple": (12, 3, 8, (7, 11, 3, 1, 5, 9)),
    "tripod": (8, 3, 4, (1, 5, 1, 5, 1, 5)),
    "wave": (24, 3, 20, (13, 17, 21, 1, 5, 9)),
}


@pytest.mark.parametrize("name", MULTIPLIERS)
def test_a_table_of_multipliers_is_the_gait_of_its_name(name):
    # A leg is ahead of the cycle by multiplier times offset, and lifts that much earlier.
    stance, swing, offset, multipliers = MULTIPLIERS[name]
    period = stance + swing
    lifts = [Fraction((multipliers[0] - m) * offset, period) % 1 for m in multipliers]
    assert tuple(map(float, lifts)) == HEXAPOD_GAITS[name].offsets
    assert stance / period == HEXAPOD_GAITS[name].duty_factor


def firmware_foot(step, start, steps, divisor):
    """Where the firmware puts a foot at the end of a step: along the stroke, and whether it is up.

    Three lifted places: rear, middle and front, at the steps -1, 0 and 1 from the start; down in
    front at step 2; then back by stroke / divisor a step.
    """
    own = (step - start + 1) % steps - 1
    if own in (-1, 0, 1):
        return own / 2, True
    return 0.5 - (own - 2) / divisor, False


@pytest.mark.parametrize("name", STEPS)
def test_the_firmwares_gaits_lift_and_land_when_its_feet_do(name):
    # Midway between the ends of two steps a foot is in the air if it is up at either end; on the
    # ground it has gone back evenly, as a stance of ours does.
    steps, _, divisor, starts = STEPS[name]
    right_rear, right_middle, right_front, *left = starts
    legs = (right_front, right_middle, right_rear, *left)
    gait = load_gait(f"firmware-{name}")
    # Leg 1 lifts at our phase 0: two steps before its start step, at the end of its last push.
    lift = right_front - 2
    for step in range(steps):
        middle = np.array((step + 0.5 - lift) / steps)
        stance, own = gait.stance(middle), gait.leg_phase(middle)
        for leg, start in enumerate(legs):
            (before, was_up), (after, is_up) = (
                firmware_foot(step + i, start, steps, divisor) for i in (0, 1)
            )
            assert stance[leg] == (not (was_up or is_up))
            if stance[leg]:
                share = (own[leg] - gait.swing_fraction) / gait.duty_factor
                # Fractions of 24 and 20: round-off of a few 1e-16.
                assert 0.5 - share == pytest.approx((before + after) / 2, abs=1e-14)


def rows_and_ring(count):
    """Feet in two rows, and around a circle."""
    around = -2 * np.pi * (np.arange(count) + 0.5) / count
    yield 0.3 * np.column_stack([np.cos(around), np.sin(around)])
    if count % 2 == 0:
        x = np.linspace(1, -1, count // 2) * 0.025 * count
        y = np.full(count // 2, 0.2)
        yield np.vstack([np.column_stack([x, -y]), np.column_stack([x[::-1], y])])


@pytest.mark.parametrize("count", [5, 7, 9, 10, 11, 12, 14, 16])
def test_gaits_are_made_for_any_number_of_legs(count):
    for gait in gaits_of(count).values():
        for feet in rows_and_ring(count):
            assert least_margin(gait, feet) > 0.04
    assert list(gaits_of(count)) == ["alternating", "wave", "ripple"][count % 2 :]
    assert load_gait("wave", count) == wave_gait(count)


def test_the_made_gaits_are_the_known_ones_where_there_are_some():
    assert alternating_gait(6, "tripod") == GAITS[6]["tripod"]
    assert alternating_gait(8, "tetrapod") == GAITS[8]["tetrapod"]
    assert wave_gait(6, 2, "firmware-ripple") == GAITS[6]["firmware-ripple"]


def test_a_gait_that_leaves_two_feet_is_not_made():
    with pytest.raises(InvalidGait, match="with 3 of 5 feet in the air leaves 2 on the ground;"):
        wave_gait(5, 3)
    with pytest.raises(InvalidGait, match="leg_count is 7; every other leg is half of an even"):
        alternating_gait(7)
