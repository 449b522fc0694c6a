"""Legs of a kinematic tree: chains of three hinges that leave the trunk."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidRobot
from phasmid.formats.findings import Finding, Findings
from phasmid.formats.tree import HINGES, RigidLink, Tree, TreeJoint, fixed_to, rigid_link
from phasmid.robot.table import MOST_LEGS

FREE = frozenset({"floating", "free"})
"""Kinds of joints by which some files let the trunk move against the world."""

FLAT = 0.25
"""Hips that spread along one axis by less than this part of their spread along z lie in a level
square to that axis, and z is not up."""

MIRRORED = 0.02
"""Hips within this of each other's mirror image are a pair [m]; more than builders' slips and
less than the width of any servo."""


@dataclass(frozen=True, eq=False)
class Chain:
    """Three hinges in a row, from the trunk outwards.

    Attributes:
        joints: Coxa's, femur's and tibia's.
        links: The links that they move, each with the links fixed to it.
        poses: Pose of each link's first frame in the trunk at joint angles 0, shape (3, 4, 4).
    """

    joints: tuple[TreeJoint, ...]
    links: tuple[RigidLink, ...]
    poses: Float[np.ndarray, "3 4 4"]

    @property
    def axes(self) -> Float[np.ndarray, "3 3"]:
        """The hinges' axes in the trunk at joint angles 0, shape (3, 3)."""
        return np.array(
            [
                X[:3, :3] @ (joint.axis / np.linalg.norm(joint.axis))
                for X, joint in zip(self.poses, self.joints, strict=True)
            ]
        )

    @property
    def hip(self) -> Float[np.ndarray, "3"]:
        """The point of the coxa axis that is nearest to the femur axis [m], shape (3,)."""
        coxa, femur, _ = self.axes
        across = np.cross(coxa, femur)
        p = self.poses[0, :3, 3]
        square = float(across @ across)
        if not square:
            return p
        along = float(np.cross(self.poses[1, :3, 3] - p, femur) @ across) / square
        return np.asarray(p + along * coxa)


@dataclass(frozen=True, eq=False)
class Skeleton:
    """A tree as a walking robot's: a trunk and legs.

    Attributes:
        trunk: The trunk with all that does not move, or is held, against it.
        chains: The legs, as the file lists them; in a trunk that has z up.
        X_up_trunk: Pose of the trunk's own frame in that trunk, shape (4, 4).
        findings: Branches that were held or left out.
    """

    trunk: RigidLink
    chains: tuple[Chain, ...]
    X_up_trunk: Float[np.ndarray, "4 4"]
    findings: tuple[Finding, ...]

    @property
    def bodies(self) -> tuple[RigidLink, ...]:
        """The trunk and all links of the legs."""
        return (self.trunk, *(link for chain in self.chains for link in chain.links))


def skeleton(tree: Tree) -> Skeleton:
    """Find a tree's trunk and legs, by what moves on what and by no name.

    Links that joints fix to each other are one. A branch that is no leg, such as a head or a
    gripper, is held at angle 0 and belongs to the link that carries it.

    Args:
        tree: The tree.

    Raises:
        InvalidRobot: There are fewer than four chains of three hinges, or one leg of a pair has
            another number of them; or there are more than `MOST_LEGS`.
    """
    root, findings = _trunk(tree)
    trunk = rigid_link(tree, root)
    # Legs are compared with each other, so that time grows with the square of their number.
    if len(trunk.joints) > MOST_LEGS:
        raise InvalidRobot(
            f"{tree.file or tree.name} has {len(trunk.joints)} moving joints that leave {root}; "
            f"a robot here has at most {MOST_LEGS} legs."
        )
    legs: list[tuple[TreeJoint, ...]] = []
    odd: list[tuple[TreeJoint, list[TreeJoint]]] = []
    extra: list[TreeJoint] = []
    for first in trunk.joints:
        paths = _paths(tree, first)
        leg = _leg_among(paths)
        if leg is None:
            odd.append((first, max(paths, key=len)))
        else:
            legs.append(leg)
            extra += [j for path in paths for j in path if j not in leg]
    hips = [trunk.pose_of(joints[0])[:3, 3] for joints in legs]
    wrong = [
        (first, path)
        for first, path in odd
        if len(legs) < 4 or _belongs_to_a_pair(trunk.pose_of(first)[:3, 3], hips)
    ]
    if wrong:
        raise _not_three(wrong, len(legs))
    extra += [j for first, _ in odd for path in _paths(tree, first) for j in path]
    if len(legs) < 4:
        raise InvalidRobot(
            f"{tree.file or tree.name} has {len(legs)} chains of three hinges that leave "
            f"{root}; a walking robot here has 4 legs or more."
        )
    held = {joint.name: joint for joint in extra}
    if held:
        names = ", ".join(list(held)[:6]) + (", …" if len(held) > 6 else "")
        noun = "joint" if len(held) == 1 else "joints"
        findings.note(f"{noun} {names}", "held at angle 0, as part of no leg.", extra[0].where)
    trunk = rigid_link(tree, root, held)
    chains = tuple(_chain(tree, trunk, leg, held) for leg in legs)
    X_up_trunk = _upright(chains, findings)
    chains = tuple(replace(chain, poses=X_up_trunk @ chain.poses) for chain in chains)
    return Skeleton(trunk, chains, X_up_trunk, tuple(findings))


