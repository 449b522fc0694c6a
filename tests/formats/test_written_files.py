"""Written files: URDF reads back as it was, and MuJoCo opens MJCF and finds the robot standing."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from formats.tetrahedron import CORNERS, FACES
from formats.trees import ROBOTS, block, files_of, write
from phasmid.formats import Tree, TreeJoint, TreeLink, tree_of
from phasmid.formats.tree import rpy_of
from phasmid.formats.urdf_in import read_urdf
from phasmid.formats.urdf_out import FOOT_RADIUS, urdf_files
from phasmid.kinematics import leg_frames, rotation_rpy
from phasmid.robot import Appearance, Part, load_robot, preset_names
from phasmid.robot.inertial import Inertial
from support.general_robot import general_robot

# Nine products of sines and cosines that are exact to a unit in the last place, and angles of up
# to pi, themselves rounded by 4.4e-16: some units of 2.2e-16.
ROTATION = 3e-15


@pytest.mark.parametrize("off", [0.0, 1e-16, 1e-12, 3e-9, 1e-8, 1e-6, 1e-4, 0.3, 1.5, 3.0])
def test_any_rotation_has_its_roll_pitch_and_yaw(off):
    """Near a pitch of a right angle only roll - yaw or roll + yaw is determined."""
    rng = np.random.default_rng(3)
    for pitch in (-np.pi / 2 + off, np.pi / 2 - off):
        for roll, yaw in rng.uniform(-np.pi, np.pi, (50, 2)):
            # A product of three rotations as a robot's chain gives it, not the formula's own form.
            R = rotation_rpy(0, 0, yaw) @ rotation_rpy(0, pitch, 0) @ rotation_rpy(roll, 0, 0)
            np.testing.assert_allclose(rotation_rpy(*rpy_of(R)), R, atol=ROTATION)


def test_a_robot_without_a_look_is_shown_by_sticks_that_are_no_part_of_it(tmp_path):
    tree = tree_of(replace(load_robot("phantomx-paper"), appearance=None))
    path = write(urdf_files(tree, "robot"), tmp_path)
    text = path.read_text(encoding="utf-8")
    # Six hips, and three links of six legs.
    assert text.count("<cylinder") == 6 + 18
    assert text.count(f'<sphere radius="{FOOT_RADIUS}" />') == 6
    assert not any(link.parts for link in read_urdf(path).links.values())


def test_names_of_any_letters_are_kept(tmp_path):
    names = ('base "&" <b>', "Übergelenk/1", "übergelenk/1", "../../etc/passwd")
    part = Part(CORNERS, FACES)
    links = {name: TreeLink(name, Inertial(1.0, np.zeros(3), np.eye(3)), (part,)) for name in names}
    joints = tuple(TreeJoint(f"j'{n}'", "fixed", names[0], n, np.eye(4)) for n in names[1:])
    files = urdf_files(Tree("a\u0007b", links, joints), "robot")
    assert all(".." not in name for name in files)
    back = read_urdf(write(files, tmp_path))
    assert tuple(back.links) == names
    assert [joint.name for joint in back.joints] == [joint.name for joint in joints]


def compiled(robot):
    files = files_of(robot, ".xml")
    text = files.pop("robot.xml").decode()
    return mujoco.MjModel.from_xml_string(text, files)


@pytest.mark.parametrize("name", preset_names())
def test_the_robot_stands_still_at_home_under_its_actuators(name):
    robot = ROBOTS[name]
    model = compiled(robot)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    np.testing.assert_array_equal(
        data.ctrl, [joint.home for joint in tree_of(robot).joints if joint.home is not None]
    )
    mujoco.mj_forward(model, data)
    feet = np.array([model.site(f"{leg.name}_foot").id for leg in robot.legs])
    start, places = data.qpos.copy(), data.site_xpos[feet].copy()
    # The far end of each sphere touches the floor up to how much its tibia leans.
    assert np.abs(places[:, 2]).max() < 0.001
    # Soft servos give way for some seconds, as their feet creep outwards.
    mujoco.mj_step(model, data, 6000)
    mujoco.mj_kinematics(model, data)
    then = np.concatenate([data.site_xpos[feet][:, :2].ravel(), data.qpos[:3]])
    mujoco.mj_step(model, data, 1000)
    mujoco.mj_kinematics(model, data)
    # A joint gives way by its torque over its stiffness. Its torque is at most that of its foot's
    # force, an even share of the weight and a quarter of it sideways, at an arm of the leg's reach.
    force = robot.mass * 9.81 / len(robot.legs) * np.hypot(1, 0.25)
    give = force * max(leg.lengths.sum() for leg in robot.legs) / model.actuator_gainprm[:, 0]
    assert np.all(np.abs(data.qpos - start)[7:] < give)
    # Friction creeps by 0.06 mm/s under a push (of half the weight); servos that still give way
    # as the feet creep move the trunk no further.
    now = np.concatenate([data.site_xpos[feet][:, :2].ravel(), data.qpos[:3]])
    assert np.abs(now - then).max() < 1e-4
    assert data.sensordata[-len(robot.legs) :].sum() == pytest.approx(robot.mass * 9.81, rel=1e-3)
    assert data.qpos[3] > 1 - 1e-4


def test_the_ends_of_the_feet_are_the_robots_feet():
    """X_world_foot of the compiled sites at random angles is the robot's own chain."""
    robot = general_robot()
    model = compiled(robot)
    data = mujoco.MjData(model)
    q = np.random.default_rng(3).uniform(-3, 3, (len(robot.legs), 3))
    data.qpos = [0, 0, 0, 1, 0, 0, 0, *q.ravel()]
    mujoco.mj_kinematics(model, data)
    for leg, angles in zip(robot.legs, q, strict=True):
        X = leg.X_body_hip @ leg_frames(leg, angles)[-1]
        place = data.site(f"{leg.name}_foot").xpos
        np.testing.assert_allclose(place, X[:3, 3], rtol=0, atol=1e-14)


def test_meshes_are_seen_and_felt_by_nobody_and_written_once():
    """One mesh of the trunk, one that all coxae share, one of each tibia."""
    robot = ROBOTS["phantomx-ax"]
    parts = {"body": (block((0, 0, 0), (0.1, 0.1, 0.1)),), "coxa": (block((0, 0, 0), (1, 2, 3)),)}
    for i, leg in enumerate(robot.legs, 1):
        shape = block((0, 0, 0), (0.01 * i, 0.02, 0.03))
        parts[f"{leg.name}.tibia"] = (replace(shape, name="servo", color=(0.0, 0.0, 1.0, 0.5)),)
    robot = replace(robot, appearance=Appearance.of(parts))
    names = ["base_link", "right_front_coxa_link", "servo", *(f"servo_{i}" for i in range(2, 7))]
    files = files_of(robot, ".xml")
    assert set(files) == {"robot.xml", *(f"robot_meshes/{name}.stl" for name in names)}
    model = compiled(robot)
    seen = model.geom_group == 2
    assert np.count_nonzero(seen) == 1 + 6 * 2
    assert not model.geom_contype[seen].any()
    assert not model.geom_conaffinity[seen].any()
    body = model.body("right_front_tibia_link").id
    (geom,) = np.flatnonzero(seen & (model.geom_bodyid == body))
    np.testing.assert_allclose(model.geom_rgba[geom], [0, 0, 1, 0.5])
    assert model.body_mass.sum() == pytest.approx(robot.mass, rel=1e-12)
