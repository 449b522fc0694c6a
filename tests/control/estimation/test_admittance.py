"""Virtual mass, spring and damper of a foot, against closed forms."""

import math

import numpy as np
import pytest

from phasmid.control.estimation.admittance import give_way, share_weight, transition


@pytest.mark.parametrize("damping_ratio", [0.2, 1.0, 3.0])
def test_steps_of_any_length_meet_the_exact_solution(damping_ratio):
    """m x'' + d x' + k x = f: x tends to f/k; two half steps are one whole, and a step's
    derivative at no time is the equation itself."""
    m, k, f = 0.8, 300.0, 6.0
    A, b = transition(m, k, damping_ratio, 0.04)
    H, h = transition(m, k, damping_ratio, 0.02)
    np.testing.assert_allclose(H @ H, A, atol=1e-12)
    np.testing.assert_allclose(H @ h + h, b, atol=1e-14)
    dt = 1e-7
    T, t = transition(m, k, damping_ratio, dt)
    x = np.array([0.01, -0.3])
    d = 2 * damping_ratio * math.sqrt(k * m)
    slope = (T @ x + t * f - x) / dt
    # The step's own curvature: dt/2 times the second derivative, below 1e-4 of these numbers.
    np.testing.assert_allclose(slope, [x[1], (f - k * x[0] - d * x[1]) / m], rtol=1e-4)


def test_an_undamped_foot_swings_with_its_own_frequency():
    """x = cos(w t), x' = -w sin(w t)."""
    w, t = math.sqrt(200.0 / 2.0), 0.37
    A, _ = transition(2.0, 200.0, 0.0, t)
    np.testing.assert_allclose(A @ [1.0, 0.0], [math.cos(w * t), -w * math.sin(w * t)], rtol=1e-12)


@pytest.mark.parametrize("dt", [1e-3, 0.1, 10.0, 1e4])
@pytest.mark.parametrize("damping_ratio", [0.1, 1.0, 5.0])
def test_no_step_is_too_long_to_be_stable(dt, damping_ratio):
    A, b = transition(0.1, 1e4, damping_ratio, dt)
    assert np.isfinite(A).all()
    assert np.isfinite(b).all()
    assert np.abs(np.linalg.eigvals(A)).max() < 1.0


def test_the_weight_is_shared_with_the_least_sum_of_squares():
    """Sum and moments of the forces are the weight's; the pseudo-inverse has the least norm."""
    random = np.random.default_rng(3)
    feet = np.column_stack([random.uniform(-0.2, 0.2, (6, 2)), np.zeros(6)])
    standing = np.array([True, True, False, True, True, True])
    com, force = feet[standing, :2].mean(axis=0) + np.array([0.01, -0.005]), np.empty(6)
    share_weight(30.0, com, feet, standing, force)
    A = np.vstack([np.ones(6), (feet[:, :2] - com).T])[:, standing]
    np.testing.assert_allclose(force[standing], np.linalg.pinv(A) @ [30.0, 0.0, 0.0], rtol=1e-9)
    assert force[2] == 0.0


def laws(dt=0.005):
    return [np.column_stack(transition(0.5, k, 1.0, dt)) for k in (300.0, 3000.0)]


def test_a_standing_foot_gives_way_by_the_excess_over_the_stiffness():
    swing, stance = laws()
    feet, standing = np.zeros((2, 2)), np.ones(2, dtype=bool)
    for _ in range(2000):
        give_way(np.array([9.0, 3.0]), np.full(2, 6.0), standing, swing, stance, 0.01, feet)
    np.testing.assert_allclose(feet, [[3.0 / 3000, 0.0], [-3.0 / 3000, 0.0]], atol=1e-12)


def test_an_offset_is_bounded_and_a_swinging_foot_returns():
    swing, stance = laws()
    feet, standing = np.zeros((1, 2)), np.ones(1, dtype=bool)
    for _ in range(2000):
        give_way(np.array([1e6]), np.zeros(1), standing, swing, stance, 0.01, feet)
        assert abs(feet[0, 0]) <= 0.01
    assert feet[0, 0] == 0.01
    for _ in range(400):
        give_way(np.array([1e6]), np.zeros(1), ~standing, swing, stance, 0.01, feet)
    assert abs(feet[0, 0]) < 1e-6


def test_an_unknown_force_moves_no_foot():
    swing, stance = laws()
    feet = np.zeros((1, 2))
    give_way(np.array([np.nan]), np.ones(1), np.ones(1, dtype=bool), swing, stance, 0.01, feet)
    np.testing.assert_array_equal(feet, 0.0)
