"""MJCF files are understood as MuJoCo understands them, and refused in sentences."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from general_robot import general_robot
from phasmid.errors import InvalidInput, PhasmidError
from phasmid.formats import ImportOptions, Tree, import_robot, tree_of
from phasmid.formats.mjcf_in import read_mjcf
from phasmid.formats.mjcf_out import mjcf_files
from phasmid.formats.tree import neutral_angles
from phasmid.robot import Appearance, Part, Robot, load_robot, preset_names

ROBOTS = {name: load_robot(name) for name in preset_names()} | {"general": general_robot()}

TWO = """<mujoco model="two"><worldbody>{before}<body name="base"><freejoint/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
<body name="arm" pos="1 0 0"><joint name="j" axis="0 0 1"{joint}/>{inertial}{inside}</body>
</body></worldbody>{after}</mujoco>"""


def two(
    before: str = "",
    joint: str = "",
    inside: str = "",
    after: str = "",
    inertial: str = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>',
) -> str:
    """A trunk and an arm of one hinge."""
    return TWO.format(before=before, joint=joint, inside=inside, after=after, inertial=inertial)


def read(folder: Path, text: str, **options: object) -> Tree:
    (folder / "robot.xml").write_text(text)
    return read_mjcf(folder / "robot.xml", ImportOptions(**options))


def refused(folder: Path, text: str, **options: object) -> PhasmidError:
    with pytest.raises(InvalidInput) as error:
        read(folder, text, **options)
    return error.value


def sheet(color: tuple[float, ...], name: str) -> Part:
    """An open mesh of two triangles that do not lie in one plane."""
    corners = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0.1, 0.1, 0.03]])
    return Part(corners, np.array([[0, 1, 2], [1, 3, 2]]), color, name)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_written_robot_comes_back_with_every_number(name: str, tmp_path: Path) -> None:
    robot: Robot = replace(
        ROBOTS[name],
        appearance=Appearance(
            lambda: {
                "body": (sheet((1.0, 0.5, 0.25, 1.0), "lid"), sheet((0.1, 0.2, 0.3, 0.4), "lid")),
                "tibia": (sheet((0.0, 0.0, 1.0, 1.0), "shin"),),
            }
        ),
    )
    ours = tree_of(robot)
    files = mjcf_files(ours, "robot", home=neutral_angles(robot), servo=robot.servo)
    for file, raw in files.items():
        (tmp_path / file).parent.mkdir(exist_ok=True)
        (tmp_path / file).write_bytes(raw)
    theirs = read_mjcf(tmp_path / "robot.xml", ImportOptions(strict=True))
    assert theirs.name == robot.name
    assert list(theirs.links) == list(ours.links)
    assert theirs.findings == ()
    # Rotations pass through quaternions: a few roundings of entries of order one.
    close = {"rtol": 0, "atol": 2e-15}
    for link in ours.links.values():
        other = theirs.links[link.name]
        assert (link.inertial is None) == (other.inertial is None)
        if link.inertial:
            a, b = link.inertial, other.inertial
            assert b.mass == a.mass
            np.testing.assert_allclose(b.com, a.com, **close)
            np.testing.assert_allclose(b.inertia, a.inertia, **close)
        assert len(link.parts) == len(other.parts)
        for mine, their in zip(link.parts, other.parts, strict=True):
            assert (mine.name, mine.color) == (their.name, their.color)
            # Single precision, of corners and of the engine's frame about their middle.
            a, b = mine.vertices[mine.faces], their.vertices[their.faces]
            np.testing.assert_allclose(b, a, rtol=0, atol=1e-7)
    assert [j.name for j in theirs.joints] == [j.name for j in ours.joints]
    for joint, other in zip(ours.joints, theirs.joints, strict=True):
        same = ("kind", "parent", "child", "effort", "damping", "friction", "armature")
        assert [getattr(joint, k) for k in (*same, "lower", "upper")] == [
            getattr(other, k) for k in (*same, "lower", "upper")
        ]
        np.testing.assert_allclose(other.X_parent_child, joint.X_parent_child, **close)
        np.testing.assert_array_equal(other.axis, joint.axis)


WILD = """<mujoco model="wild">
  <compiler angle="degree" eulerseq="XYZ" meshdir="assets"/>
  <include file="defaults.xml"/>
  <asset><mesh name="plate" file="plate.stl" scale="0.001 0.001 -0.001"/>
    <material name="red" rgba="0.8 0.1 0.1 1"/></asset>
  <worldbody>
    <light pos="0 0 3"/><geom type="plane" size="1 1 1"/>
    <body name="crate" pos="2 0 0"><freejoint/><geom type="box" size=".1 .1 .1"/></body>
    <frame euler="10 20 30" pos="0 0 0.3">
      <body name="hull" pos="0 0 0.1" childclass="leg">
        <freejoint/>
        <geom class="visual" mesh="plate" material="red"/>
        <geom type="ellipsoid" size=".1 .08 .05" mass="2"/>
        <include file="leg.xml"/>
        <body name="mast" pos="0 0 .1">
          <geom type="cylinder" fromto="0 0 0 0 0 .2" size=".01"/>
        </body>
      </body>
    </frame>
  </worldbody>
  <actuator>
    <position class="leg" joint="hip" kp="20" forcerange="-3 4"/>
    <motor joint="knee" gear="5" ctrlrange="-.5 .5"/>
  </actuator>
  <equality><joint joint1="hip" joint2="knee" active="false"/></equality>
  <tendon><fixed name="t"><joint joint="hip" coef="1"/></fixed></tendon>