def _upright(chains: Sequence[Chain], findings: Findings) -> Float[np.ndarray, "4 4"]:
    """Return the trunk's frame in one with z up: its own, unless its hips show another.

    Hips lie in one level, or nearly so. Files of drawings in which y is up have theirs in x and z.
    """
    spans = np.ptp([chain.hip for chain in chains], axis=0)
    up = int(np.argmin(spans))
    if up == 2 or spans[up] > FLAT * spans[2]:
        return np.eye(4)
    feet = np.sum([_end(chain) - chain.hip for chain in chains], axis=0)
    forward = 0 if up == 1 else 1
    X = np.eye(4)
    X[0, :3], X[2, :3] = np.eye(3)[forward], np.eye(3)[up] * (-1.0 if feet[up] > 0 else 1.0)
    X[1, :3] = np.cross(X[2, :3], X[0, :3])
    sign = "-" if feet[up] > 0 else ""
    findings.suspect(
        "trunk",
        f"its hips spread {1000 * spans[2]:.0f} mm along z and {1000 * spans[up]:.0f} mm along "
        f"{'xyz'[up]}; {sign}{'xyz'[up]} was taken as up and {'xyz'[forward]} as forward.",
        hint="give the root link x forward, y left and z up",
    )
    return X


def _end(chain: Chain) -> Float[np.ndarray, "3"]:
    """Return a point near the end of a leg, in the trunk."""
    tibia, X = chain.links[2], chain.poses[2]
    points = [tibia.poses[link.name][:3, 3] for link in tibia.ends]
    points += [part.vertices.mean(axis=0) for part in tibia.parts]
    point = np.mean(points or [np.zeros(3)], axis=0)
    return np.asarray(X[:3, :3] @ point + X[:3, 3])


def _trunk(tree: Tree) -> tuple[str, Findings]:
    """Return the root, or the link that moves freely in it."""
    root, findings = rigid_link(tree, tree.root.name), Findings()
    if len(root.joints) != 1 or root.joints[0].kind not in FREE:
        return root.name, findings
    joint = root.joints[0]
    what = f"was left out: joint {joint.name} lets {joint.child}, the trunk, move freely in it."
    findings.note(f"link {root.name}", what, joint.where)
    return joint.child, findings


def _paths(tree: Tree, first: TreeJoint) -> list[list[TreeJoint]]:
    """Return every path along moving joints from one of them to an end."""
    finished: list[list[TreeJoint]] = []
    open_paths = [[first]]
    while open_paths:
        path = open_paths.pop(0)
        _, onward = fixed_to(tree, path[-1].child)
        if not onward:
            finished.append(path)
        open_paths += [[*path, joint] for joint in onward]
    return finished


def _leg_among(paths: list[list[TreeJoint]]) -> tuple[TreeJoint, ...] | None:
    """Return the three hinges of a leg; a branch may have further moving parts."""
    whole = [path for path in paths if len(path) == 3]
    if len(whole) != 1:
        # A gripper of several fingers at the end of the third link, or no leg.
        stem = [j for steps in zip(*paths, strict=False) for j in steps[:1] if len(set(steps)) == 1]
        whole = [stem] if len(paths) > 1 and len(stem) == 3 else []
    if len(paths) == 1 and all(joint.kind not in HINGES for joint in paths[0][3:]):
        # A foot on a spring, or a gripper of one slide.
        whole = [paths[0][:3]] if len(paths[0]) >= 3 else []
    if not whole or any(joint.kind not in HINGES for joint in whole[0]):
        return None
    return tuple(whole[0])


def _belongs_to_a_pair(hip: np.ndarray, hips: list[np.ndarray]) -> bool:
    """Return whether a hip mirrors, left to right, that of a leg without another partner."""

    def distance(a: np.ndarray, b: np.ndarray) -> float:
        return float(np.linalg.norm(a * [1, -1, 1] - b))

    alone = [
        h
        for i, h in enumerate(hips)
        if not any(distance(h, other) < MIRRORED for j, other in enumerate(hips) if j != i)
        and abs(h[1]) > MIRRORED
    ]
    return any(distance(hip, h) < MIRRORED for h in alone)


def _not_three(wrong: list[tuple[TreeJoint, list[TreeJoint]]], legs: int) -> InvalidRobot:
    """Return the error for chains that are no legs; it names one of the most frequent length."""
    # Legs come in numbers: a head or an arm beside them is a chain of a length of its own.
    counts = Counter(len(path) for _, path in wrong)
    length = max(counts, key=lambda length: (counts[length], length))
    first, path = next((first, path) for first, path in wrong if len(path) == length)
    names = ", ".join(joint.name for joint in path[:6]) + (", …" if len(path) > 6 else "")
    other = next((joint for joint in path if joint.kind not in HINGES), None)
    if other is not None:
        what = f"joint {other.name} is {other.kind}"
    else:
        what = f"it has {len(path)} hinge{'s' if len(path) > 1 else ''} ({names})"
        if counts[length] > 1:
            what += f", as {counts[length] - 1} more of its chains have"
    return InvalidRobot(
        f"leg at joint {first.name}: {what}; this model needs 3 hinges in a row, "
        "for coxa, femur and tibia.",
        where=first.where,
        hint="" if legs >= 4 else "make joints that do not move in walking fixed ones",
    )


def _chain(
    tree: Tree, trunk: RigidLink, joints: tuple[TreeJoint, ...], held: dict[str, TreeJoint]
) -> Chain:
    links, poses = [trunk], [np.eye(4)]
    for joint in joints:
        poses.append(poses[-1] @ links[-1].pose_of(joint))
        links.append(rigid_link(tree, joint.child, held))
    return Chain(joints, tuple(links[1:]), np.array(poses[1:]))
