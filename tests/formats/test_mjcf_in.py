"""MJCF files are understood as MuJoCo understands them, and refused in sentences."""

import mujoco
import numpy as np
import pytest

from formats.wild_model import BESIDE, WILD
from phasmid.errors import InvalidInput
from phasmid.formats import ImportOptions, Severity
from phasmid.formats.mjcf_in import read_mjcf

TWO = """<mujoco model="two"><worldbody>{before}<body name="base"><freejoint/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
<body name="arm" pos="1 0 0"><joint name="j" axis="0 0 1"{joint}/>{inertial}{inside}</body>
</body></worldbody>{after}</mujoco>"""


def two(
    before="",
    joint="",
    inside="",
    after="",
    inertial='<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>',
):
    """A trunk and an arm of one hinge."""
    return TWO.format(before=before, joint=joint, inside=inside, after=after, inertial=inertial)


def read(folder, text, **options):
    (folder / "robot.xml").write_text(text)
    return read_mjcf(folder / "robot.xml", ImportOptions(**options))


def refused(folder, text, **options):
    with pytest.raises(InvalidInput) as error:
        read(folder, text, **options)
    return error.value


@pytest.fixture
def wild(tmp_path):
    for name, content in {"wild.xml": WILD.encode(), **BESIDE}.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(content)
    return tmp_path / "wild.xml"


def forward(tree, angles, X_root):
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


def test_a_model_from_the_wild_moves_and_weighs_as_in_mujoco(wild):
    """Feet, masses, centres of mass and inertias at random angles are those of MuJoCo."""
    tree = read_mjcf(wild)
    model = mujoco.MjModel.from_xml_path(str(wild))
    data = mujoco.MjData(model)
    rng = np.random.default_rng(11)
    hinges = [j for j in tree.joints if j.kind == "revolute"]
    assert [j.name for j in hinges] == ["hip", "abduct", "knee"]
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
        toe, site = poses["toe_1"], data.site("toe_1")
        np.testing.assert_allclose(toe[:3, 3], site.xpos, rtol=0, atol=1e-14)
        np.testing.assert_allclose(toe[:3, :3].ravel(), site.xmat, rtol=0, atol=1e-14)
        for name, link in tree.links.items():
            if link.inertial is None:
                continue
            # The shin has no name in the file.
            body = int(model.site("toe_1").bodyid[0]) if name == "body_1" else model.body(name).id
            R, inertia = poses[name][:3, :3], data.ximat[body].reshape(3, 3)
            com = R @ link.inertial.com + poses[name][:3, 3]
            np.testing.assert_allclose(com, data.xipos[body], rtol=0, atol=1e-14)
            assert link.inertial.mass == pytest.approx(model.body_mass[body], rel=1e-14)
            inertia = inertia @ np.diag(model.body_inertia[body]) @ inertia.T
            np.testing.assert_allclose(R @ link.inertial.inertia @ R.T, inertia, rtol=0, atol=1e-13)


def test_a_model_from_the_wild_keeps_limits_motors_looks_and_feet(wild):
    tree = read_mjcf(wild)
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
    assert tree.links["thigh"].where == "wild.xml, line 19"
    assert joints["hip"].where == "wild.xml, line 20"
    assert [finding.what for finding in tree.findings] == [
        "1 <equality>, 1 <tendon> were ignored.",
        "crate beside the robot was ignored.",
    ]


SPARE = two().split("<worldbody>")[1].split("</worldbody>")[0]
for name, new in (("base", "spare"), ("arm", "arm2"), ("j", "k")):
    SPARE = SPARE.replace(f'name="{name}"', f'name="{new}"')


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("<PhysicalModelingXMLFile/>", "robot.xml line 1: the file holds a"),
        (two(before=SPARE), "robot.xml has 2 root links (spare, base); exactly 1 is needed."),
        ("<mujoco><worldbody/></mujoco>", "robot.xml has 0 root links; exactly 1 is needed."),
        (two(joint=' rnage="1 2"'), "MuJoCo cannot use robot.xml: Schema violation: unrecognized"),
        (two(inside='<geom type="box" size="0 0 0"/>'), "MuJoCo cannot use robot.xml: "),
        (two(inside='<geom size=".1"/>' * 2000), "robot.xml describes more than 2000 bodies,"),
        (two(joint=' range="60 -60"'), "joint j: its lower limit 60 lies above the upper -60."),
        (two(joint=' pos="0 nan 0"'), "MuJoCo finds numbers in robot.xml that are not finite."),
        (two(joint=' range="nan 1"'), "MuJoCo finds numbers in robot.xml that are not finite."),
        (two(before='<include file="/etc/passwd"/>'), 'file "/etc/passwd" lies outside the model'),
        (
            two(inside='<replicate count="1000"><body/></replicate>'),
            "<replicate> is not read. open",
        ),
    ],
)
def test_what_cannot_be_used_is_told(tmp_path, text, what):
    error = refused(tmp_path, text)
    assert f"{error.what} {error.hint}".startswith(what)
    if what.startswith("MuJoCo cannot use"):
        assert error.where == "robot.xml, line 3"


