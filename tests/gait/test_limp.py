"""Gaits of the legs that remain when others are lost."""

from itertools import permutations

import numpy as np
import pytest

from phasmid.errors import InvalidGait
from phasmid.gait import Gait, load_gait, support_margin, sway, without_legs
from phasmid.gait.cycle import COMFORTABLE_STEP, foot_way, timing
from phasmid.gait.shift import best_place
from support.walks import neutral_and_mass


def margin_of(limp, feet, com):
    """Least margin of a limp over midpoints of equal parts of its cycle."""
    gait, rest = limp.gait, feet[limp.indices]
    phase = (np.arange(3600) + 0.5) / 3600
    stood = (phase[:, None] - gait.offsets - gait.swing_fraction) % 1.0
    at = foot_way(rest, np.array(COMFORTABLE_STEP), 0.5 - (1 - stood / gait.duty_factor))
    place = com + limp.shift + sway(gait, rest, 1.0, phase).way
    return support_margin(at, gait.stance(phase), place).min()


def placed_margin(feet, stance, com, farthest):
    """Least margin with the best shift."""
    shift = best_place(feet, stance, com, farthest)
    return support_margin(feet, stance, com + shift).min()


@pytest.mark.parametrize("lost", range(1, 7))
@pytest.mark.parametrize("name", ["tripod", "ripple", "wave"])
def test_a_hexapod_walks_on_whichever_leg_it_loses(name, lost):
    feet, com = neutral_and_mass("phantomx-ax")
    limp = without_legs(load_gait(name), {lost}, feet, com)
    assert limp.legs == tuple(leg for leg in range(1, 7) if leg != lost)
    assert limp.gait.sway == 0.0
    assert margin_of(limp, feet, com) > 0.025
    # Half a sample of 3600 at 40 mm per stance of at least 2/3 of a cycle is 8.4 um.
    assert limp.margin == pytest.approx(margin_of(limp, feet, com), abs=1e-5)
    # Without the shift a tripod's remaining legs let it fall, whatever their order.
    assert np.hypot(*limp.shift) > 0.02


@pytest.mark.parametrize("lost", range(1, 7))
def test_the_nearest_shift_that_is_enough_is_smaller_and_just_enough(lost):
    feet, com = neutral_and_mass("phantomx-ax")
    best = without_legs(load_gait("tripod"), {lost}, feet, com)
    near = without_legs(load_gait("tripod"), {lost}, feet, com, nearest=True)
    assert near.gait == best.gait
    # Along the way to the best place, of which twelve halvings leave 1/4096: 16 um of 65 mm, with
    # 9 um of the samples.
    assert np.hypot(*near.shift) < 0.9 * np.hypot(*best.shift)
    enough = 0.1 * np.linalg.norm(feet[:, :2] - feet[:, :2].mean(axis=0), axis=1).mean()
    assert near.margin == pytest.approx(enough, abs=3e-5)
    assert near.margin >= enough


@pytest.mark.parametrize("lost", [(1, 4), (2, 5), (3, 6), (1, 5), (2, 4)])
def test_a_hexapod_sways_along_on_four_legs(lost):
    feet, com = neutral_and_mass("phantomx-ax")
    limp = without_legs(load_gait("wave"), lost, feet, com)
    assert limp.gait.sway > 0
    # Sways of 0.2 move the centre of mass by at most 2 pi 0.2 x 4 feet x 0.3 m a cycle.
    assert margin_of(limp, feet, com) == pytest.approx(limp.margin, abs=3e-4)
    # The sufficient margin: 0.07 of the mean distance of the feet, 0.26 m.
    assert limp.margin > 0.018


def test_legs_that_still_hold_keep_their_times():
    feet, com = neutral_and_mass("octopod")
    gait = load_gait("ripple", 8)
    limp = without_legs(gait, [2], feet, com)
    assert limp.gait.offsets == tuple(gait.offsets[i] for i in (0, 2, 3, 4, 5, 6, 7))
    assert limp.gait.duty_factor == gait.duty_factor
    assert limp.gait.name == "ripple without 2"


