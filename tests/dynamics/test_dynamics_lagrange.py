"""The closed form of one leg against Lagrange's equations, derived by computer algebra."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import sympy as sp

from phasmid import dynamics
from phasmid.robot import Leg, Robot

# Torques below 10 N·m, as in row 10 of the physics charter; entries are sums of some hundred
# terms, so that round-off stays below 100 * 2.2e-16 * 10 = 2e-13.
TORQUE = 1e-10


def _numbers(leg: Leg) -> list[float]:
    numbers = [*leg.lengths[:2]]
    for link in leg.links:
        t = link.inertia
        numbers += [link.mass, *link.com, *np.diag(t), t[0, 1], t[0, 2], t[1, 2]]
    return numbers


@pytest.fixture(scope="module")
def lagrange() -> Callable[..., list[np.ndarray]]:
    """M, B, C, G as functions of three angles and the numbers of the leg.

    Energies come from the Denavit-Hartenberg chain of Table 1 alone: T = ½ Σ (m v·v + w·I w)
    and V = Σ m g z. Then d/dt ∂T/∂q' - ∂T/∂q + ∂V/∂q = torque.
    """
    q, qd = sp.symbols("q1:4"), sp.symbols("w1:4")
    coxa, femur = lengths = sp.symbols("coxa femur")
    X, spin, numbers = sp.eye(4), sp.zeros(3, 1), list(lengths)
    kinetic, potential = sp.Integer(0), sp.Integer(0)
    for k, (alpha, a) in enumerate(((0, 0), (sp.pi / 2, coxa), (0, femur))):
        ca, sa, ct, st = sp.cos(alpha), sp.sin(alpha), sp.cos(q[k]), sp.sin(q[k])
        X *= sp.Matrix(
            [[ct, -st, 0, a], [st * ca, ct * ca, -sa, 0], [st * sa, ct * sa, ca, 0], [0, 0, 0, 1]]
        )
        R = X[:3, :3]
        spin += R[:, 2] * qd[k]
        names = ("m", "x", "y", "z", "xx", "yy", "zz", "xy", "xz", "yz")
        own = m, x, y, z, xx, yy, zz, xy, xz, yz = sp.symbols(
            " ".join(f"{name}_{k}" for name in names)
        )
        numbers += own
        inertia = sp.Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        point = (X * sp.Matrix([x, y, z, 1]))[:3, :]
        velocity = point.jacobian(q) * sp.Matrix(qd)
        spin_in_link = R.T * spin
        energy = m * velocity.dot(velocity) + spin_in_link.dot(inertia * spin_in_link)
        kinetic, potential = kinetic + energy / 2, potential + m * sp.Float(9.81) * point[2]

    M = sp.hessian(kinetic, qd)
    momentum_rate = sum((M.diff(q[k]) * qd[k] for k in range(3)), sp.zeros(3, 3)) * sp.Matrix(qd)
    # The velocity terms are a quadratic form; its values at unit speeds give its coefficients.
    speeds = momentum_rate - sp.Matrix([kinetic]).jacobian(q).T
    gravity = sp.Matrix([potential]).jacobian(q).T
    inputs = (*q, *qd, *numbers)
    mass, form, weight = (sp.lambdify(inputs, e, cse=True) for e in (M, speeds, gravity))

    def evaluate(angles: np.ndarray, leg: Leg) -> list[np.ndarray]:
        values = _numbers(leg)
        unit = np.eye(3)

        def at(w: np.ndarray) -> np.ndarray:
            return np.ravel(form(*angles, *w, *values))

        C = np.stack([at(unit[j]) for j in range(3)], axis=-1)
        pairs = ((0, 1), (0, 2), (1, 2))
        B = np.stack([at(unit[j] + unit[k]) - C[:, j] - C[:, k] for j, k in pairs], axis=-1)
        still = np.zeros(3)
        return [mass(*angles, *still, *values), B, C, np.ravel(weight(*angles, *still, *values))]

    return evaluate


def test_leg_matrices_equal_those_of_lagranges_equations(
    robot: Robot, rng: np.random.Generator, lagrange: Callable[..., list[np.ndarray]]
) -> None:
    for leg in (robot.legs[0], robot.legs[-1]):
        angles = rng.uniform(-np.pi, np.pi, size=(500, 3))
        derived = [lagrange(q, leg) for q in angles]
        for i, part in enumerate(dynamics.leg_matrices(leg, angles)):
            expected = np.array([parts[i] for parts in derived])
            np.testing.assert_allclose(part, expected, rtol=0, atol=TORQUE)
