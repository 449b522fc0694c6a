"""What is written as URDF reads back as it was, to the last digit but for the rotations."""

from dataclasses import replace

import numpy as np
import pytest

from formats.tetrahedron import CORNERS, FACES
from formats.trees import write
from phasmid.formats import Tree, TreeJoint, TreeLink, tree_of
from phasmid.formats.tree import rpy_of
from phasmid.formats.urdf_in import read_urdf
from phasmid.formats.urdf_out import FOOT_RADIUS, urdf_files
from phasmid.kinematics import rotation_rpy
from phasmid.robot import Part, load_robot
from phasmid.robot.inertial import Inertial

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