</mujoco>"""

WILD_DEFAULTS = """<mujocoinclude><default>
  <default class="leg"><joint damping="0.1" armature="0.01" range="-40 50" axis="0 1 0"/>
    <geom density="800" rgba="0.2 0.3 0.4 1"/></default>
  <default class="visual">
    <geom type="mesh" contype="0" conaffinity="0" group="1" mass="0"/></default>
</default></mujocoinclude>"""

WILD_LEG = """<mujocoinclude>
  <body name="thigh" pos=".1 .05 0" euler="0 30 45">
    <joint name="hip" pos="0.01 0.02 -0.03" ref="15"/>
    <geom type="capsule" fromto="0 0 0 .1 0 -.02" size=".015"/>
    <body pos=".1 0 0" axisangle="1 1 0 60">
      <joint name="abduct" axis="1 0 0.5" range="-20 20"/>
      <joint name="knee" pos="-.02 .01 0" axis="0 2 0" frictionloss="0.2"/>
      <geom type="capsule" fromto="0 0 0 0 0 -.12" size=".01"/>
      <site name="toe_1" pos="0 0 -.13" euler="0 90 0"/><site name="camera_mount"/>
    </body>
  </body>
</mujocoinclude>"""


def wild(folder: Path) -> Path:
    """A model with all that other people's models have."""
    import trimesh

    (folder / "assets").mkdir()
    trimesh.creation.box((200.0, 100.0, 20.0)).export(folder / "assets" / "plate.stl")
    (folder / "defaults.xml").write_text(WILD_DEFAULTS)
    (folder / "leg.xml").write_text(WILD_LEG)
    (folder / "wild.xml").write_text(WILD)
    return folder / "wild.xml"


def forward(tree: Tree, angles: dict[str, float], X_root: np.ndarray) -> dict[str, np.ndarray]:
    """Poses of all links in the world."""
    from scipy.spatial.transform import Rotation

    poses, frontier = {tree.root.name: X_root}, [tree.root.name]
    while frontier:
        for joint in tree.joints_from(frontier.pop()):
            turn = np.eye(4)
            vector = joint.axis * angles.get(joint.name, 0.0)
            turn[:3, :3] = Rotation.from_rotvec(vector).as_matrix()
            poses[joint.child] = poses[joint.parent] @ joint.X_parent_child @ turn
            frontier.append(joint.child)
    return poses


