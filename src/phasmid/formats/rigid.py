"""Rigid links: links of a tree that no joint moves against each other."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from jaxtyping import Float

from phasmid.formats.tree import Tree, TreeJoint, TreeLink
from phasmid.robot import Part
from phasmid.robot.inertial import Inertial, merged


@dataclass(frozen=True, eq=False)
class RigidLink:
    """Links of a file that move as one, in the frame of the first of them.

    Attributes:
        links: The links, that which stands nearest the root first.
        poses: Pose of each link's frame in the first one's, by name, shape (4, 4).
        joints: The joints that it carries and that move.
        ends: Those of its links that carry no joint at all, besides the first.
        inertial: Mass and inertia of all of them; None where none has any.
        parts: Their look.
    """

    links: tuple[TreeLink, ...]
    poses: Mapping[str, Float[np.ndarray, "4 4"]]
    joints: tuple[TreeJoint, ...]
    ends: tuple[TreeLink, ...]
    inertial: Inertial | None
    parts: tuple[Part, ...]

    @property
    def name(self) -> str:
        """Name of its first link."""
        return self.links[0].name

    def pose_of(self, joint: TreeJoint) -> Float[np.ndarray, "4 4"]:
        """Pose in it, at joint angle 0, of the link that a joint moves."""
        return self.poses[joint.parent] @ joint.X_parent_child


def rigid_link(tree: Tree, first: str, held: Collection[str] = ()) -> RigidLink:
    """Join a link and all that is fixed to it, outwards.

    Args:
        tree: The tree.
        first: Name of the link.
        held: Names of joints that are taken as fixed at angle 0 though they could move.
    """
    poses, moving = fixed_to(tree, first, held)
    links = tuple(tree.links[name] for name in poses)
    for X in poses.values():
        X.flags.writeable = False
    return RigidLink(
        links,
        MappingProxyType(poses),
        moving,
        tuple(link for link in links[1:] if not tree.joints_from(link.name)),
        merged([link.inertial.at(poses[link.name]) for link in links if link.inertial]),
        tuple(part.at(poses[link.name]) for link in links for part in link.parts),
    )


def fixed_to(
    tree: Tree, first: str, held: Collection[str] = ()
) -> tuple[dict[str, Float[np.ndarray, "4 4"]], tuple[TreeJoint, ...]]:
    """Find all links that are fixed to a link, outwards, and the joints that they carry.

    Args:
        tree: The tree.
        first: Name of the link.
        held: Names of joints that are taken as fixed at angle 0 though they could move.

    Returns:
        Pose of each link's frame in the first one's, by name; and the joints that move.
    """
    poses = {first: np.eye(4)}
    moving: list[TreeJoint] = []
    frontier = [first]
    while frontier:
        parent = frontier.pop()
        for joint in tree.joints_from(parent):
            if joint.kind == "fixed" or joint.name in held:
                poses[joint.child] = poses[parent] @ joint.X_parent_child
                frontier.append(joint.child)
            else:
                moving.append(joint)
    return poses, tuple(moving)


def inverse(X: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "4 4"]:
    """Return the inverse of a pose."""
    R = X[:3, :3].T
    Y = np.eye(4)
    Y[:3, :3], Y[:3, 3] = R, -R @ X[:3, 3]
    return Y
