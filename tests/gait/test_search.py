"""Orders of lifting: the best of all, held against trying them one by one."""

from itertools import permutations

import numpy as np
import pytest

from phasmid.errors import InvalidGait
from phasmid.gait import Gait, best_order, support_margin, sway
from phasmid.gait.cycle import foot_way
from support.walks import neutral_and_mass

SAMPLES = 720


def sampled_margin(gait, feet, com, step):
    """Least margin over midpoints of equal parts of a cycle, each leg followed by itself."""
    phase = (np.arange(SAMPLES) + 0.5) / SAMPLES
    place = np.empty((SAMPLES, len(feet), 2))
    for leg, offset in enumerate(gait.offsets):
        # A foot stands from its landing, half a step ahead, to its next lift, half a step behind.
        stood = (phase - offset - (1 - gait.duty_factor)) % 1.0
        place[:, leg] = feet[leg] + np.outer(0.5 - stood / gait.duty_factor, step[:2])
    com = com + sway(gait, feet, 1.0, phase).way
    return support_margin(place, gait.stance(phase), com).min()


@pytest.mark.parametrize(
    ("robot", "duty", "share"),
    [("phantomx-paper", 5 / 6, 0.0), ("phantomx-ax", 2 / 3, 0.0), ("quadruped", 5 / 6, 0.08)],
)
def test_the_best_order_is_the_best_of_all_tried_one_by_one(robot, duty, share):
    # A cycle's least margin lies at an event, at most half a sample from one of 720 midpoints. Over
    # the feet the centre of mass goes at step / duty factor a cycle and sways at no more than
    # 2 pi share times the feet's distances together, and the margin changes no faster.
    feet, com = neutral_and_mass(robot)
    step, count = np.array([0.04, 0.0, 0.0]), len(feet)
    arm = np.linalg.norm(feet - feet.mean(axis=0), axis=1).sum()
    close = (0.04 / duty + 2 * np.pi * share * arm) / (2 * SAMPLES)
    margins = {
        order: sampled_margin(
            Gait("tried", duty, tuple(i / count for i in (0, *order)), share), feet, com, step
        )
        for order in permutations(range(1, count))
    }
    found = best_order(feet, com, duty_factor=duty, sway=share)
    assert found.margin == pytest.approx(max(margins.values()), abs=close)
    own = tuple(round(count * offset) for offset in found.gait.offsets[1:])
    assert margins[own] == pytest.approx(max(margins.values()), abs=close)


def test_the_first_of_equal_orders_is_taken():
    # On a square all is alike but the sense of going around; with no step both senses are too.
    feet = np.array([[1.0, -1], [-1, -1], [-1, 1], [1, 1]])
    found = best_order(feet, step=(0.0, 0.0, 0.0), sway=0.1, duty_factor=5 / 6)
    assert found.gait.offsets == (0, 1 / 4, 2 / 4, 3 / 4)


def test_a_foot_amid_its_stance_is_neutral_and_others_follow_the_twist():
    # A turn about the body's origin by a quarter: feet go about it against the turn.
    feet = np.array([[1.0, 0.0]])
    way = foot_way(feet, np.array([0.0, 0.0, np.pi / 2]), np.array([[-0.5], [0.0], [0.5]]))
    half = np.sqrt(0.5)
    np.testing.assert_allclose(way[:, 0], [[half, half], [1, 0], [half, -half]], atol=1e-15)
    # Straight and turning: the way is an arc, so the body's pose times the foot stays one point.
    step, share = np.array([0.3, 0.1, 0.8]), np.linspace(-0.5, 0.5, 9)
    way = foot_way(feet, step, share[:, None])[:, 0]
    a = 0.8 * share
    x = (0.3 * np.sin(a) - 0.1 * (1 - np.cos(a))) / 0.8
    y = (0.3 * (1 - np.cos(a)) + 0.1 * np.sin(a)) / 0.8
    ground_x = x + np.cos(a) * way[:, 0] - np.sin(a) * way[:, 1]
    ground_y = y + np.sin(a) * way[:, 0] + np.cos(a) * way[:, 1]
    np.testing.assert_allclose(ground_x, 1.0, rtol=0, atol=1e-15)
    np.testing.assert_allclose(ground_y, 0.0, rtol=0, atol=1e-15)


def test_a_search_over_too_many_legs_is_refused():
    around = 2 * np.pi * np.arange(9) / 9
    with pytest.raises(InvalidGait, match="orders are searched for 4 to 8 legs; here are 9"):
        best_order(np.column_stack([np.cos(around), np.sin(around)]))