def test_meshes_beside_the_folder_of_the_files_are_the_models(tmp_path):
    import trimesh

    for folder in ("mjcf", "meshes"):
        (tmp_path / folder).mkdir()
    trimesh.creation.box((0.1, 0.1, 0.1)).export(tmp_path / "meshes" / "a.stl")
    asset = '<compiler meshdir="../meshes"/><asset><mesh file="a.stl"/></asset>'
    text = two(inside='<geom type="mesh" mesh="a"/>', after=asset)
    assert read(tmp_path / "mjcf", text).links["arm"].parts


GAINS = (
    '<actuator><position joint="j" kp="20" kv="0.5" gear="2" forcerange="-3 3"/>'
    '<motor joint="j" ctrlrange="-1 1"/></actuator>'
)


def test_gains_of_position_actuators_are_those_of_the_joint(tmp_path):
    """A gear g turns the actuator's angle and torque: kp g² and kv g² at the joint."""
    (joint,) = read(tmp_path, two(after=GAINS)).joints
    assert (joint.stiffness, joint.servo_damping, joint.effort) == (80.0, 2.0, 6.0)


def key(name, angle):
    return f'<key name="{name}" qpos="0 0 1 1 0 0 0 {angle}"/>'


@pytest.mark.parametrize(
    ("keys", "home", "told"),
    [
        (key("a", "0.1") + key("Home", "0.2"), 0.2, "not used: a."),
        (key("a", "0.1"), 0.1, "is the stance."),
        (key("home", ""), None, "8 finite positions were ignored."),
        ("", None, ""),
    ],
)
def test_a_key_is_the_stance(keys, home, told, tmp_path):
    tree = read(tmp_path, two(after=f"<keyframe>{keys}</keyframe>"))
    assert tree.joints[0].home == home
    assert [f for f in tree.findings if f.what.endswith(told)] or not told


def test_linkages_are_told(tmp_path):
    inside = '<body name="b" pos="0 1 0"><joint name="k"/><geom size="0.1"/></body>'
    after = (
        '<equality><joint joint1="k" joint2="j"/>'
        '<connect name="loop" body1="b" body2="base" anchor="0 0 0"/></equality>'
    )
    tree = read(tmp_path, two(inside=inside, after=after))
    assert {joint.name: joint.follows for joint in tree.joints} == {"j": "", "k": "j"}
    loop = tree.findings[0]
    assert (loop.subject, loop.severity) == ("equality loop", Severity.SUSPECT)


def test_included_files_are_read_inside_the_model_s_folder(tmp_path):
    """As in the scenes of model collections: a floor, and the robot in a file of its own."""
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "arm.xml").write_text(two(joint=' range="-1 1"'))
    scene = '<mujoco model="scene"><include file="{}"/></mujoco>'
    tree = read(tmp_path, scene.format("parts/arm.xml"))
    degree = np.pi / 180
    assert (tree.joints[0].upper, tree.joints[0].where) == (degree, "arm.xml, line 3")
    for name, what in (
        ("../arm.xml", 'file "../arm.xml" lies outside the model folder.'),
        ("none.xml", "none.xml"),
        ("robot.xml", "MuJoCo cannot use robot.xml"),
    ):
        assert what in refused(tmp_path, scene.format(name)).what


@pytest.mark.parametrize(
    ("folder", "name"),
    [
        ("", "../../etc/passwd"),
        ("", "/etc/passwd"),
        ("", "http://a.example/b.stl"),
        ("../../..", "etc/x.stl"),
    ],
)
def test_nothing_outside_of_the_folder_is_read(folder, name, tmp_path):
    """Neither by the mesh's own name nor by the folder of all meshes."""
    compiler = f'<compiler meshdir="{folder}"/>' if folder else ""
    mesh = f'{compiler}<asset><mesh name="m" file="{name}"/></asset>'
    (found,) = read(tmp_path, two(inside='<geom type="mesh" mesh="m"/>', after=mesh)).findings
    place = f"{folder}/{name}" if folder else name
    assert found.what == f'mesh "{place}" lies outside the model folder; it was left out.'
    assert (found.severity, found.where) == (Severity.SUSPECT, "robot.xml, line 4")
