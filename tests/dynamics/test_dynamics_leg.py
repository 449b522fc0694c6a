"""The closed form of one leg (Eqs. 10 and 11, corrected)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from general_robot import general_robot
from phasmid import dynamics, kinematics
from phasmid.robot import Robot

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


def test_the_matrices_add_up_to_the_leg_torque(robot: Robot, rng: np.random.Generator) -> None:
    # The left side is Eq. 10 with its four parts, the right one groups the same terms otherwise.
    q, qd, qdd, _ = _states(rng, robot)
    for i, leg in enumerate(robot.legs):
        m = dynamics.leg_matrices(leg, q[:, i])
        parts = _times(m.M, qdd[:, i]) + _times(m.B, _products(qd[:, i]))
        total = parts + _times(m.C, qd[:, i] ** 2) + m.G
        torque = dynamics.leg_torque(leg, q[:, i], qd[:, i], qdd[:, i])
        np.testing.assert_allclose(total, torque, rtol=0, atol=TORQUE)


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
