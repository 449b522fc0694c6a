"""The smallest foot forces: equilibrium, statics by hand, and minimality."""

import numpy as np
import pytest

from phasmid.errors import InfeasibleLoad
from phasmid.forces import minimum_norm


def random_case(count=200, seed=0):
    rng = np.random.default_rng(seed)
    feet = rng.normal(scale=0.2, size=(count, 6, 3))
    stance = np.zeros((count, 6), dtype=bool)
    for row in stance:
        row[rng.permutation(6)[: rng.integers(3, 7)]] = True
    return feet, stance, rng.normal(scale=20.0, size=(count, 6))


def wrench_of(feet, force):
    return np.concatenate([force.sum(axis=1), np.cross(feet, force).sum(axis=1)], axis=-1)


def test_a_heavy_sample_hides_no_light_one_that_fails():
    # Feet on a line give no moment about it, however light their load beside another sample's.
    feet = np.array([[[1.0, -1, -0.5], [-1, -1, -0.5], [0, 1, -0.5]]] * 2)
    feet[1] = np.array([[0.1], [0.2], [0.4]]) * np.array([0.3, 0.1, 0.7])
    wrench = np.array([[0, 0, 1e12, 0, 0, 0], [0, 0, 0, 0.3, 0.1, 0.7]])
    with pytest.raises(InfeasibleLoad, match="on one line"):
        minimum_norm(feet, np.ones((2, 3), dtype=bool), wrench)


def test_no_other_solution_is_smaller():
    # The pseudo-inverse is the minimum-norm solution by definition; another algorithm, one by one.
    feet, stance, wrench = random_case(seed=1)
    force = minimum_norm(feet, stance, wrench)
    for p, s, w, f in zip(feet, stance, wrench, force, strict=True):
        A = np.zeros((6, 18))
        for i in np.flatnonzero(s):
            x, y, z = p[i]
            A[:3, 3 * i : 3 * i + 3] = np.eye(3)
            A[3:, 3 * i : 3 * i + 3] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
        assert np.abs(np.linalg.pinv(A) @ w - f.ravel()).max() < 1e-8


def test_three_feet_share_a_weight_by_the_lever_rule():
    # Feet at (1,-1), (-1,-1), (0,1) about the centre of mass at (0,0): the single foot on its side
    # carries half; the other two a quarter each.
    feet = np.array([[[1.0, -1, -0.5], [-1, -1, -0.5], [0, 1, -0.5], [9, 9, 9]]])
    stance = np.array([[True, True, True, False]])
    force = minimum_norm(feet, stance, np.array([[0, 0, 26.0, 0, 0, 0]]))[0]
    assert force[:, 2] == pytest.approx([6.5, 6.5, 13, 0], abs=1e-12)
    assert np.abs(force[:, :2]).max() < 1e-12
