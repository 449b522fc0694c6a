"""What is written as URDF reads back as it was, to the last digit but for the rotations."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from formats.tetrahedron import CORNERS, FACES
from formats.trees import write
from phasmid.errors import InvalidInput
from phasmid.formats import Inertial, Tree, TreeJoint, TreeLink, read_urdf, tree_of
from phasmid.formats.urdf_out import FOOT_RADIUS, rpy_of, urdf_files
from phasmid.kinematics import rotation_rpy
from phasmid.robot import Part, load_robot

# Nine products of sines and cosines that are exact to a unit in the last place, and angles of up
# to pi, themselves rounded by 4.4e-16: some units of 2.2e-16.
ROTATION = 3e-15


def through_file(tree: Tree, folder: Path) -> Tree:
    return read_urdf(write(urdf_files(tree, "robot"), folder))


@given(
    roll=st.floats(-np.pi, np.pi),
    pitch=st.floats(-np.pi / 2, np.pi / 2),
    yaw=st.floats(-np.pi, np.pi),
)
def test_any_rotation_has_its_roll_pitch_and_yaw(roll: float, pitch: float, yaw: float) -> None:
    R = rotation_rpy(roll, pitch, yaw)
    np.testing.assert_allclose(rotation_rpy(*rpy_of(R)), R, atol=ROTATION)


@pytest.mark.parametrize("pitch", [-np.pi / 2, np.pi / 2])
@pytest.mark.parametrize("off", [0.0, 1e-16, 1e-12, 3e-9, 1e-8, 1e-6, 1e-4])
def test_a_rotation_is_exact_where_roll_and_yaw_are_one(pitch: float, off: float) -> None:
    """Near a pitch of a right angle only roll - yaw or roll + yaw is determined."""
    rng = np.random.default_rng(3)
    for roll, yaw in rng.uniform(-np.pi, np.pi, (50, 2)):
        # A product of three rotations as a robot's chain gives it, not the formula's own form.
        R = (
            rotation_rpy(0, 0, yaw)
            @ rotation_rpy(0, pitch - np.copysign(off, pitch), 0)
            @ rotation_rpy(roll, 0, 0)
        )
        np.testing.assert_allclose(rotation_rpy(*rpy_of(R)), R, atol=ROTATION)


def test_a_robot_without_a_look_is_shown_by_sticks_that_are_no_part_of_it(tmp_path: Path) -> None:
    tree = tree_of(replace(load_robot("phantomx-paper"), appearance=None))
    path = write(urdf_files(tree, "robot"), tmp_path)
    text = path.read_text(encoding="utf-8")
    # Six hips, and three links of six legs.
    assert text.count("<cylinder") == 6 + 18
    assert text.count(f'<sphere radius="{FOOT_RADIUS}" />') == 6
    assert not any(link.parts for link in read_urdf(path).links.values())


def test_what_urdf_cannot_say_reads_back_as_it_was(tmp_path: Path) -> None:
    link = {name: TreeLink(name) for name in ("base", "a", "b", "c")}
    turn = np.eye(4)
    joints = (
        TreeJoint("j1", "continuous", "base", "a", turn, effort=None, velocity=None),
        TreeJoint("j2", "revolute", "base", "b", turn, lower=-1.0, effort=2.0, armature=0.01),
        TreeJoint("j3", "prismatic", "base", "c", turn, lower=-0.1, upper=0.2, velocity=3.0),
    )
    back = through_file(Tree("r", link, joints), tmp_path)
    for joint, again in zip(joints, back.joints, strict=True):
        for field in ("kind", "lower", "upper", "effort", "velocity", "armature"):
            assert getattr(joint, field) == getattr(again, field), (joint.name, field)


def test_names_of_any_letters_are_kept(tmp_path: Path) -> None:
    names = ('base "&" <b>', "Übergelenk/1", "übergelenk/1", "../../etc/passwd")
    part = Part(CORNERS, FACES)
    links = {name: TreeLink(name, Inertial(1.0, np.zeros(3), np.eye(3)), (part,)) for name in names}
    joints = tuple(TreeJoint(f"j'{n}'", "fixed", names[0], n, np.eye(4)) for n in names[1:])
    files = urdf_files(Tree("a\u0007b", links, joints), "robot")
    assert all(".." not in name for name in files)
    back = read_urdf(write(files, tmp_path))
    assert tuple(back.links) == names
    assert [joint.name for joint in back.joints] == [joint.name for joint in joints]


def test_a_joint_that_urdf_does_not_have_is_refused() -> None:
    links = {name: TreeLink(name) for name in ("base", "a")}
    tree = Tree("r", links, (TreeJoint("j", "ball", "base", "a", np.eye(4)),))
    with pytest.raises(InvalidInput, match="joint j is ball; URDF has no such joint"):
        urdf_files(tree, "robot")
