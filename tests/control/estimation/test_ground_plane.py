"""The plane through the standing feet."""

import math

import numpy as np

from phasmid.control.estimation.ground_plane import (
    FORGETTING_TIME,
    PLANE_RATE,
    PLANE_TIME,
    estimate_plane,
)
from support.estimation_records import new_parameters, new_state

HEXAPOD = np.array(
    [[0.2, -0.15], [0.0, -0.2], [-0.2, -0.15], [-0.2, 0.15], [0.0, 0.2], [0.2, 0.15]]
)
DT, ALL = 0.005, np.ones(6, dtype=bool)
PLANE = ("height", "slope_x", "slope_y", "x", "y")


class Fit:
    """The estimator's planes; `begin` gives height, slopes and reference point of all three."""

    def __init__(self, legs=6, *, begin=None):
        self.state = new_state()
        self.parameters = new_parameters(dt=DT, leg_count=legs)
        if begin is None:
            return
        self.state.plane_started = 1
        for plane in (self.state.fitted_plane, self.state.lagged_plane, self.state.ground_plane):
            for name, value in zip(PLANE, begin, strict=True):
                setattr(plane, name, value)

    def update(self, feet, standing, at=(0.0, 0.0), times=1):
        self.state.feet["bearing"][: len(feet)] = standing
        for _ in range(times):
            estimate_plane(feet, np.array(at), self.state, self.parameters)
        return np.array([getattr(self.state.fitted_plane, name) for name in PLANE])


def on_plane(a, b, c, places=HEXAPOD):
    return np.column_stack([places, c + places @ [a, b]])


def test_a_plane_through_all_feet_is_met_exactly():
    """z = c + a x + b y; each update takes at least three quarters off what is missing."""
    feet = on_plane(0.3, -0.2, 0.05, np.add(HEXAPOD, [0.07, 0.04]))
    plane = Fit(5).update(feet[:5], ALL[:5], at=(0.1, 0.2), times=60)
    np.testing.assert_allclose(plane[1:3], [0.3, -0.2], atol=1e-12)
    np.testing.assert_allclose(plane[0], 0.05 + 0.3 * 0.1 - 0.2 * 0.2, atol=1e-12)


def test_feet_on_a_line_leave_the_slope_across_it_as_it_was():
    places = np.array([[-0.2, 0.0], [0.0, 0.0], [0.2, 0.0]])
    fit = Fit(3, begin=(0.0, 0.0, 0.15, 0.0, 0.0))
    plane = fit.update(on_plane(0.3, 0.0, 0.0, places), ALL[:3], times=500)
    np.testing.assert_allclose(plane[1:3], [0.3, 0.15], atol=1e-9)


def test_a_lifted_foot_is_forgotten_and_not_dropped():
    """Its weight fades as exp(-t/T): just lifted it still counts in full."""
    feet = on_plane(0.0, 0.0, 0.0)
    fit, standing = Fit(), ALL.copy()
    fit.update(feet, standing)
    standing[0] = False
    for _ in range(10):
        feet[0, 2] += 0.01
        fit.update(feet, standing)
    weights = fit.state.feet["foothold_weight"][:6]
    np.testing.assert_allclose(
        weights, [math.exp(-10 * DT / FORGETTING_TIME), 1, 1, 1, 1, 1], rtol=1e-12
    )
    # It is remembered where it stood, not where it goes.
    assert fit.state.feet[0].foothold[2] == 0.0


def test_the_slope_changes_no_faster_than_it_may():
    plane = Fit(begin=(0.0,) * 5).update(on_plane(0.4, 0.3, 0.0), ALL, times=4)
    np.testing.assert_allclose(np.hypot(*plane[1:3]), 4 * PLANE_RATE * DT, rtol=1e-9)


def test_two_lags_take_the_corners_out():
    """After a step from 0 to 1: 1 - (1 + t/T) exp(-t/T), by steps of dt to within dt/T."""
    fit = Fit(begin=(0.0,) * 5)
    fit.update(on_plane(0.0, 0.0, 1.0), ALL, times=round(2 * PLANE_TIME / DT))
    height = fit.state.ground_plane.height
    np.testing.assert_allclose(height, 1 - (1 + 2) * math.exp(-2), atol=DT / PLANE_TIME)
