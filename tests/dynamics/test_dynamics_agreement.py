"""The recursion and Pinocchio share no line of code; check 10 of tests/physics has other ways."""

import numpy as np
import pinocchio as pin

from dynamics.pinocchio_model import foot_loads, free_state, pinocchio_model
from phasmid import dynamics, kinematics

STATES = 3000

# Row 10 of the physics charter. Torques reach 10 N·m and forces 200 N as sums of some thousand
# terms in which round-off adds at random: about 30 * 2.2e-16 * 200 = 1e-12. A wrong term shows
# at 1e-5.
TORQUE = 1e-10


def _joints(robot, rng):
    shape = (STATES, len(robot.legs), 3)
    q = rng.uniform(-np.pi, np.pi, size=shape)
    return q, 5 * rng.normal(size=shape), 20 * rng.normal(size=shape), 10 * rng.normal(size=shape)


def test_recursion_and_pinocchio_give_the_same_torques_and_wrench_in_flight(robot, rng):
    q, qd, qdd, force = _joints(robot, rng)
    quaternion = rng.normal(size=(STATES, 4))
    quaternion /= np.linalg.norm(quaternion, axis=-1, keepdims=True)
    p, v, w, a, dw = rng.normal(size=(5, STATES, 3)) * np.reshape([1, 1, 3, 5, 20], (5, 1, 1))
    R = kinematics.quaternion_rotation(quaternion)
    body = dynamics.BodyMotion(p, R, v, w, a, dw)
    torque, wrench = dynamics.inverse_dynamics(robot, body, q, qd, qdd, foot_force=force)
    ours = np.concatenate([wrench, torque.reshape(STATES, -1)], axis=1)

    # Pinocchio's free joint moves along the trunk's own axes.
    model = pinocchio_model(robot)
    data = model.createData()
    pairs = zip(*free_state(body, q, qd, qdd), force, strict=True)
    theirs = np.array(
        [pin.rnea(model, data, *one[:3], foot_loads(model, one[0], one[3])) for one in pairs]
    )
    for part in (slice(0, 3), slice(3, 6)):
        theirs[:, part] = (R @ theirs[:, part, None])[..., 0]
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=TORQUE)
