"""The support margin, compared with the convex hull of the standing feet."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from phasmid.gait import support_margin


def hull_margin(feet, point):
    """Signed distance of a point from the convex hull of feet."""
    hull = ConvexHull(feet)
    inside = -(hull.equations[:, :2] @ point + hull.equations[:, 2]).max()
    if inside >= 0:
        return inside
    corners = feet[hull.vertices]
    along = np.roll(corners, -1, axis=0) - corners
    share = np.clip(((point - corners) * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
    return -np.linalg.norm(point - corners - share[:, None] * along, axis=1).min()


@pytest.mark.parametrize("legs", [4, 5, 6, 8])
def test_the_margin_is_the_distance_from_the_convex_hull(legs):
    # Feet within 0.4 m: a few products rounded by 1e-16, divided by lengths of edges over 1e-3 m.
    rng = np.random.default_rng(legs)
    feet = rng.uniform(-0.4, 0.4, (200, legs, 2))
    stance = rng.random((200, legs)) < 0.7
    com = rng.uniform(-0.4, 0.4, (200, 2))
    found = support_margin(feet, stance, com)
    for k in range(200):
        if stance[k].sum() < 3:
            assert found[k] == -np.inf
        else:
            wanted = hull_margin(feet[k, stance[k]], com[k])
            assert found[k] == pytest.approx(wanted, rel=0, abs=1e-12)


def test_feet_on_a_line_have_no_margin_and_feet_in_one_place_count_once():
    line = np.array([[0.0, 0], [1, 0], [2, 0], [5, 5]])
    assert support_margin(line, np.array([True, True, True, False]), np.zeros(2)) == -np.inf
    twice = np.array([[0.0, 0], [4, 0], [0, 3], [0, 0]])
    # The incircle of that triangle has radius 1 about (1, 1).
    margin = support_margin(twice, np.ones(4, dtype=bool), np.ones(2))
    assert margin == pytest.approx(1.0, abs=1e-15)


def test_stance_and_centre_of_mass_broadcast_over_the_samples():
    feet = np.zeros((2, 3, 4, 2)) + np.array([[1.0, 1], [-1, 1], [-1, -1], [1, -1]])
    margin = support_margin(feet, np.ones(4, dtype=bool), np.array([0.25, 0.0]))
    np.testing.assert_array_equal(margin, np.full((2, 3), 0.75))
