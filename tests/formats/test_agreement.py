"""MuJoCo and Pinocchio find our own equations in the files that we write."""

from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from formats.tetrahedron import CORNERS, FACES
from formats.trees import ROBOTS, files_of, write
from phasmid import dynamics, kinematics
from phasmid.formats.urdf_in import read_urdf
from phasmid.formats.urdf_out import urdf_files
from phasmid.robot import JOINTS, Appearance, Part, Robot, load_robot

STATES = 20

# Entries reach 5 (kg, kg·m²), sums of some hundred terms, of inertias that MuJoCo keeps as
# principal moments; round-off is of order 1e-14. Files that kept 6 digits would show 1e-6.
CLOSE = 1e-12


@dataclass
class Written:
    robot: Robot
    path: Path
    quaternion: np.ndarray
    position: np.ndarray
    q: np.ndarray

    @property
    def rotation(self):
        return kinematics.quaternion_rotation(self.quaternion)

    @property
    def joint_names(self):
        return [f"{leg.name}_{joint}" for leg in self.robot.legs for joint in JOINTS]

    def ours(self, *, linear):
        """Our mass matrices for a trunk whose turning, or also velocity, is in its own axes."""
        zero = np.zeros((STATES, 3))
        body = dynamics.BodyMotion(self.position, self.rotation, *[zero] * 4)
        M = dynamics.mass_matrix(self.robot, body, self.q)
        E = np.broadcast_to(np.eye(M.shape[-1]), M.shape).copy()
        E[:, 3:6, 3:6] = self.rotation
        if linear:
            E[:, :3, :3] = self.rotation
        return np.swapaxes(E, -1, -2) @ M @ E


@pytest.fixture(params=ROBOTS)
def written(request, tmp_path):
    robot = ROBOTS[request.param]
    path = write(files_of(robot, ".urdf"), tmp_path)
    rng = np.random.default_rng(8)
    quaternion = rng.normal(size=(STATES, 4))
    quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    q = rng.uniform(-np.pi, np.pi, (STATES, len(robot.legs), 3))
    return Written(robot, path, quaternion, rng.normal(size=(STATES, 3)), q)


@pytest.mark.parametrize("suffix", [".urdf", ".xml"])
def test_mujoco_reads_the_same_mass_matrix(written, suffix, tmp_path):
    """M less the rotors' own is ours, and limits are those of the legs."""
    spec = mujoco.MjSpec.from_file(str(write(files_of(written.robot, suffix), tmp_path)))
    if suffix == ".urdf":
        spec.body("base_link").add_freejoint()
    model = spec.compile()
    data = mujoco.MjData(model)
    assert [model.joint(i).name for i in range(1, model.njnt)] == written.joint_names
    M = np.empty((STATES, model.nv, model.nv))
    for i in range(STATES):
        data.qpos = np.concatenate(
            [written.position[i], written.quaternion[i], written.q[i].ravel()]
        )
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, M[i])
        M[i] -= np.diag(model.dof_armature)
    np.testing.assert_allclose(M, written.ours(linear=False), rtol=0, atol=CLOSE)
    limits = np.concatenate([leg.joint_limits for leg in written.robot.legs])
    np.testing.assert_array_equal(model.jnt_range[1:], limits)
    if suffix == ".urdf":
        # Ball, shape by shape: one collision sphere under each leg.
        assert int(np.count_nonzero(model.geom_contype)) == len(written.robot.legs)


def test_pinocchio_reads_the_same_mass_matrix(written):
    pin = pytest.importorskip("pinocchio")
    model = pin.buildModelFromUrdf(str(written.path), pin.JointModelFreeFlyer())
    data = model.createData()
    ids = [model.getJointId(name) for name in written.joint_names]
    at = [model.joints[i].idx_q for i in ids]
    order = [*range(6), *(model.joints[i].idx_v for i in ids)]
    M = np.empty((STATES, model.nv, model.nv))
    for i in range(STATES):
        w, x, y, z = written.quaternion[i]
        configuration = np.empty(model.nq)
        configuration[:7] = *written.position[i], x, y, z, w
        configuration[at] = written.q[i].ravel()
        upper = np.triu(pin.crba(model, data, configuration))
        M[i] = (upper + np.triu(upper, 1).T)[np.ix_(order, order)]
    np.testing.assert_allclose(M, written.ours(linear=True), rtol=0, atol=CLOSE)


def test_mujoco_finds_the_meshes(tmp_path):
    part = Part(0.5 * CORNERS, FACES, name="shell")
    look = Appearance.of({"body": (part,), "coxa": (part,)})
    robot = replace(load_robot("phantomx-paper"), appearance=look)
    path = write(files_of(robot, ".urdf"), tmp_path)
    text = path.read_text(encoding="utf-8")
    told = text.replace("<compiler ", '<compiler discardvisual="false" ')
    path.write_text(told, encoding="utf-8")
    spec = mujoco.MjSpec.from_file(str(path))
    assert [mesh.file for mesh in spec.meshes] == ["robot_meshes/base_link_shell.stl"]
    assert spec.compile().ngeom == 7 + 6


ROTATED = """<robot name="r">
  <link name="base"><inertial><mass value="2"/>
    <inertia ixx="0.02" ixy="0.001" ixz="0.002" iyy="0.03" iyz="-0.003" izz="0.04"/></inertial>
  </link>
  <link name="a"><inertial><origin xyz="0.1 0.2 -0.3" rpy="0.4 -0.5 0.6"/><mass value="0.5"/>
    <inertia ixx="0.002" ixy="0.0001" ixz="0.0002" iyy="0.003" iyz="0.0003" izz="0.004"/></inertial>
  </link>
  <link name="b"><inertial><origin xyz="0.1 0 0" rpy="1 1.5707963267948966 2"/><mass value="0.1"/>
    <inertia ixx="0.0002" ixy="0" ixz="0" iyy="0.0003" iyz="0" izz="0.0004"/></inertial></link>
  <joint name="hip" type="revolute"><parent link="base"/><child link="a"/><axis xyz="1 2 3"/>
    <origin xyz="0.1 0.2 0.3" rpy="3 -1.5707963267948966 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="knee" type="continuous"><parent link="a"/><child link="b"/>
    <origin xyz="0 -0.2 0.3" rpy="0.1 0.2 -0.3"/></joint>
</robot>
"""


def test_a_foreign_file_is_the_same_robot_after_reading_and_writing(tmp_path):
    """Pinocchio finds the same mass matrix in the file and in what we make of it."""
    pin = pytest.importorskip("pinocchio")
    path = tmp_path / "rotated.urdf"
    path.write_text(ROTATED, encoding="utf-8")
    tree = read_urdf(path)
    again = tmp_path / "again.urdf"
    again.write_bytes(urdf_files(tree, "again")["again.urdf"])
    models = [pin.buildModelFromUrdf(str(p), pin.JointModelFreeFlyer()) for p in (path, again)]
    assert list(models[0].names) == list(models[1].names)
    pin.seed(4)
    high = np.ones(models[0].nq)
    for _ in range(STATES):
        q = pin.randomConfiguration(models[0], -high, high)
        masses = [pin.crba(model, model.createData(), q) for model in models]
        scale = np.abs(masses[0]).max()
        np.testing.assert_allclose(masses[1], masses[0], rtol=0, atol=CLOSE * scale)