def test_a_model_from_the_wild_moves_and_weighs_as_in_mujoco(tmp_path: Path) -> None:
    """Poses and mass matrix of the tree at random angles are those of MuJoCo's own compilation.

    M of the tree is the sum over links of Jᵀ diag(m, I) J, with J from its poses.
    """
    tree = read_mjcf(wild(tmp_path))
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "wild.xml"))
    data = mujoco.MjData(model)
    rng = np.random.default_rng(11)
    hinges = [j for j in tree.joints if j.kind == "revolute"]
    assert [j.name for j in hinges] == ["hip", "abduct", "knee"]
    robot = model.body("hull").dofadr[0]
    for _ in range(10):
        q = rng.uniform(-1, 1, 3)
        for joint, angle in zip(hinges, q, strict=True):
            data.joint(joint.name).qpos = angle
        at = model.jnt_qposadr[model.body("hull").jntadr[0]]
        quaternion = rng.normal(size=4)
        data.qpos[at : at + 7] = [*rng.normal(size=3), *quaternion / np.linalg.norm(quaternion)]
        mujoco.mj_forward(model, data)
        X_root = np.eye(4)
        X_root[:3, :3] = data.body("hull").xmat.reshape(3, 3)
        X_root[:3, 3] = data.body("hull").xpos
        poses = forward(tree, dict(zip([j.name for j in hinges], q, strict=True)), X_root)
        np.testing.assert_allclose(
            poses["toe_1"][:3, 3], data.site("toe_1").xpos, rtol=0, atol=1e-14
        )
        np.testing.assert_allclose(
            poses["toe_1"][:3, :3].ravel(), data.site("toe_1").xmat, rtol=0, atol=1e-14
        )
        M = np.zeros((9, 9))
        for name, link in tree.links.items():
            if link.inertial is None:
                continue
            X = poses[name]
            com = X[:3, :3] @ link.inertial.com + X[:3, 3]
            # The shin has no name in the file.
            shin = int(model.site("toe_1").bodyid[0])
            body = data.body(shin if name == "body_1" else name)
            np.testing.assert_allclose(com, body.xipos, rtol=0, atol=1e-14)
            J = np.zeros((6, 9))
            J[:3, :3] = np.eye(3)
            R = X_root[:3, :3]
            J[3:, 3:6] = R
            J[:3, 3:6] = -np.array([np.cross(com - X_root[:3, 3], R[:, i]) for i in range(3)]).T
            above = name
            while above != tree.root.name:
                (joint,) = [j for j in tree.joints if j.child == above]
                if joint in hinges:
                    axis = poses[above][:3, :3] @ joint.axis
                    column = 6 + hinges.index(joint)
                    J[:3, column] = np.cross(axis, com - poses[above][:3, 3])
                    J[3:, column] = axis
                above = joint.parent
            I = X[:3, :3] @ link.inertial.inertia @ X[:3, :3].T
            M += link.inertial.mass * J[:3].T @ J[:3] + J[3:].T @ I @ J[3:]
        full = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, full)
        full -= np.diag(model.dof_armature)
        ours = slice(robot, robot + 9)
        np.testing.assert_allclose(M, full[ours, ours], rtol=0, atol=1e-13)


def test_a_model_from_the_wild_keeps_limits_motors_looks_and_feet(tmp_path: Path) -> None:
    tree = read_mjcf(wild(tmp_path))
    assert list(tree.links) == ["hull", "thigh", "body_1_abduct", "body_1", "toe_1", "mast"]
    joints = {joint.name: joint for joint in tree.joints}
    assert joints["mast_joint"].kind == joints["toe_1_joint"].kind == "fixed"
    hip, knee, abduct = joints["hip"], joints["knee"], joints["abduct"]
    np.testing.assert_allclose([hip.lower, hip.upper], np.radians([-40, 50]), rtol=1e-15)
    np.testing.assert_allclose([abduct.lower, abduct.upper], np.radians([-20, 20]), rtol=1e-15)
    # The larger side of the position servo; gear times control of the motor.
    assert (hip.effort, knee.effort, abduct.effort) == (4.0, 2.5, None)
    assert (hip.damping, hip.armature, knee.friction) == (0.1, 0.01, 0.2)
    np.testing.assert_array_equal(knee.axis, [0, 1, 0])
    # The hull shows its plate, in millimetres, mirrored, and not the shape that touches.
    (plate,) = tree.links["hull"].parts
    np.testing.assert_allclose(np.ptp(plate.vertices, axis=0), [0.2, 0.1, 0.02], atol=1e-7)
    assert plate.color == (0.8, 0.1, 0.1, 1.0)
    corners = plate.vertices[plate.faces]
    volume = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    assert volume == pytest.approx(0.2 * 0.1 * 0.02, rel=1e-5)
    (thigh,) = tree.links["thigh"].parts
    assert thigh.color == (0.2, 0.3, 0.4, 1.0)
    # From joint frames: the capsule begins a radius before the body's origin.
    assert np.ptp(thigh.vertices, axis=0).max() > 0.1
    # Density times the volume of a capsule 0.12 m long, of 1 cm radius.
    volume = np.pi * 0.01**2 * (0.12 + 4 / 3 * 0.01)
    assert tree.links["body_1"].inertial.mass == pytest.approx(800 * volume, rel=1e-12)
    assert tree.links["toe_1"].inertial is None
    assert tree.links["thigh"].where == "leg.xml, line 2"
    assert joints["hip"].where == "leg.xml, line 3"
    assert [finding.what for finding in tree.findings] == [
        "1 <equality>, 1 <tendon> were ignored.",
        "crate beside the robot was ignored.",
        "links without <inertial>: 4; masses were computed from shapes.",
    ]


