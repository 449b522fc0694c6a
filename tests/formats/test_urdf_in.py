"""URDF files give the tree that they say, and damaged ones a sentence."""

import os

import numpy as np
import pytest

from formats.tetrahedron import CORNERS, FACES, binary_stl
from phasmid.errors import InvalidInput, PhasmidError
from phasmid.formats import ImportOptions, Severity, import_robot
from phasmid.formats.urdf_in import read_urdf

LEG = """<robot name="r">
  <link name="base"/>
  <link name="tibia_3">
    <inertial>
      <origin xyz="0.1 0 0" rpy="0 0 1.5707963267948966"/>
      <mass value="0.5"/>
      <inertia ixx="1e-3" ixy="1e-4" ixz="2e-4" iyy="2e-3" iyz="3e-4" izz="2.5e-3"/>
    </inertial>
    <visual>
      <origin xyz="0 0 1"/>
      <geometry><box size="0.1 0.2 0.3"/></geometry>
      <material name="red"><color rgba="1 0 0 1"/></material>
    </visual>
  </link>
  <joint name="coxa_1" type="revolute">
    <parent link="base"/>
    <child link="tibia_3"/>
    <axis xyz="0 0 1"/>
    <limit lower="-1" upper="1.5" effort="2" velocity="6"/>
    <dynamics damping="0.1" friction="0.2"/>
  </joint>
</robot>
"""


MORE = """<joint name="{name}" type="fixed"><parent link="base"/><child link="tibia_3"/></joint>
</robot>"""
BOX, RANGE = '<box size="0.1 0.2 0.3"/>', 'lower="-1" upper="1.5"'


def read(text, folder, options=None):
    path = folder / "robot.urdf"
    path.write_text(text, encoding="utf-8")
    return read_urdf(path, options)


def refused(folder, old, new, options=None):
    assert LEG.count(old) >= 1
    with pytest.raises(PhasmidError) as error:
        read(LEG.replace(old, new), folder, options)
    return error.value


def left_out(folder, mesh, options=None):
    """The finding on a mesh without which the robot is read."""
    tree = read(LEG.replace(BOX, mesh), folder, options)
    assert tree.links["tibia_3"].parts == ()
    (found,) = tree.findings
    assert (found.severity, found.where) == (Severity.SUSPECT, "robot.urdf, line 11")
    return found


def test_a_link_and_a_joint_are_read_in_full(tmp_path):
    tree = read(LEG, tmp_path)
    assert (tree.name, tree.file, tree.findings) == ("r", "robot.urdf", ())
    link, (joint,) = tree.links["tibia_3"], tree.joints
    assert (link.where, joint.where) == ("robot.urdf, line 3", "robot.urdf, line 15")
    assert link.inertial.mass == 0.5
    np.testing.assert_array_equal(link.inertial.com, [0.1, 0, 0])
    # A quarter turn about z takes x to y and y to -x: I_xx' = I_yy, I_xy' = -I_xy, and so on.
    turned = [[2e-3, -1e-4, -3e-4], [-1e-4, 1e-3, 2e-4], [-3e-4, 2e-4, 2.5e-3]]
    np.testing.assert_allclose(link.inertial.inertia, turned, atol=1e-18)
    (part,) = link.parts
    assert part.color == (1, 0, 0, 1)
    np.testing.assert_allclose(part.vertices.max(axis=0), [0.05, 0.1, 1.15], rtol=1e-15)
    assert (joint.lower, joint.upper, joint.effort, joint.velocity) == (-1, 1.5, 2, 6)
    assert (joint.damping, joint.friction) == (0.1, 0.2)


def test_an_axis_is_x_where_none_is_given_and_has_length_one(tmp_path):
    (joint,) = read(LEG.replace('<axis xyz="0 0 1"/>', ""), tmp_path).joints
    np.testing.assert_array_equal(joint.axis, [1, 0, 0])
    tree = read(LEG.replace('"0 0 1"/>', '"0 0 -3"/>'), tmp_path)
    np.testing.assert_array_equal(tree.joints[0].axis, [0, 0, -1])


def test_a_material_may_be_defined_elsewhere(tmp_path):
    text = LEG.replace('name="red"><color rgba="1 0 0 1"/></material>', 'name="blue"/>')
    blue = '<material name="blue"><color rgba="0 0 1 0.5"/></material></robot>'
    tree = read(text.replace("</robot>", blue), tmp_path)
    assert tree.links["tibia_3"].parts[0].color == (0, 0, 1, 0.5)
    assert read(text, tmp_path).links["tibia_3"].parts[0].color == (0.5, 0.5, 0.5, 1)


