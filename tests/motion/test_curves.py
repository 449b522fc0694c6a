"""The polynomials of all paths."""

import numpy as np
import pytest

from phasmid.motion import blend, join, lift

U = np.linspace(0, 1, 1001)


@pytest.mark.parametrize("curve", ["quintic", "cubic-spline"])
def test_a_blend_starts_and_ends_at_rest_where_it_should(curve):
    s = blend(curve, np.array([0.0, 1.0]))
    assert s.position.tolist() == [0, 1]
    assert s.velocity.tolist() == [0, 0]
    if curve == "quintic":
        assert s.acceleration.tolist() == [0, 0]


@pytest.mark.parametrize("curve", ["quintic", "cubic-spline"])
@pytest.mark.parametrize("path", [blend, lift])
def test_velocity_and_acceleration_are_the_derivatives_of_the_path(curve, path):
    # Central differences of polynomials of degree 5: error h^2/6 * 360 = 6e-9 at h = 1e-5, and
    # round-off 1e-16/h = 1e-11.
    u, h = U[(U > 0.01) & (U < 0.99) & (np.abs(U - 0.5) > 0.01)], 1e-5
    before, here, after = (path(curve, u + k * h) for k in (-1, 0, 1))
    assert np.abs((after.position - before.position) / (2 * h) - here.velocity).max() < 2e-8
    assert np.abs((after.velocity - before.velocity) / (2 * h) - here.acceleration).max() < 2e-6


def test_the_spline_is_scipys_clamped_cubic_or_its_hand_made_system():
    # The natural equations of a clamped cubic spline through 0, 1, 0 at 0, 1/2, 1 have zero slope
    # at the apex by symmetry, so each half is 3 u^2 - 2 u^3 of its own parameter.
    u = U[:501]
    assert lift("cubic-spline", u).position == pytest.approx(3 * (2 * u) ** 2 - 2 * (2 * u) ** 3)


@pytest.mark.parametrize("curve", ["quintic", "cubic-spline"])
def test_a_join_has_the_ends_and_velocities_that_were_asked(curve):
    start, end, v0, v1 = (np.array([x]) for x in (0.3, -0.2, 1.5, -0.7))
    path = join(curve, np.array([0.0, 1.0]), start, end, (v0, v1))
    # Sums of coefficients up to 20, each rounded.
    assert path.position == pytest.approx([0.3, -0.2], abs=1e-14)
    assert path.velocity == pytest.approx([1.5, -0.7], abs=1e-13)
    if curve == "quintic":
        assert path.acceleration == pytest.approx([0, 0], abs=1e-13)
