"""The closed form of one leg (Eqs. 10 and 11, corrected)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from general_robot import general_robot
from phasmid import dynamics, kinematics
from phasmid.robot import Robot, load_robot, with_mass_model

# Row 10 of the physics charter: 1e-10 N·m. Torques here are about 10 N·m at most, sums of some
# hundred terms, so round-off is below 100 * 2.2e-16 * 10 = 2e-13; a wrong term shows at 1e-5.
TORQUE = 1e-10


def _states(rng: np.random.Generator, robot: Robot, n: int = 1000) -> tuple[np.ndarray, ...]:
    shape = (n, len(robot.legs), 3)
    q = rng.uniform(-np.pi, np.pi, size=shape)
    return q, 5 * rng.normal(size=shape), 20 * rng.normal(size=shape), 10 * rng.normal(size=shape)


def _times(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    return (matrix @ vector[..., None])[..., 0]


def _products(qd: np.ndarray) -> np.ndarray:
    q1, q2, q3 = np.moveaxis(qd, -1, 0)
    return np.stack([q1 * q2, q1 * q3, q2 * q3], axis=-1)


def _christoffel(m: dynamics.LegMatrices, qd: np.ndarray) -> np.ndarray:
    """S with S q' = B [q' q'] + C [q'²], from symbols symmetric in their last two indices."""
    symbols = np.zeros((*qd.shape, 3, 3))
    for j in range(3):
        symbols[..., j, j] = m.C[..., :, j]
    for column, (j, k) in enumerate(((0, 1), (0, 2), (1, 2))):
        symbols[..., j, k] = symbols[..., k, j] = m.B[..., :, column] / 2
    return np.einsum("...ijk,...k->...ij", symbols, qd)


def test_the_matrices_add_up_to_the_leg_torque(robot: Robot, rng: np.random.Generator) -> None:
    # The left side is Eq. 10 with its four parts, the right one groups the same terms otherwise.
    q, qd, qdd, _ = _states(rng, robot)
    for i, leg in enumerate(robot.legs):
        m = dynamics.leg_matrices(leg, q[:, i])
        parts = _times(m.M, qdd[:, i]) + _times(m.B, _products(qd[:, i]))
        total = parts + _times(m.C, qd[:, i] ** 2) + m.G
        torque = dynamics.leg_torque(leg, q[:, i], qd[:, i], qdd[:, i])
        np.testing.assert_allclose(total, torque, rtol=0, atol=TORQUE)


def test_the_mass_matrix_is_symmetric_and_positive_definite(
    robot: Robot, rng: np.random.Generator
) -> None:
    q, *_ = _states(rng, robot)
    M = dynamics.leg_matrices(robot.arrays, q).M
    # Both halves are written from the same numbers, so that not even round-off differs.
    np.testing.assert_array_equal(M, np.swapaxes(M, -1, -2))
    assert np.linalg.eigvalsh(M).min() > 0


def test_mass_rate_less_twice_the_christoffel_matrix_is_skew(
    robot: Robot, rng: np.random.Generator, derivative: Callable[..., Any]
) -> None:
    # N = M' - 2 S with S q' = B [q' q'] + C [q'²]; then N + Nᵀ = 0, which makes power balance.
    # M' along q + t q', whose angles turn at 5 to 20 rad/s, twice that in M: truncation
    # (40 h)^8 / 630 = 4e-14 of M' at h = 5e-4, round-off 2e-16 / (40 h) = 1e-14 of it.
    q, qd, *_ = _states(rng, robot)
    rate = derivative(lambda t: dynamics.leg_matrices(robot.arrays, q + t * qd).M, 0.0, h=5e-4)
    S = _christoffel(dynamics.leg_matrices(robot.arrays, q), qd)
    N = rate - 2 * S
    bound = 1e-11 * np.abs(rate).max()
    np.testing.assert_allclose(N + np.swapaxes(N, -1, -2), 0.0, rtol=0, atol=bound)
    assert np.abs(N).max() > 1e-2 * np.abs(rate).max()


def test_the_ground_pushing_up_relieves_a_horizontal_leg() -> None:
    # A leg stretched out level, a force F up at its foot: Jᵀ F = (0, (Lf + Lt) F, Lt F).
    # Numbers below 10 N·m, so 1e-14 is a few units in the last place.
    leg = load_robot("phantomx-paper").legs[0]
    still, up = np.zeros(3), np.array([0.0, 0.0, 10.0])
    unloaded = dynamics.leg_torque(leg, still, still, still)
    loaded = dynamics.leg_torque(leg, still, still, still, foot_force=up)
    np.testing.assert_allclose(unloaded - loaded, [0.0, 2.22, 1.40], rtol=0, atol=1e-14)


def test_without_gravity_a_leg_at_rest_needs_no_torque(
    robot: Robot, rng: np.random.Generator
) -> None:
    q, *_ = _states(rng, robot, 5)
    rest = np.zeros_like(q)
    torque = dynamics.leg_torque(robot.arrays, q, rest, rest, gravity=0.0)
    np.testing.assert_array_equal(torque, 0.0)


@pytest.mark.parametrize("lead", [(), (4,), (2, 3)])
def test_leading_axes_broadcast(robot: Robot, lead: tuple[int, ...]) -> None:
    # The same arithmetic on torques below 1 N·m, whatever the order in which loops take it:
    # equal within a few units in the last place.
    leg = robot.legs[0]
    q = np.random.default_rng(3).normal(size=(*lead, 3))
    qd, qdd = np.array([1.0, 2.0, 3.0]), np.array([-1.0, 0.5, 2.0])
    force = kinematics.foot_position(leg, q)
    torque = dynamics.leg_torque(leg, q, qd, qdd, foot_force=force)
    assert torque.shape == (*lead, 3)
    for index in np.ndindex(*lead):
        one = dynamics.leg_torque(leg, q[index], qd, qdd, foot_force=force[index])
        np.testing.assert_allclose(torque[index], one, rtol=0, atol=1e-15)
    shapes = [part.shape for part in dynamics.leg_matrices(leg, q)]
    assert shapes == [(*lead, 3, 3)] * 3 + [(*lead, 3)]


def test_gravity_on_a_tilted_hip_is_the_slope_of_the_height(
    rng: np.random.Generator, derivative: Callable[..., Any]
) -> None:
    # G = d V / d q with V the sum of m g z over a level trunk: differences of eighth order over
    # 0.01 rad err by 0.01⁸ / 630 = 2e-19 of it, round-off of 10 J by 2e-16 * 10 / 0.01 = 2e-13.
    robot = general_robot()
    q = rng.uniform(-np.pi, np.pi, size=(50, len(robot.legs), 3))
    body = dynamics.BodyMotion.at_rest()
    for i, leg in enumerate(robot.legs):
        G = dynamics.leg_matrices(leg, q[:, i], gravity=3.7).G
        for joint in range(3):
            step = np.zeros((len(robot.legs), 3))
            step[i, joint] = 1.0

            def height(t: float, step: np.ndarray = step) -> np.ndarray:
                return dynamics.potential_energy(robot, body, q + t * step, gravity=3.7)

            np.testing.assert_allclose(G[:, joint], derivative(height, 0.0), rtol=0, atol=1e-12)


def test_tilting_the_hip_is_tilting_gravity() -> None:
    # A leg on a hip turned by R feels gravity along R' (0, 0, -g); a pitch of 90° points the leg
    # straight down, and gravity along its x: hanging straight, no joint turns.
    leg = with_mass_model(load_robot("phantomx-paper"), "mid-length").legs[0]
    leg = replace(leg, mount_pitch=np.pi / 2)
    np.testing.assert_allclose(leg.X_body_hip[:3, 0], [0.0, 0.0, -1.0], rtol=0, atol=1e-15)
    G = dynamics.leg_matrices(leg, np.zeros(3)).G
    np.testing.assert_allclose(G, 0.0, rtol=0, atol=1e-15)
    # Turned aside by the coxa it is a pendulum of the whole leg: sum of m g x sin q1.
    c, f, t = leg.links
    arm = c.mass * c.length / 2 + f.mass * (c.length + f.length / 2)
    arm += t.mass * (c.length + f.length + t.length / 2)
    G = dynamics.leg_matrices(leg, np.array([0.3, 0.0, 0.0])).G
    assert G[0] == pytest.approx(9.81 * arm * np.sin(0.3), abs=1e-12)