@pytest.mark.parametrize(
    "name",
    [
        "../../etc/passwd",
        "/etc/passwd",
        "file:///etc/passwd",
        "http://example.org/a.stl",
        "C:\\a.stl",
        "\\\\server\\a.stl",
        "meshes/../../a.stl",
        "~/a.stl",
        "package:///etc/passwd",
    ],
)
def test_nothing_outside_the_model_folder_is_read(name, tmp_path):
    found = left_out(tmp_path, f'<mesh filename="{name}"/>')
    assert found.what == f'mesh "{name}" lies outside the model folder; it was left out.'
    inside = ImportOptions(package=f"x={tmp_path}")
    found = left_out(tmp_path, '<mesh filename="package://x/../../etc/passwd"/>', inside)
    assert found.what == 'mesh "../../etc/passwd" lies outside the model folder; it was left out.'


@pytest.mark.parametrize(
    "name",
    [
        "file:///home/ros/catkin_ws/src/bot/meshes/a.stl",
        "C:/Users/me/bot/meshes/a.stl",
        "C:\\Users\\me\\bot\\meshes\\a.stl",
        "package://bot_description/meshes/a.stl",
        "../../bot/meshes/a.stl",
        "/somewhere/a.stl",
    ],
)
def test_a_mesh_on_its_maker_s_machine_is_found_beside_the_model(name, tmp_path):
    """The last folders of the name lead to it from the model's folder."""
    place = tmp_path / ("a.stl" if "somewhere" in name else "meshes/a.stl")
    place.parent.mkdir(exist_ok=True)
    place.write_bytes(binary_stl(CORNERS[FACES]))
    tree = read(LEG.replace(BOX, f'<mesh filename="{name}"/>'), tmp_path)
    assert (len(tree.links["tibia_3"].parts[0].faces), tree.findings) == (4, ())


@pytest.mark.skipif(os.name == "nt", reason="making a link needs rights there")
def test_links_are_not_followed(tmp_path):
    (tmp_path / "away").symlink_to("/etc")
    found = left_out(tmp_path, '<mesh filename="away/passwd"/>')
    assert found.what == (
        'mesh "away/passwd" leads over a link, which is not followed; it was left out.'
    )


def test_an_unknown_package_is_named_and_found_when_told(tmp_path):
    mesh = '<mesh filename="package://x/meshes/a.stl"/>'
    found = left_out(tmp_path, mesh)
    assert found.what == 'mesh "meshes/a.stl" is in package "x", which is unknown; it was left out.'
    assert found.hint == 'package = "x=.", with the folder of the package'
    folder = tmp_path / "some" / "where"
    (folder / "meshes").mkdir(parents=True)
    (folder / "meshes" / "a.stl").write_bytes(binary_stl(CORNERS[FACES]))
    tree = read(LEG.replace(BOX, mesh), tmp_path, ImportOptions(package=f"x={folder}"))
    assert len(tree.links["tibia_3"].parts[0].faces) == 4
    nowhere = ImportOptions(package="x=nonexistent")
    error = refused(tmp_path, BOX, mesh, nowhere)
    assert error.what == "no such folder: nonexistent."
    assert error.where.endswith("option --package x")


@pytest.mark.parametrize("by_name", [True, False])
def test_a_package_around_the_file_is_found_by_itself(by_name, tmp_path):
    folder = tmp_path / ("x" if by_name else "checkout")
    (folder / "urdf").mkdir(parents=True)
    (folder / "meshes").mkdir()
    (folder / "meshes" / "a.stl").write_bytes(binary_stl(CORNERS[FACES]))
    if not by_name:
        (folder / "package.xml").write_text("<package><name> x </name></package>")
    for name in ("package://x/meshes/a.stl", "../meshes/a.stl"):
        text = LEG.replace(BOX, f'<mesh filename="{name}"/>')
        assert len(read(text, folder / "urdf").links["tibia_3"].parts[0].faces) == 4


@pytest.mark.parametrize(
    ("color", "read_as", "what"),
    [
        ("255 0 0 1", (1, 0, 0, 1), '<color>: rgba is "255 0 0 1"; it was clipped to 0 to 1.'),
        ("1 0 0", (0.5, 0.5, 0.5, 1), 'rgba is "1 0 0"; it must be 4 numbers; grey was taken.'),
    ],
)
def test_a_colour_refuses_no_robot(color, read_as, what, tmp_path):
    tree = read(LEG.replace('"1 0 0 1"', f'"{color}"'), tmp_path)
    assert tree.links["tibia_3"].parts[0].color == read_as
    (found,) = tree.findings
    assert found.severity is Severity.NOTE
    assert found.what.endswith(what)


@pytest.mark.parametrize(("effort", "is_told"), [("-2", True), ("0", False), ("inf", False)])
def test_an_effort_that_no_motor_has_is_none(effort, is_told, tmp_path):
    tree = read(LEG.replace('effort="2"', f'effort="{effort}"'), tmp_path)
    assert (tree.joints[0].effort, tree.joints[0].velocity) == (None, 6)
    assert [f.severity for f in tree.findings] == [Severity.SUSPECT] * is_told