def test_i12_strict_refuses_what_is_ignored(tmp_path: Path) -> None:
    error = refused(
        tmp_path, two(after='<contact><exclude body1="base" body2="arm"/></contact>'), strict=True
    )
    assert error.what == "1 <contact> was ignored."
    assert error.hint == "leave --strict out"


@pytest.mark.parametrize(
    "name", ["../../etc/passwd", "/etc/passwd", "file://etc/passwd", "http://a.example/b.stl"]
)
def test_i3_names_outside_of_the_folder_are_refused(name: str, tmp_path: Path) -> None:
    shown = '<geom type="mesh" mesh="m"/>'
    mesh = f'<asset><mesh name="m" file="{name}"/></asset>'
    error = refused(tmp_path, two(inside=shown, after=mesh))
    assert error.what == f'mesh "{name}" lies outside the model folder.'
    assert error.where == "robot.xml, line 4"
    error = refused(tmp_path, two(before=f'<include file="{name}"/>'))
    assert error.what == f'include "{name}" lies outside the model folder.'
    folder = '<compiler meshdir="../../.."/>'
    mesh = '<asset><mesh name="m" file="etc/x.stl"/></asset>'
    error = refused(tmp_path, two(inside=shown, after=folder + mesh))
    assert error.what == 'mesh "../../../etc/x.stl" lies outside the model folder.'


def test_i5_includes_in_a_circle_are_named(tmp_path: Path) -> None:
    (tmp_path / "a.xml").write_text('<mujoco><include file="b.xml"/></mujoco>')
    (tmp_path / "b.xml").write_text('<mujoco>\n<include file="a.xml"/></mujoco>')
    with pytest.raises(InvalidInput) as error:
        read_mjcf(tmp_path / "a.xml")
    assert error.value.what == "a.xml includes b.xml includes a.xml."
    assert error.value.where == "b.xml, line 2"


def test_includes_that_double_each_time_and_very_many_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.xml").write_text("<mujoco><worldbody/></mujoco>")
    error = refused(tmp_path, two(before='<include file="a.xml"/><include file="a.xml"/>'))
    assert error.what == 'include "a.xml" is there twice.'
    for i in range(101):
        (tmp_path / f"{i}.xml").write_text(f'<mujoco><include file="{i + 1}.xml"/></mujoco>')
    error = refused(tmp_path, two(before='<include file="0.xml"/>'))
    assert error.what == "robot.xml includes more than 100 files; such models are refused."


def test_i6_the_robot_is_the_one_body_of_the_world_with_hinges(tmp_path: Path) -> None:
    other = two().split("<worldbody>")[1].split("</worldbody>")[0]
    for name, new in (("base", "spare"), ("arm", "arm2"), ("j", "k")):
        other = other.replace(f'name="{name}"', f'name="{new}"')
    error = refused(tmp_path, two(before=other))
    assert error.what == "robot.xml has 2 root links (spare, base); exactly 1 is needed."
    error = refused(tmp_path, "<mujoco><worldbody/></mujoco>")
    assert error.what == "robot.xml has 0 root links; exactly 1 is needed."


def test_what_mujoco_refuses_is_one_sentence_with_its_line(tmp_path: Path) -> None:
    error = refused(tmp_path, two(joint=' rnage="1 2"'))
    assert error.what == (
        "MuJoCo cannot use robot.xml: Schema violation: unrecognized attribute: 'rnage'; "
        "Element 'joint'."
    )
    assert error.where == "robot.xml, line 3"
    error = refused(tmp_path, two(inside='<geom type="box" size="0 0 0"/>'))
    assert error.what.startswith("MuJoCo cannot use robot.xml: ")
    assert error.where == "robot.xml, line 3"


