"""Links of a tree that no joint moves against each other, taken as one."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from jaxtyping import Float

from phasmid.formats.tree import Inertial, Tree, TreeJoint, TreeLink
from phasmid.robot import Part


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
    """A link and all that is fixed to it, outwards.

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
        merged([(poses[link.name], link.inertial) for link in links if link.inertial]),
        tuple(part.at(poses[link.name]) for link in links for part in link.parts),
    )


def fixed_to(
    tree: Tree, first: str, held: Collection[str] = ()
) -> tuple[dict[str, Float[np.ndarray, "4 4"]], tuple[TreeJoint, ...]]:
    """Poses of all links that are fixed to a link, outwards, and the joints that they carry.

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


def merged(pieces: Sequence[tuple[Float[np.ndarray, "4 4"], Inertial]]) -> Inertial | None:
    """Mass and inertia of several bodies that are fixed to each other.

    Args:
        pieces: Pose of each body's frame in the common one, and its mass and inertia.

    Returns:
        Those of the whole in the common frame; None where there is no piece.

    Source: the parallel axis theorem, I + m (d·d 1 − d dᵀ).
    """
    placed = [moved(inertial, X) for X, inertial in pieces]
    if len(placed) < 2:
        return placed[0] if placed else None
    mass = sum(p.mass for p in placed)
    if mass <= 0:
        # Nothing to weigh the places with: bodies of no mass.
        return Inertial(mass, placed[0].com, sum((p.inertia for p in placed), np.zeros((3, 3))))
    com = sum((p.mass * p.com for p in placed), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for p in placed:
        d = p.com - com
        inertia += p.inertia + p.mass * (d @ d * np.eye(3) - np.outer(d, d))
    return Inertial(mass, com, inertia)


def moved(inertial: Inertial, X: Float[np.ndarray, "4 4"]) -> Inertial:
    """Mass and inertia in another frame.

    Args:
        inertial: As in its own frame.
        X: Pose of that frame in the other, a homogeneous transform, shape (4, 4).
    """
    R = X[:3, :3]
    com = R @ np.asarray(inertial.com, dtype=float) + X[:3, 3]
    tensor = R @ np.asarray(inertial.inertia, dtype=float) @ R.T
    # Round-off leaves the two halves a little apart.
    return Inertial(float(inertial.mass), com, (tensor + tensor.T) / 2)


def inverse(X: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "4 4"]:
    """The inverse of a pose."""
    R = X[:3, :3].T
    Y = np.eye(4)
    Y[:3, :3], Y[:3, 3] = R, -R @ X[:3, 3]
    return Y