def test_no_order_with_any_shift_holds_much_better():
    # Order and shift are fitted in turn; both at once, tried one by one, gain less than 1 mm.
    feet, com = neutral_and_mass("phantomx-ax")
    size = np.linalg.norm(feet - feet.mean(axis=0), axis=1).mean()
    step = np.array(COMFORTABLE_STEP)
    for lost in (1, 2):
        rest = np.delete(feet, lost - 1, axis=0)
        best = -np.inf
        for order in permutations(range(1, 5)):
            told = timing(Gait("tried", 4 / 5, tuple(k / 5 for k in (0, *order))), 2)
            at = foot_way(rest, step, told.share)
            place = np.broadcast_to(com, (len(at), 2))
            best = max(best, placed_margin(at, told.stance, place, 0.16 * size))
        assert without_legs(load_gait("tripod"), [lost], feet, com).margin > best - 1e-3


def test_the_best_place_in_a_triangle_is_its_incentre_within_the_farthest_shift():
    # Of the triangle (0, 0), (3, 0), (0, 4) the incircle has radius 1 about (1, 1).
    feet, stance = np.array([[[0.0, 0], [3, 0], [0, 4]]]), np.ones((1, 3), dtype=bool)
    com = np.array([[-2.0, 5.0]])
    shift = best_place(feet, stance, com, 10.0)
    assert shift == pytest.approx([3.0, -4.0], abs=1e-8)
    assert support_margin(feet, stance, com + shift) == pytest.approx(1.0, abs=1e-8)
    com = np.array([[0.5, 0.25]])
    shift = best_place(feet, stance, com, 0.25)
    assert shift[1] == pytest.approx(0.25, abs=1e-9)
    assert support_margin(feet, stance, com + shift) == pytest.approx(0.5, abs=1e-9)


def test_the_best_place_over_many_polygons_is_held_against_a_grid():
    # The margin changes no faster than the place, so a grid of 0.02 misses at most 0.0142.
    rng = np.random.default_rng(7)
    around = np.arange(6) * np.pi / 3
    ring = np.column_stack([np.cos(around), np.sin(around)])
    feet = ring + 0.2 * rng.standard_normal((12, 6, 2))
    stance = np.ones((12, 6), dtype=bool)
    stance[np.arange(12), np.arange(12) % 6] = False
    com = np.broadcast_to([0.1, -0.3], (12, 2))
    margin = placed_margin(feet, stance, com, 0.5)
    grid = np.stack(np.meshgrid(*[np.arange(-0.5, 0.51, 0.02)] * 2), axis=-1).reshape(-1, 1, 2)
    many = (len(grid), 12, 6)
    place = np.broadcast_to(com + grid, (len(grid), 12, 2))
    tried = support_margin(np.broadcast_to(feet, (*many, 2)), np.broadcast_to(stance, many), place)
    tried = tried.min(axis=1).max()
    assert tried - 1e-9 <= margin <= tried + 0.0142


@pytest.mark.parametrize(
    ("gait", "lost", "message"),
    [
        ("wave", [1, 2], "^without legs 1, 2 the others do not hold the robot: "),
        ("tripod", [7], "^leg 7 is lost; there are legs 1 to 6"),
        ("tripod", [1, 3, 5], "^3 of 6 legs remain; at least 4 are needed to walk"),
        ("quadruped", [1], r"^gait.offsets has 4 values; one per leg, 6 in all"),
    ],
)
def test_legs_that_cannot_be_lost_are_refused(gait, lost, message):
    feet, com = neutral_and_mass("phantomx-ax")
    gait = load_gait("crawl", 4) if gait == "quadruped" else load_gait(gait)
    with pytest.raises(InvalidGait, match=message):
        without_legs(gait, lost, feet, com)
    line = np.array([[0.1 * x, 0.0] for x in range(6)])
    with pytest.raises(InvalidGait, match="they stand in a line"):
        without_legs(load_gait("wave"), [1], line)
