"""The support margin as a loop, held against the vectorised one."""

import numpy as np
import pytest

from phasmid.compiled import compiled
from phasmid.gait import margin_at, support_margin


@pytest.mark.parametrize("made", [lambda loop: loop, compiled], ids=["plain", "compiled"])
def test_the_loop_tells_the_same_margin(made):
    # Feet of up to 0.4 m: a few products rounded by 1e-16 of it.
    rng = np.random.default_rng(5)
    margin = made(margin_at)
    for legs in (4, 5, 6, 8):
        feet = rng.uniform(-0.4, 0.4, (200, legs, 3))
        stance = rng.random((200, legs)) < 0.7
        com = rng.uniform(-0.4, 0.4, (200, 2))
        wanted = support_margin(feet[..., :2], stance, com)
        assert np.isfinite(wanted).any()
        for k in range(200):
            told = margin(feet[k], stance[k], com[k, 0], com[k, 1])
            assert told == wanted[k] or abs(told - wanted[k]) < 1e-12


def test_the_loop_knows_feet_on_a_line_and_in_one_place():
    line = np.array([[0.0, 0], [1, 0], [2, 0], [5, 5]])
    assert margin_at(line, np.array([True, True, True, False]), 1.0, 0.0) == -np.inf
    twice = np.array([[0.0, 0], [4, 0], [0, 3], [0, 0]])
    # The incircle of that triangle has radius 1 about (1, 1).
    assert margin_at(twice, np.ones(4, dtype=bool), 1.0, 1.0) == pytest.approx(1.0, abs=1e-15)
