"""Virtual mass, spring and damper of a foot, against closed forms."""

import math

import numpy as np

from estimation_records import new_parameters, new_state
from phasmid.control.estimation.admittance import (
    MASS,
    apply_admittance,
    share_weight,
    transition,
)
from phasmid.control.estimation.state import SensorKind


def test_steps_of_any_length_meet_the_exact_solution():
    """m x'' + 2 √(k m) x' + k x = f: x tends to f/k; two half steps are one whole, and a step's
    derivative at no time is the equation itself."""
    m, k, f = MASS, 300.0, 6.0
    A, b = transition(k, 0.04)
    H, h = transition(k, 0.02)
    np.testing.assert_allclose(H @ H, A, atol=1e-12)
    np.testing.assert_allclose(H @ h + h, b, atol=1e-14)
    dt = 1e-7
    T, t = transition(k, dt)
    x = np.array([0.01, -0.3])
    slope = (T @ x + t * f - x) / dt
    # The step's own curvature: dt/2 times the second derivative, below 1e-4 of these numbers.
    d = 2 * math.sqrt(k * m)
    np.testing.assert_allclose(slope, [x[1], (f - k * x[0] - d * x[1]) / m], rtol=1e-4)


def test_the_weight_is_shared_with_the_least_sum_of_squares():
    """Sum and moments of the forces are the weight's; the pseudo-inverse has the least norm."""
    random = np.random.default_rng(3)
    feet = np.column_stack([random.uniform(-0.2, 0.2, (6, 2)), np.zeros(6)])
    standing = np.array([True, True, False, True, True, True])
    com, state = feet[standing, :2].mean(axis=0) + np.array([0.01, -0.005]), new_state()
    state.feet["standing"][:6] = standing
    share_weight(com, feet, state, new_parameters(weight=30.0))
    force = state.feet["desired_force"][:6]
    A = np.vstack([np.ones(6), (feet[:, :2] - com).T])[:, standing]
    np.testing.assert_allclose(force[standing], np.linalg.pinv(A) @ [30.0, 0.0, 0.0], rtol=1e-9)
    assert force[2] == 0.0


class Feet:
    """Feet at the corners of a square, over whose middle a mass lies."""

    def __init__(self, weight):
        self.parameters = new_parameters(weight=weight, leg_count=4)
        self.state = new_state()
        self.feet = self.state.feet[:4]
        self.places = np.array(
            [[1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, -1.0, 0.0], [-1.0, 1.0, 0.0]]
        )

    def update(self, force, *, standing=True, times=1):
        self.feet["standing"][:] = standing
        self.feet["sensors"]["reading"][:, SensorKind.FORCE] = force
        for _ in range(times):
            apply_admittance(
                np.zeros(3), self.places, SensorKind.FORCE, self.state, self.parameters
            )
        return self.feet["offset"]


def test_a_standing_foot_gives_way_by_the_excess_over_the_stiffness():
    feet = Feet(24.0)
    offset = feet.update([9.0, 3.0, 6.0, 6.0], times=2000)
    np.testing.assert_allclose(offset, [3.0 / 2000, -3.0 / 2000, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(feet.feet["offset_velocity"], 0.0, atol=1e-12)
    # By 10 mm at the most; a swinging foot returns, and an unknown force moves none.
    assert (feet.update(1e6, times=2000) == 0.01).all()
    assert np.abs(feet.update(1e6, standing=False, times=400)).max() < 1e-6
    np.testing.assert_array_equal(Feet(4.0).update(np.nan), 0.0)
