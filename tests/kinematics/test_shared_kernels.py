"""Formulas that arrays and compiled code share."""

from fractions import Fraction

import numpy as np
import pytest

from phasmid.kinematics import (
    quaternion_rotation,
    rotated,
    rpy_quaternion,
    shared_kernels,
    vector_kernels,
)

ULP = 2.0**-52


@pytest.mark.parametrize(
    ("name", "count"), [("quintic", 1), ("turned", 3), ("rpy_rows", 3), ("quaternion_rows", 4)]
)
def test_compiled_formulas_are_those_of_arrays(name, count):
    # Sines and cosines of both libraries are within an ulp of the true ones; each entry is a sum of
    # two products of up to three of them, of sizes up to 1.
    formula = getattr(shared_kernels, name)
    samples = np.random.default_rng(8).uniform(-1, 1, (count, 50))
    want = np.array(formula(*samples))
    kernel = getattr(vector_kernels, name)
    found = np.array([kernel(*sample) for sample in samples.T.tolist()])
    np.testing.assert_allclose(np.moveaxis(found, 0, -1), want, rtol=0, atol=16 * ULP)


def test_a_quintic_is_its_polynomial_to_some_ulps():
    # Against 10 u³ - 15 u⁴ + 6 u⁵ and its derivatives in exact arithmetic: five roundings of
    # numbers below 32 u³ at the start, where the terms differ most.
    for u in np.linspace(0.0, 1.0, 101).tolist():
        x = Fraction(u)
        exact = (
            10 * x**3 - 15 * x**4 + 6 * x**5,
            30 * x**2 - 60 * x**3 + 30 * x**4,
            60 * x - 180 * x**2 + 120 * x**3,
        )
        for found, want, size in zip(shared_kernels.quintic(u), exact, (32, 120, 360), strict=True):
            assert abs(Fraction(found) - want) <= 6 * ULP * size


def test_a_quaternion_rotates_vectors_as_its_matrix_does():
    # Each row is a sum of three products of numbers below 2.
    from phasmid.simulation.sensors.models import rotated_vector

    q = rpy_quaternion(*np.random.default_rng(2).uniform(-3, 3, (3, 20)))
    v = np.random.default_rng(3).normal(size=(20, 3))
    np.testing.assert_allclose(rotated_vector(q, v), rotated(quaternion_rotation(q), v), atol=1e-15)