def test_models_of_very_many_things_are_refused(tmp_path: Path) -> None:
    error = refused(tmp_path, two(inside='<geom size=".1"/>' * 2000))
    assert error.what == (
        "robot.xml describes more than 2000 bodies, shapes and other things; "
        "such models are refused."
    )
    # What lies about in the world is not counted.
    assert read(tmp_path, two(before='<geom size=".1"/>' * 3000)).links


def test_other_joints_keep_their_kind(tmp_path: Path) -> None:
    kinds = {
        joint.name: joint.kind
        for kind in ("slide", "ball")
        for joint in read(
            tmp_path,
            two(
                inside=f'<body name="{kind}"><joint name="{kind}" type="{kind}"/>'
                '<geom size=".1"/></body>'
            ),
        ).joints
    }
    assert kinds == {"j": "continuous", "slide": "prismatic", "ball": "ball"}


def test_numbers_that_are_none_and_limits_the_wrong_way_round_are_refused(tmp_path: Path) -> None:
    error = refused(tmp_path, two(joint=' range="60 -60"'))
    assert error.what == "joint j: its lower limit 60 lies above the upper -60."
    assert error.hint == "swap them"
    error = refused(tmp_path, two(joint=' pos="0 nan 0"'))
    assert error.what == "MuJoCo finds numbers in robot.xml that are not finite."


def test_what_copies_bodies_and_other_files_is_refused(tmp_path: Path) -> None:
    copies = '<replicate count="1000000000"><body/></replicate>'
    error = refused(tmp_path, two(inside=copies))
    assert error.what == "<replicate> is not read."
    assert error.hint == "open the file in MuJoCo and save it there, which writes it out"


@pytest.mark.parametrize("root", ["PhysicalModelingXMLFile", "assembly"])
def test_i14_other_xml_of_cad_programs_is_named(tmp_path: Path, root: str) -> None:
    path = tmp_path / "assembly.xml"
    path.write_text(f'<{root} version="1.0"><RootAssembly/></{root}>', encoding="utf-8")
    with pytest.raises(InvalidInput) as refused:
        import_robot(path)
    assert refused.value.what == (
        f"assembly.xml line 1: the file holds a <{root}>; robots are read from URDF, a <robot>, "
        "and MJCF, a <mujoco>."
    )


def test_meshes_that_are_not_there_are_left_out_with_a_word(tmp_path: Path) -> None:
    text = two(
        inside='<geom type="mesh" mesh="a"/><geom type="mesh" mesh="b"/>',
        after='<asset><mesh name="a" file="a.stl"/><mesh name="b" file="b.msh"/></asset>',
    )
    (tmp_path / "b.msh").write_bytes(b"abc")
    tree = read(tmp_path, text)
    assert tree.links["arm"].parts == ()
    assert [finding.what for finding in tree.findings] == [
        'mesh "a.stl" is not there; it was left out.',
        'mesh b.msh was left out: files of the kind ".msh" are not read.',
    ]


def test_meshes_beside_the_folder_of_the_files_are_the_models(tmp_path: Path) -> None:
    import trimesh

    for folder in ("mjcf", "meshes"):
        (tmp_path / folder).mkdir()
    trimesh.creation.box((0.1, 0.1, 0.1)).export(tmp_path / "meshes" / "a.stl")
    asset = '<compiler meshdir="../meshes"/><asset><mesh file="a.stl"/></asset>'
    text = two(inside='<geom type="mesh" mesh="a"/>', after=asset)
    assert read(tmp_path / "mjcf", text).links["arm"].parts


def test_spheres_that_touch_are_the_balls_of_a_link(tmp_path: Path) -> None:
    shapes = (
        '<geom type="sphere" size="0.02" pos="0.1 0 -0.2"/>'
        '<geom type="sphere" size="0.03" contype="0" conaffinity="0"/>'
    )
    (ball,) = read(tmp_path, two(inside=shapes)).links["arm"].balls
    assert ball == (0.1, 0.0, -0.2, 0.02)
