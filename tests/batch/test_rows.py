"""Sine, cosine and arc tangent of the kernels, against 60 digits."""

from __future__ import annotations

from collections.abc import Callable
from inspect import getsource, unwrap

import mpmath
import numba
import numpy as np
import pytest

from phasmid.batch import rows

BLOCK = int(rows.BLOCK)


def _compiled(name: str) -> Callable[..., None]:
    u = numba.uint64
    places = 3
    signature = numba.void(numba.float64[::1], *[u] * places)
    return numba.njit(signature, fastmath={"contract"})(unwrap(getattr(rows, name)))


@pytest.fixture(scope="module")
def sincos() -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]:
    function = _compiled("sincos")

    def evaluate(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        found = []
        for block in x.reshape(-1, BLOCK):
            w = np.concatenate([block, np.zeros(2 * BLOCK)])
            function(w, np.uint64(0), np.uint64(BLOCK), np.uint64(2 * BLOCK))
            found.append(w[BLOCK:].reshape(2, BLOCK))
        sine, cosine = np.concatenate(found, axis=1)
        return sine, cosine

    return evaluate


@pytest.fixture(scope="module")
def arctan2() -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    function = _compiled("arctan2")

    def evaluate(y: np.ndarray, x: np.ndarray) -> np.ndarray:
        found = []
        for block in zip(y.reshape(-1, BLOCK), x.reshape(-1, BLOCK), strict=True):
            w = np.concatenate([*block, np.zeros(BLOCK)])
            function(w, np.uint64(0), np.uint64(BLOCK), np.uint64(2 * BLOCK))
            found.append(w[2 * BLOCK :])
        return np.concatenate(found)

    return evaluate


def _units(found: np.ndarray, exact: list[mpmath.mpf]) -> float:
    """The largest error in units in the last place."""
    return max(
        float(abs(mpmath.mpf(float(v)) - e) / np.spacing(abs(float(e))))
        for v, e in zip(found, exact, strict=True)
    )


def _padded(values: list[float]) -> np.ndarray:
    return np.array(values + [1.0] * (-len(values) % BLOCK))


@pytest.mark.parametrize(
    ("largest", "units"), [(0.7, 1.5), (10.0, 2.0), (1e3, 2.0), (1e5, 2.5), (1e6, 1.0)]
)
def test_sine_and_cosine_err_by_little_more_than_rounding(
    sincos: Callable[..., tuple[np.ndarray, np.ndarray]], largest: float, units: float
) -> None:
    # Rounding of the reduced angle, of the polynomial's last sum and, where many turns are taken
    # away, of a difference before: half a unit each, doubled at most where the result lies in the
    # binade below. Beyond 1e5 the C library computes, within one unit.
    rng = np.random.default_rng(0)
    x = rng.uniform(-largest, largest, 16 * BLOCK)
    quarters = np.pi / 2 * rng.integers(-int(largest), int(largest) + 1, 16 * BLOCK) / 2
    with mpmath.workdps(60):
        for angles in (x, quarters):
            sine, cosine = sincos(angles)
            assert _units(sine, [mpmath.sin(float(v)) for v in angles]) < units
            assert _units(cosine, [mpmath.cos(float(v)) for v in angles]) < units


def test_sines_of_zeros_and_of_what_is_no_angle(
    sincos: Callable[..., tuple[np.ndarray, np.ndarray]],
) -> None:
    sine, cosine = sincos(_padded([0.0, -0.0]))
    np.testing.assert_array_equal(np.signbit(sine[:2]), [False, True])
    np.testing.assert_array_equal(cosine[:2], 1.0)
    for sums in sincos(_padded([np.nan, np.inf, -np.inf, 0.5])):
        np.testing.assert_array_equal(np.isnan(sums[:4]), [True, True, True, False])


def test_the_arc_tangent_errs_by_two_units_at_most(arctan2: Callable[..., np.ndarray]) -> None:
    # Rounding of the quotient, twice of the last sums, and of the difference to a right angle.
    rng = np.random.default_rng(1)
    for spread in (0, 3, 100):
        y, x = rng.normal(size=(2, 16 * BLOCK)) * 10.0 ** rng.uniform(
            -spread, spread, (2, 16 * BLOCK)
        )
        with mpmath.workdps(60):
            exact = [mpmath.atan2(float(b), float(a)) for b, a in zip(y, x, strict=True)]
            assert _units(arctan2(y, x), exact) < 2.0


def test_the_arc_tangent_knows_axes_diagonals_and_signs_of_zero(
    arctan2: Callable[..., np.ndarray],
) -> None:
    sides = [0.0, -0.0, 1.0, -1.0, 5e-324, 1e150, -1e150]
    x, y = map(_padded, np.reshape(np.meshgrid(sides, sides), (2, -1)).tolist())
    exact = np.arctan2(y, x)
    found = arctan2(y, x)
    np.testing.assert_allclose(found, exact, rtol=4.5e-16, atol=0)
    np.testing.assert_array_equal(np.signbit(found), np.signbit(exact))
    strange = _padded([np.nan, np.inf, -np.inf, 1e200])
    ones = np.ones_like(strange)
    for b, a in ((strange, ones), (ones, strange), (strange, strange)):
        np.testing.assert_allclose(arctan2(b, a), np.arctan2(b, a), rtol=4.5e-16, atol=0)


def _chebyshev(f: Callable[[mpmath.mpf], mpmath.mpf], end: mpmath.mpf, count: int) -> list[float]:
    """Coefficients of the polynomial through f at Chebyshev's points of (0, end)."""
    points = [
        end / 2 * (1 + mpmath.cos(mpmath.pi * (2 * k + 1) / (2 * count))) for k in range(count)
    ]
    powers = mpmath.matrix(count, count)
    for i, z in enumerate(points):
        for j in range(count):
            powers[i, j] = z**j
    return [float(c) for c in mpmath.lu_solve(powers, mpmath.matrix([f(z) for z in points]))]


def test_the_coefficients_are_those_of_chebyshevs_points() -> None:
    # sin r = r + r z P(z), cos r = 1 - z/2 + z² P(z), atan t = t + t z P(z) with z = r² or t²;
    # the intervals reach 2 % and 1 % beyond an eighth and a sixteenth of a turn, squared.
    source = getsource(rows)
    with mpmath.workdps(60):
        eighth = (mpmath.pi / 4) ** 2 * mpmath.mpf("1.02")
        sixteenth = mpmath.tan(mpmath.pi / 8) ** 2 * mpmath.mpf("1.01")
        root = mpmath.sqrt
        expected = [
            *_chebyshev(lambda z: (mpmath.sin(root(z)) / root(z) - 1) / z, eighth, 6),
            *_chebyshev(lambda z: (mpmath.cos(root(z)) - 1 + z / 2) / z**2, eighth, 6),
            *_chebyshev(lambda z: (mpmath.atan(root(z)) / root(z) - 1) / z, sixteenth, 11),
        ]
    for coefficient in expected:
        assert repr(coefficient) in source
