"""Power balance of the whole robot: what goes in stays in as energy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from phasmid import dynamics, kinematics
from phasmid.robot import Robot


class _Flight:
    """A smooth made-up motion of trunk and joints, with its exact derivatives."""

    def __init__(self, robot: Robot) -> None:
        rng = np.random.default_rng(7)
        shape = (len(robot.legs), 3)
        self.robot = robot
        self.size = rng.uniform(0.3, 1.0, size=shape)
        self.rate = rng.uniform(0.5, 2.0, size=shape)
        self.start = rng.uniform(-np.pi, np.pi, size=shape)
        self.angles = rng.uniform(0.3, 0.8, size=3), rng.uniform(0.5, 2.0, size=3)

    def joints(self, t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        s, r, phase = self.size, self.rate, self.start + self.rate * t
        return s * np.sin(phase), s * r * np.cos(phase), -s * r**2 * np.sin(phase)

    def trunk(self, t: float) -> dynamics.BodyMotion:
        size, rate = self.angles
        rpy, d = size * np.sin(rate * t), size * rate * np.cos(rate * t)
        dd = -(rate**2) * rpy
        # R = Rz(yaw) Ry(pitch) Rx(roll): each rate turns about its axis as the later ones left it.
        (sp, cp), (sy, cy) = ((np.sin(a), np.cos(a)) for a in rpy[1:])
        axes = np.array([[cy * cp, -sy, 0.0], [sy * cp, cy, 0.0], [-sp, 0.0, 1.0]])
        roll_axis = np.array(
            [-sy * d[2] * cp - cy * sp * d[1], cy * d[2] * cp - sy * sp * d[1], -cp * d[1]]
        )
        pitch_axis = np.array([-cy * d[2], -sy * d[2], 0.0])
        return dynamics.BodyMotion(
            position=np.array([np.sin(t), np.cos(1.3 * t), 0.4 * np.sin(0.7 * t)]),
            rotation=kinematics.rotation_rpy(*map(np.asarray, rpy)),
            velocity=np.array([np.cos(t), -1.3 * np.sin(1.3 * t), 0.28 * np.cos(0.7 * t)]),
            angular_velocity=axes @ d,
            acceleration=np.array([-np.sin(t), -1.69 * np.cos(1.3 * t), -0.196 * np.sin(0.7 * t)]),
            angular_acceleration=axes @ dd + roll_axis * d[0] + pitch_axis * d[1],
        )

    def energy(self, t: float) -> np.ndarray:
        body, (q, qd, _) = self.trunk(t), self.joints(t)
        kinetic = dynamics.kinetic_energy(self.robot, body, q, qd)
        return kinetic + dynamics.potential_energy(self.robot, body, q)


def test_power_of_joints_and_wrench_equals_the_rate_of_energy(
    robot: Robot, derivative: Callable[..., Any]
) -> None:
    # τ·q' + f·v + n·w = d(KE + PE)/dt, bound 1e-9 of the largest power (row 9). Energy's fastest
    # component turns at about 10 rad/s: truncation (10 * 0.01)^8 / 630 = 2e-11 of its rate, and
    # round-off 2e-16 * 50 J / 0.01 = 1e-12 W.
    flight, powers, rates = _Flight(robot), [], []
    for t in np.linspace(0.1, 3.0, 20):
        body, (q, qd, qdd) = flight.trunk(t), flight.joints(t)
        torque, wrench = dynamics.inverse_dynamics(robot, body, q, qd, qdd)
        twist = np.concatenate([body.velocity, body.angular_velocity])
        powers.append(np.sum(torque * qd) + wrench @ twist)
        rates.append(derivative(flight.energy, float(t)))
    scale = np.abs(rates).max()
    np.testing.assert_allclose(powers, rates, rtol=0, atol=1e-9 * scale)
    assert scale > 1.0


def test_kinetic_energy_of_a_robot_that_moves_as_a_whole_is_half_m_v_squared(robot: Robot) -> None:
    # No turning and no joint speeds: KE = m v² / 2, below 100 J, twenty terms: 1e-12.
    q = np.random.default_rng(1).normal(size=(len(robot.legs), 3))
    zero, v = np.zeros(3), np.array([1.0, -2.0, 3.0])
    body = dynamics.BodyMotion(zero, np.eye(3), v, zero, zero, zero)
    energy = dynamics.kinetic_energy(robot, body, q, np.zeros_like(q))
    np.testing.assert_allclose(energy, robot.mass * 14.0 / 2, rtol=0, atol=1e-12)


def test_kinetic_energy_of_a_leg_is_half_the_form_of_its_mass_matrix(
    robot: Robot, rng: np.random.Generator
) -> None:
    # KE = ½ q'ᵀ M q' summed over the legs, the trunk at rest; energies below 10 J: 1e-12.
    q, qd = rng.normal(size=(2, 50, len(robot.legs), 3)) * np.reshape([1.0, 5.0], (2, 1, 1, 1))
    M = dynamics.leg_matrices(robot.arrays, q).M
    expected = np.einsum("nli,nlij,nlj->n", qd, M, qd) / 2
    energy = dynamics.kinetic_energy(robot, dynamics.BodyMotion.at_rest(), q, qd)
    np.testing.assert_allclose(energy, expected, rtol=0, atol=1e-12)