def test_a_lost_mesh_is_told_once_and_the_robot_is_read(tmp_path):
    two = '<mesh filename="a.dae"/></geometry></visual><visual><geometry><mesh filename="b.stl"/>'
    (tmp_path / "a.dae").write_text("<COLLADA/>")
    tree = read(LEG.replace(BOX, two), tmp_path)
    dae, lost = tree.findings
    assert dae.what == "mesh a.dae was left out: COLLADA files are not read."
    assert dae.hint == "convert it to STL, OBJ, PLY or GLB"
    assert lost.what == 'mesh "b.stl" is not there; it was left out.'
    assert lost.subject == "link tibia_3"


def test_a_mesh_in_millimetres_is_named(tmp_path):
    (tmp_path / "tibia.stl").write_bytes(binary_stl(280 * CORNERS[FACES]))
    mesh = '<mesh filename="tibia.stl"/>'
    found = left_out(tmp_path, mesh)
    assert found.what == "mesh tibia.stl spans 140 m; it was left out."
    assert found.hint == 'mesh_unit = "mm"'
    tree = read(LEG.replace(BOX, mesh), tmp_path, ImportOptions(mesh_unit="mm"))
    longest = float(np.ptp(tree.links["tibia_3"].parts[0].vertices, axis=0).max())
    # The part lies 1 m up, where a number has steps of 2.2e-16.
    assert longest == pytest.approx(0.14, abs=4e-16)


def test_what_is_ignored_is_counted_and_refused_when_strict(tmp_path):
    more = "<safety_controller/><calibration/></joint><transmission><type/></transmission>"
    text = LEG.replace("</joint>", more)
    (found,) = read(text, tmp_path).findings
    assert found.severity is Severity.NOTE
    assert found.what == "1 <calibration>, 1 <safety_controller>, 1 <transmission> were ignored."
    with pytest.raises(InvalidInput, match=r"1 <transmission> were ignored\."):
        import_robot(tmp_path / "robot.urdf", strict=True)
    (found,) = read(LEG.replace("</robot>", "<a><b/></a></robot>"), tmp_path).findings
    assert found.what == "1 <a> was ignored."


@pytest.mark.parametrize(
    ("old", "new", "what", "line"),
    [
        ('value="0.5"', 'value="nan"', '<mass>: value is "nan"; it must be a finite number.', 6),
        ('value="0.5"', 'value="${m}"', '<mass>: value is "${m}"; it must be a number. expand', 6),
        ('"0.1 0 0"', '"0.1 0 1e300"', '<origin>: xyz is "0.1 0 1e300"; numbers must be from', 5),
        ('"0.1 0 0"', '"0.1 0"', '<origin>: xyz is "0.1 0"; it must be 3 numbers.', 5),
        ('ixx="1e-3" ', "", "<inertia> has no ixx.", 7),
        ('link name="base"', "link", "<link> has no name.", 2),
        ('rpy="0 0 1.5707963267948966"', 'rpy="90 0 45"', "<origin>: rpy 90 0 45 rad is more", 5),
        ('child link="tibia_3"', 'child link="base"', "link base hangs on a ring of joints", 2),
        ("</robot>", '<link name="spare"/></robot>', "robot.urdf has 2 root links (base,", 0),
        ("</robot>", MORE.format(name="j5"), "link tibia_3 has two parents (joints coxa_1,", 22),
        ("</robot>", MORE.format(name="coxa_1"), "two joints are called coxa_1.", 15),
        ("</robot>", '<xacro:leg name="a"/></robot>', "robot.urdf line 22: <xacro:leg> is not", 0),
        ('"0.1 0.2 0.3"', '"0.1 0 0.3"', '<box>: size is "0.1 0 0.3"; numbers must be from', 11),
        ('type="revolute"', 'type="revolut"', 'joint coxa_1: type "revolut" is none of', 15),
        ('<parent link="base"/>', "", '<joint name="coxa_1"> has no <parent>.', 15),
        ('child link="tibia_3"', 'child link="foot"', 'joint coxa_1 names a link "foot",', 15),
        ('xyz="0 0 1"/>\n    <l', 'xyz="0 0 0"/><l', "joint coxa_1: its axis has no", 18),
        ('link name="base"', 'link name="tibia_3"', "two links are called tibia_3.", 3),
    ],
)
def test_what_cannot_be_used_is_told_with_its_line_and_what_to_try(old, new, what, line, tmp_path):
    error = refused(tmp_path, old, new)
    assert f"{error.what} {error.hint}".startswith(what)
    assert not line or error.where == f"robot.urdf, line {line}"


def test_a_folder_around_the_file_is_no_package_by_its_name_alone(tmp_path):
    """A file in home/alice/robots asks for what lies in home/bob."""
    folder = tmp_path / "home" / "alice" / "robots"
    folder.mkdir(parents=True)
    (tmp_path / "home" / "bob").mkdir()
    (tmp_path / "home" / "bob" / "secret.stl").write_bytes(binary_stl(CORNERS[FACES]))
    found = left_out(folder, '<mesh filename="package://home/bob/secret.stl"/>')
    assert found.hint == 'package = "home=.", with the folder of the package'
