"""The polynomials of all paths."""

import numpy as np
import pytest

from phasmid.motion import blend, join, lift

START, END, V0, V1 = (np.array([x]) for x in (0.3, -0.2, 1.5, -0.7))


def joined(curve, u):
    return join(curve, u, START, END, (V0, V1))


@pytest.mark.parametrize("curve", ["quintic", "cubic-spline"])
def test_curves_have_their_ends_and_their_derivatives(curve):
    ends = np.array([0.0, 1.0])
    # Sums of coefficients up to 20, each rounded.
    s, path = blend(curve, ends), joined(curve, ends)
    assert (s.position.tolist(), s.velocity.tolist()) == ([0, 1], [0, 0])
    assert path.position == pytest.approx([0.3, -0.2], abs=1e-14)
    assert path.velocity == pytest.approx([1.5, -0.7], abs=1e-13)
    if curve == "quintic":
        assert s.acceleration.tolist() == [0, 0]
        assert path.acceleration == pytest.approx([0, 0], abs=1e-13)
    # Central differences of polynomials of degree 5: error h^2/6 * 360 = 6e-9 at h = 1e-5, and
    # round-off 1e-16/h = 1e-11.
    u, h = np.concatenate([np.linspace(0.01, 0.49, 400), np.linspace(0.51, 0.99, 400)]), 1e-5
    for function in (blend, lift, joined):
        before, here, after = (function(curve, u + k * h) for k in (-1, 0, 1))
        assert np.abs((after.position - before.position) / (2 * h) - here.velocity).max() < 2e-8
        assert np.abs((after.velocity - before.velocity) / (2 * h) - here.acceleration).max() < 2e-6


def test_a_lift_is_the_clamped_cubic_spline_through_its_three_points():
    # Zero slope at the apex by symmetry, so each half is 3 u^2 - 2 u^3 of its own parameter.
    u = np.linspace(0, 0.5, 501)
    assert lift("cubic-spline", u).position == pytest.approx(3 * (2 * u) ** 2 - 2 * (2 * u) ** 3)
