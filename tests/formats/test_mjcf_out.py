"""MuJoCo opens the written file as it is, and finds the robot's own masses in it, standing."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest
import trimesh

from formats.trees import ROBOTS, files_of
from general_robot import general_robot
from phasmid.errors import InvalidRobot
from phasmid.formats import Tree, TreeJoint, TreeLink, tree_of
from phasmid.formats.mjcf_out import mjcf_files
from phasmid.formats.tree import neutral_angles
from phasmid.kinematics import quaternion_rotation
from phasmid.robot import Appearance, Part, Robot, preset_names


def a_box(size: float, name: str = "", color: tuple[float, ...] = (1.0, 0.5, 0.25, 1.0)) -> Part:
    mesh = trimesh.creation.box((size, 2 * size, 3 * size))
    return Part(np.asarray(mesh.vertices), np.asarray(mesh.faces), color, name)


def dressed(robot: Robot) -> Robot:
    """The robot with boxes: one on the trunk, the same on all coxae, each tibia's its own."""
    parts = {"body": (a_box(0.1, "trunk"),), "coxa": (a_box(0.02, "servo"), a_box(0.03))}
    for i, leg in enumerate(robot.legs):
        parts[f"{leg.name}.tibia"] = (a_box(0.011 * (i + 1), "servo", (0.0, 0.0, 1.0, 0.5)),)
    return replace(robot, appearance=Appearance(lambda: parts))


def compiled(robot: Robot) -> mujoco.MjModel:
    files = files_of(robot, ".xml")
    text = files.pop("robot.xml").decode()
    return mujoco.MjModel.from_xml_string(text, files)


def test_an_inertia_far_below_the_engines_own_threshold_keeps_its_axes() -> None:
    """R diag(moments) R^T is the tensor to rounding even where its entries are 1e-12 kg m²."""
    robot = general_robot()
    tree = tree_of(robot)
    links = {
        name: replace(link, inertial=replace(link.inertial, inertia=1e-8 * link.inertial.inertia))
        if link.inertial
        else link
        for name, link in tree.links.items()
    }
    model = mujoco.MjModel.from_xml_string(
        mjcf_files(replace(tree, links=links), "r")["r.xml"].decode()
    )
    for name, link in links.items():
        if link.inertial:
            body = model.body(name)
            R = quaternion_rotation(body.iquat)
            tensor = R @ np.diag(body.inertia) @ R.T
            scale = np.abs(link.inertial.inertia).max()
            np.testing.assert_allclose(tensor, link.inertial.inertia, rtol=0, atol=1e-14 * scale)


@pytest.mark.parametrize("name", preset_names())
@pytest.mark.parametrize("known", [True, False])
def test_the_robot_stands_still_at_home_under_its_actuators(name: str, known: bool) -> None:
    robot = ROBOTS[name]
    home = neutral_angles(robot)
    files = mjcf_files(tree_of(robot), "robot", home=home, servo=robot.servo if known else None)
    text = files.pop("robot.xml").decode()
    model = mujoco.MjModel.from_xml_string(text, files)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    np.testing.assert_array_equal(data.ctrl, list(home.values()))
    mujoco.mj_forward(model, data)
    feet = np.array([model.site(f"{leg.name}_foot").id for leg in robot.legs])
    start, places = data.qpos.copy(), data.site_xpos[feet].copy()
    # The far end of each sphere touches the floor up to how much its tibia leans.
    assert np.abs(places[:, 2]).max() < 0.001
    mujoco.mj_step(model, data, 1000)
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


def test_the_ends_of_the_feet_are_the_robots_feet() -> None:
    """X_world_foot of the compiled sites at random angles is the robot's own chain."""
    from phasmid.kinematics import leg_frames

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


def test_meshes_are_seen_and_felt_by_nobody_and_written_once() -> None:
    robot = dressed(ROBOTS["phantomx-ax"])
    files = mjcf_files(tree_of(robot), "robot")
    # One of the trunk, two that all coxae share, one of each tibia.
    assert sorted(files) == sorted(
        [
            "robot.xml",
            "robot_meshes/trunk.stl",
            "robot_meshes/servo.stl",
            "robot_meshes/right_front_coxa_link.stl",
        ]
        + [f"robot_meshes/servo_{i}.stl" for i in range(2, 8)]
    )
    model = mujoco.MjModel.from_xml_string(files.pop("robot.xml").decode(), files)
    seen = model.geom_group == 2
    assert np.count_nonzero(seen) == 1 + 6 * 3
    assert not model.geom_contype[seen].any()
    assert not model.geom_conaffinity[seen].any()
    body = model.body("right_front_tibia_link").id
    (geom,) = np.flatnonzero(seen & (model.geom_bodyid == body))
    np.testing.assert_allclose(model.geom_rgba[geom], [0, 0, 1, 0.5])
    assert model.body_mass.sum() == pytest.approx(robot.mass, rel=1e-12)


def test_what_mjcf_cannot_hold_is_refused() -> None:
    links = {"base_link": tree_of(ROBOTS["phantomx-ax"]).root, "arm": TreeLink("arm")}
    hinge = TreeJoint("j", "revolute", "base_link", "arm", np.eye(4))
    with pytest.raises(InvalidRobot) as refused:
        mjcf_files(Tree("r", links, (hinge,)), "r")
    assert refused.value.what == "link arm moves but has no mass."
    with pytest.raises(InvalidRobot) as refused:
        mjcf_files(Tree("r", links, (replace(hinge, kind="prismatic"),)), "r")
    assert refused.value.what == (
        "joint j is of kind prismatic; only hinges and fixed joints are written."
    )
