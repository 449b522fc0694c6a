"""Loads of a robot whose feet are balls, against MuJoCo's model of the same file."""

import mujoco
import numpy as np

from phasmid.control.feed_forward.feed_forward import FeedForward, solve
from phasmid.dynamics import BodyMotion, inverse_dynamics
from phasmid.forces import (
    Contacts,
    JointLoad,
    contact_jacobian,
    contact_points,
    holding_forces,
    share_load,
)
from phasmid.formats import import_robot
from phasmid.kinematics import body_from_hip, foot_position, rotation_rpy
from phasmid.scenario import load_scenario
from phasmid.terrain import Ground, Slope
from phasmid.units import STANDARD_GRAVITY
from support.ball_dog import ball_dog

CROUCH = (0.1, 0.9, -1.8)
"""Angles of each leg in the file [rad]: shanks lean by 0.9 rad."""

ROUND_OFF = 1e-9
"""Beyond the round-off of sums of ten terms of 100 N and 1 m, with a condition of 1e3."""


class Dog:
    """The robot of the file in both programs, its trunk turned.

    Attributes:
        forces: MuJoCo's ground reaction forces of least norm [N], shape (L, 3).
        torque: MuJoCo's joint torques under them, in phasmid's order and signs [N·m].
    """

    def __init__(self, folder, attitude, normal, *, vertical, pose=CROUCH):
        path = ball_dog(folder)
        imported = import_robot(path)
        self.robot, legs = imported.robot, imported.legs
        self.rotation = rotation_rpy(*np.reshape(attitude, (3, 1)))[0]
        model = mujoco.MjModel.from_xml_path(str(path))
        data = mujoco.MjData(model)
        mujoco.mju_mat2Quat(data.qpos[3:7], self.rotation.ravel())
        joints = np.array([[model.joint(name).id for name in leg.joints] for leg in legs])
        data.qpos[model.jnt_qposadr[joints]] = pose
        mujoco.mj_forward(model, data)
        signs, offsets = (np.array([getattr(leg, n) for leg in legs]) for n in ("signs", "offsets"))
        self.q = signs * pose + offsets
        self.position = data.qpos[:3].copy()
        rows = []
        for leg in legs:
            body = model.body(leg.chain.links[2].name).id
            (ball,) = np.flatnonzero(model.geom_bodyid == body)
            J = np.empty((3, model.nv))
            point = data.geom_xpos[ball] - model.geom_size[ball, 0] * normal
            mujoco.mj_jac(model, data, J, None, point, body)
            rows.append(J[2:] if vertical else J)
        J = np.concatenate(rows)
        solved = np.linalg.lstsq(J[:, :6].T, data.qfrc_bias[:6], rcond=1e-12)[0]
        torque = data.qfrc_bias - J.T @ solved
        self.torque = signs * torque[model.jnt_dofadr[joints]]
        self.forces = np.zeros((len(legs), 3))
        self.forces[:, 2 if vertical else slice(None)] = solved.reshape(len(legs), -1).squeeze()

    @property
    def feet(self):
        p = body_from_hip(self.robot, foot_position(self.robot.arrays, self.q))
        return p @ self.rotation.T + self.position


def test_vertical_forces_act_beneath_the_centres_of_the_balls(tmp_path):
    """A crouching dog's loads without friction are those of MuJoCo's Jacobians below the balls."""
    up = np.array([0.0, 0.0, 1.0])
    dog = Dog(tmp_path, (0.0, 0.0, 0.0), up, vertical=True)
    robot, q = dog.robot, dog.q
    body = BodyMotion.at_rest(dog.position, dog.rotation)
    needed = inverse_dynamics(robot, body, q, 0 * q, 0 * q, gravity=STANDARD_GRAVITY)
    joints = JointLoad(contact_jacobian(robot, q, dog.rotation, up), needed.joint_torque)
    feet = contact_points(robot, dog.feet, up) - dog.position
    contacts = Contacts(feet, np.ones(4), friction=0.0)
    force = share_load(contacts, needed.wrench, "friction-cone", joints=joints)
    np.testing.assert_allclose(force, dog.forces, rtol=0, atol=ROUND_OFF)
    np.testing.assert_allclose(joints.with_ground(force), dog.torque, rtol=0, atol=ROUND_OFF)


def test_forces_along_the_ground_turn_the_shank_about_the_centre_of_its_ball(tmp_path):
    """On a slope the friction's moment about the centre, 20 mm away, reaches the joints."""
    slope = 0.3
    normal = np.array([-slope, 0.0, 1.0]) / np.hypot(1, slope)
    dog = Dog(tmp_path, (0.05, -np.arctan(slope), 0.0), normal, vertical=False)
    ground = Ground(Slope(np.arctan(slope)), 0.8)
    np.testing.assert_allclose(ground.normal(np.zeros(1), np.zeros(1))[0], normal, atol=1e-15)
    scenario = load_scenario("paper").replace(
        robot=dog.robot, gait="crawl", force_model="minimum-norm"
    )
    stands = np.ones(4, dtype=bool)
    load = holding_forces(
        scenario.build(), dog.position, dog.rotation, dog.q, dog.feet, stands, ground
    )
    np.testing.assert_allclose(load.force, dog.forces, rtol=0, atol=ROUND_OFF)
    np.testing.assert_allclose(load.torque, dog.torque, rtol=0, atol=ROUND_OFF)
    # The moment about the centre alone, 20 mm times the friction of each foot, is no round-off.
    along = load.force - (load.force @ normal)[:, None] * normal
    assert np.linalg.norm(0.02 * along, axis=1).min() > 0.1


def test_the_controller_shares_the_same_loads(tmp_path):
    """The compiled feed-forward gives the torques of the analysis, on the same slope."""
    slope = 0.3
    normal = np.array([-slope, 0.0, 1.0]) / np.hypot(1, slope)
    dog = Dog(tmp_path, (0.05, -np.arctan(slope), 0.0), normal, vertical=False)
    stage = FeedForward(dog.robot, gravity=STANDARD_GRAVITY)
    state = stage.state
    state.motion.R_world_body[:], state.motion.q[:] = dog.rotation, dog.q
    state.normals[:] = normal
    solve(stage._states[0], stage._robots[0])
    np.testing.assert_allclose(state.foot_force, dog.forces, rtol=0, atol=1e-7)
    np.testing.assert_allclose(state.joint_torque, dog.torque, rtol=0, atol=1e-7)
