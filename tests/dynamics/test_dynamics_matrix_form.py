"""The equation of motion, against Pinocchio, which shares no line of code, and itself."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pinocchio as pin
import pytest

from dynamics.pinocchio_model import foot_loads, free_state, pinocchio_model
from phasmid import dynamics, kinematics
from phasmid.errors import InvalidInput
from phasmid.units import STANDARD_GRAVITY

STATES = 300

# Entries reach 200 (kg, kg·m², N, N·m), sums of some thousand terms in which round-off adds at
# random: about 30 * 2.2e-16 * 200 = 1e-12. A wrong term shows at 1e-5.
WHOLE = 1e-10


class State(NamedTuple):
    body: dynamics.BodyMotion
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray

    @property
    def speeds(self):
        """(v, w, q')."""
        flat = self.qd.reshape(len(self.qd), -1)
        return np.concatenate([self.body.velocity, self.body.angular_velocity, flat], axis=1)

    def from_body_axes(self):
        """The matrix E with (v, w, q') = E (Pinocchio's speeds), which turns v and w."""
        E = np.broadcast_to(np.eye(self.speeds.shape[1]), (len(self.q), *2 * self.speeds.shape[1:]))
        E = E.copy()
        E[:, :3, :3] = E[:, 3:6, 3:6] = self.body.rotation
        return E


@pytest.fixture
def state(robot, rng):
    quaternion = rng.normal(size=(STATES, 4))
    quaternion /= np.linalg.norm(quaternion, axis=-1, keepdims=True)
    p, v, w, a, dw = rng.normal(size=(5, STATES, 3)) * np.reshape([1, 1, 3, 5, 20], (5, 1, 1))
    R = kinematics.quaternion_rotation(quaternion)
    shape = (STATES, len(robot.legs), 3)
    q = rng.uniform(-np.pi, np.pi, size=shape)
    qd, qdd = 5 * rng.normal(size=shape), 20 * rng.normal(size=shape)
    return State(dynamics.BodyMotion(p, R, v, w, a, dw), q, qd, qdd)


def _times(matrix, vector):
    return (matrix @ vector[..., None])[..., 0]


def test_everything_equals_pinocchio(robot, state):
    # Pinocchio's speeds are (R^T v, R^T w, q'). Its bias also holds R^T v turning with the trunk:
    # h' = h + M' (w x v of the trunk's axes, 0, 0), so that this term is taken off.
    model = pinocchio_model(robot)
    data = model.createData()
    E = state.from_body_axes()
    body, q, qd = state.body, state.q, state.qd
    masses, biases, holds, centroidal, energies, heights, feet, loads = ([] for _ in range(8))
    pushes = 10 * np.random.default_rng(4).normal(size=q.shape)
    for at, speeds, rates, push in zip(*free_state(body, q, qd, state.qdd), pushes, strict=True):
        loads.append(pin.rnea(model, data, at, speeds, rates, foot_loads(model, at, push)))
        M = pin.crba(model, data, at)
        M = np.triu(M) + np.triu(M, 1).T
        turning = np.zeros_like(speeds)
        turning[:3] = np.cross(speeds[3:6], speeds[:3])
        masses.append(M)
        biases.append(pin.nonLinearEffects(model, data, at, speeds) - M @ turning)
        holds.append(pin.computeGeneralizedGravity(model, data, at).copy())
        centroidal.append(pin.computeCentroidalMomentum(model, data, at, speeds).vector)
        energies.append(pin.computeKineticEnergy(model, data, at, speeds))
        heights.append(pin.computePotentialEnergy(model, data, at))
        pin.computeJointJacobians(model, data, at)
        axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        feet.append(
            [
                pin.getFrameJacobian(model, data, model.getFrameId(f"foot_{i}"), axes)[:3].copy()
                for i in range(len(robot.legs))
            ]
        )

    close = {"rtol": 0, "atol": WHOLE}
    torque, wrench = dynamics.inverse_dynamics(
        robot, body, q, qd, state.qdd, foot_force=pushes, gravity=STANDARD_GRAVITY
    )
    ours = np.concatenate([wrench, torque.reshape(STATES, -1)], axis=1)
    np.testing.assert_allclose(ours, _times(E, np.array(loads)), **close)
    masses = E @ np.array(masses) @ np.swapaxes(E, -1, -2)
    np.testing.assert_allclose(dynamics.mass_matrix(robot, body, q), masses, **close)
    bias = dynamics.bias_force(robot, body, q, qd, gravity=STANDARD_GRAVITY)
    np.testing.assert_allclose(bias, _times(E, np.array(biases)), **close)
    gravity = dynamics.gravity_force(robot, body, q, gravity=STANDARD_GRAVITY)
    np.testing.assert_allclose(gravity, _times(E, np.array(holds)), **close)
    momentum = np.concatenate(dynamics.momentum(robot, body, q, qd), axis=1)
    np.testing.assert_allclose(momentum, centroidal, **close)
    np.testing.assert_allclose(dynamics.kinetic_energy(robot, body, q, qd), energies, **close)
    np.testing.assert_allclose(
        dynamics.potential_energy(robot, body, q, gravity=STANDARD_GRAVITY), heights, **close
    )
    J = dynamics.foot_jacobian(robot, body, q)
    np.testing.assert_allclose(J, np.array(feet) @ np.swapaxes(E, -1, -2)[:, None], **close)


def test_forward_dynamics_undoes_inverse_dynamics(robot, state):
    # Row 12: 1e-9 of accelerations up to 1e4. The trunk is made to feel no other wrench than that
    # of the feet by starting from torques and forces. The mass matrix's condition is below 1e5:
    # round-off 1e5 * 2.2e-16 * 1e4 m/s² = 2e-7, relative to the largest 2e-11.
    body, q, qd, _ = state
    rng = np.random.default_rng(3)
    torque, force = rng.normal(size=(2, *q.shape))
    made = dynamics.forward_dynamics(
        robot, body, q, qd, torque, foot_force=force, gravity=STANDARD_GRAVITY
    )
    moved = replace(
        body, acceleration=made.acceleration, angular_acceleration=made.angular_acceleration
    )
    needed = dynamics.inverse_dynamics(
        robot, moved, q, qd, made.qdd, foot_force=force, gravity=STANDARD_GRAVITY
    )
    np.testing.assert_allclose(needed.joint_torque, torque, rtol=0, atol=1e-9)
    np.testing.assert_allclose(needed.wrench, 0.0, rtol=0, atol=1e-9)
    assert np.abs(made.qdd).max() > 1.0


def test_one_trunk_serves_any_number_of_joint_states(robot):
    # The same arithmetic whatever the leading axes; entries below 100 within units in the last
    # place.
    body = dynamics.BodyMotion.at_rest(np.array([0.1, 0.2, 0.3]))
    q, qd = np.random.default_rng(5).normal(size=(2, 2, 3, len(robot.legs), 3))
    works = {
        "mass": lambda i: dynamics.mass_matrix(robot, body, q[i]),
        "bias": lambda i: dynamics.bias_force(robot, body, q[i], qd[i], gravity=STANDARD_GRAVITY),
        "gravity": lambda i: dynamics.gravity_force(robot, body, q[i], gravity=STANDARD_GRAVITY),
        "momentum": lambda i: dynamics.momentum(robot, body, q[i], qd[i]).angular,
        "feet": lambda i: dynamics.foot_jacobian(robot, body, q[i]),
        "kinetic": lambda i: dynamics.kinetic_energy(robot, body, q[i], qd[i]),
        "potential": lambda i: dynamics.potential_energy(
            robot, body, q[i], gravity=STANDARD_GRAVITY
        ),
    }
    for name, work in works.items():
        whole = work(())
        assert whole.shape[:2] == (2, 3), name
        for i in np.ndindex(2, 3):
            np.testing.assert_allclose(whole[i], work(i), rtol=0, atol=1e-12, err_msg=name)


def test_a_falling_robot_feels_nothing_and_a_resting_one_its_weight(robot, state):
    body, q, *_ = state
    still, zero = np.zeros_like(q), np.zeros(3)
    rest = dynamics.BodyMotion.at_rest(body.position, body.rotation)
    fall = replace(rest, velocity=body.velocity, acceleration=zero - [0.0, 0.0, 9.81])
    # Every link falls by itself: -9.81 + 9.81 is exactly 0.
    for part in dynamics.inverse_dynamics(robot, fall, q, still, still, gravity=STANDARD_GRAVITY):
        np.testing.assert_array_equal(part, 0.0)
    # f = (0, 0, m g), n = r × f with r from the body's origin to the centre of mass. Weights
    # reach 50 N in sums of twenty links: 20 * 2.2e-16 * 50 = 2e-13.
    wrench = dynamics.inverse_dynamics(
        robot, rest, q, still, still, gravity=STANDARD_GRAVITY
    ).wrench
    weight = np.broadcast_to([0.0, 0.0, robot.mass * 9.81], (STATES, 3))
    arm = _times(body.rotation, kinematics.centre_of_mass(robot, q))
    expected = np.concatenate([weight, np.cross(arm, weight)], axis=-1)
    np.testing.assert_allclose(wrench, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    "matrix", [np.diag([1.0, 1.0, 1.1]), np.diag([1.0, 1.0, -1.0])], ids=["stretched", "mirrored"]
)
def test_a_matrix_that_is_no_rotation_is_refused(matrix):
    with pytest.raises(InvalidInput, match="rotation is not a rotation"):
        dynamics.BodyMotion.at_rest(rotation=matrix)
