"""A tree is one tree, and a robot's tree carries the robot's numbers."""

from __future__ import annotations

import numpy as np
import pytest

from phasmid.errors import InvalidRobot
from phasmid.formats import Tree, TreeJoint, TreeLink, tree_of
from phasmid.kinematics import leg_frames
from phasmid.robot import JOINTS, load_robot, preset_names


def links(*names: str) -> dict[str, TreeLink]:
    return {name: TreeLink(name) for name in names}


def joint(name: str, parent: str, child: str) -> TreeJoint:
    return TreeJoint(name, "revolute", parent, child, np.eye(4))


def test_i6_two_roots_are_named() -> None:
    with pytest.raises(InvalidRobot) as refused:
        Tree("r", links("base", "spare", "a"), (joint("j", "base", "a"),), file="robot.urdf")
    assert refused.value.what == ("robot.urdf has 2 root links (base, spare); exactly 1 is needed.")


def test_i7_a_link_has_one_parent() -> None:
    joints = (joint("j1", "base", "a"), joint("j5", "base", "b"), joint("j9", "a", "b"))
    with pytest.raises(InvalidRobot) as refused:
        Tree("r", links("base", "a", "b"), joints)
    assert refused.value.what == "link b has two parents (joints j5, j9)."


def test_a_ring_of_joints_is_no_tree() -> None:
    joints = (joint("j1", "a", "b"), joint("j2", "b", "a"))
    with pytest.raises(InvalidRobot, match="has 0 root links; exactly 1"):
        Tree("r", links("a", "b"), joints)
    with pytest.raises(InvalidRobot, match="link a hangs on a ring"):
        Tree("r", links("base", "a", "b"), joints)


def test_joints_join_links_that_are_there_and_have_their_own_names() -> None:
    with pytest.raises(InvalidRobot, match='joint j names a link "b", which is not there'):
        Tree("r", links("base", "a"), (joint("j", "base", "b"),))
    with pytest.raises(InvalidRobot, match="two joints are called j"):
        Tree("r", links("base", "a", "b"), (joint("j", "base", "a"), joint("j", "a", "b")))


@pytest.mark.parametrize("preset", preset_names())
def test_the_tree_of_a_robot_has_the_frames_of_its_legs(preset: str) -> None:
    """X_body_foot down the tree, each hinge turned about its z, is the legs' own chain."""
    robot = load_robot(preset)
    tree = tree_of(robot)
    rng = np.random.default_rng(5)
    for leg in robot.legs:
        q = rng.uniform(-1, 1, 3)
        X, name = np.eye(4), tree.root.name
        joints = (*(f"{leg.name}_{joint}" for joint in JOINTS), f"{leg.name}_foot_joint")
        for angle, joint in zip((*q, 0.0), joints, strict=True):
            (step,) = [j for j in tree.joints_from(name) if j.name == joint]
            turn = np.eye(4)
            turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
            X, name = X @ step.X_parent_child @ turn, step.child
        assert name == f"{leg.name}_foot"
        # Four products of entries of order 0.1 m and 1.
        np.testing.assert_allclose(X, leg.X_body_hip @ leg_frames(leg, q)[-1], atol=1e-15)
    masses = [link.inertial.mass for link in tree.links.values() if link.inertial]
    assert sum(masses) == pytest.approx(robot.mass, rel=1e-15)
