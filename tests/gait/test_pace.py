"""Gait and cycle time by speed."""

import numpy as np
import pytest

from phasmid.gait import choose_gait, choose_period

LARGEST = {"tripod": 0.4, "ripple": 0.2, "wave": 0.1}


@pytest.mark.parametrize(
    ("speed", "gait"),
    [(0.0, "wave"), (0.08, "wave"), (0.081, "ripple"), (0.16, "ripple"), (0.17, "tripod")],
)
def test_from_rest_the_slowest_gait_with_ease_is_taken(speed, gait):
    assert choose_gait(speed, LARGEST) == gait


def test_the_fastest_gait_is_taken_where_none_is_fast_enough():
    assert choose_gait(9.0, LARGEST) == "tripod"
    assert choose_gait(9.0, LARGEST, "tripod") == "tripod"


def test_a_speed_that_swells_and_fades_changes_the_gait_twice_each_way():
    # Up at 0.8 of 0.1 and 0.2; down at 0.8 of that.
    speeds = np.concatenate([np.linspace(0, 0.3, 301), np.linspace(0.3, 0, 301)])
    present, changes = None, []
    for speed in speeds:
        gait = choose_gait(float(speed), LARGEST, present)
        if gait != present:
            changes.append((gait, round(float(speed), 3)))
        present = gait
    assert changes == [
        ("wave", 0.0),
        ("ripple", 0.081),
        ("tripod", 0.161),
        ("ripple", 0.128),
        ("wave", 0.064),
    ]


def test_a_speed_that_trembles_on_a_bound_keeps_the_gait():
    rng = np.random.default_rng(3)
    present, changes = None, 0
    for speed in 0.08 * (1 + 0.08 * rng.standard_normal(2000)).clip(0.82, 1.18):
        gait = choose_gait(float(speed), LARGEST, present)
        changes += present is not None and gait != present
        present = gait
    assert changes <= 1


def test_of_equally_fast_gaits_the_present_one_stays():
    largest = {"ripple": 0.2, "amble": 0.2, "tripod": 0.4}
    assert choose_gait(0.1, largest) == "ripple"
    assert choose_gait(0.1, largest, "amble") == "amble"


def test_a_step_has_the_comfortable_share_of_the_longest():
    # While a foot stands, duty factor x period, the body goes 0.6 of 100 mm.
    period = choose_period(0.05, 2 / 3, 0.1, shortest=0.5, longest=4.0)
    assert period * 2 / 3 * 0.05 == pytest.approx(0.06, rel=1e-12)
    # Slower than that it steps no slower than it may, faster no faster.
    assert choose_period(0.0, 2 / 3, 0.1, shortest=0.5, longest=4.0) == 4.0
    assert choose_period(1.0, 2 / 3, 0.1, shortest=0.5, longest=4.0) == 0.5
