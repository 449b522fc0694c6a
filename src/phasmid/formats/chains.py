"""Trunk and legs of a kinematic tree: chains of three hinges that leave the trunk."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidRobot
from phasmid.formats.findings import Findings
from phasmid.formats.tree import (
    HINGES,
    RigidLink,
    Tree,
    TreeJoint,
    fixed_to,
    rigid_link,
    with_link_turned,
)
from phasmid.robot.table import MOST_LEGS
from phasmid.units import plain_number

FREE = frozenset({"floating", "free"})
"""Kinds of joints by which some files let the trunk move against the world."""

FLAT = 0.25
"""Hips that spread along x or y by less than this part of their spread along z lie in an upright
plane: z is not up."""

TURN = 2 * math.pi
"""A range of this or more stops no angle [rad]."""

DEGREES = 20.0
"""Limits from here on are taken for degrees [rad]: no published leg turns by three turns."""


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
        axes = [joint.axis / np.linalg.norm(joint.axis) for joint in self.joints]
        return np.einsum("lij,lj->li", self.poses[:, :3, :3], axes)

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
    """A tree as a walking robot's: a trunk with all that is held against it, and legs."""

    trunk: RigidLink
    chains: tuple[Chain, ...]


def skeleton(tree: Tree, findings: Findings, forward: float = 0.0) -> Skeleton:
    """Find a tree's trunk and legs, by what moves on what and by no name.

    Links that joints fix to each other are one. A branch that is no leg, such as a head or a
    gripper, is held at angle 0 and belongs to the link that carries it.

    Args:
        tree: The tree.
        findings: Receives branches that were held or left out.
        forward: Direction of forward in the trunk's own frame, seen from above and from x [°], a
            multiple of 90.

    Raises:
        InvalidRobot: Chains of three hinges are too few, too many or odd; or z is not up.
    """
    root = _trunk(tree, findings)
    tree = with_link_turned(tree, root, -round(forward / 90))
    _, first_joints = fixed_to(tree, root)
    # Legs are compared with each other, so that time grows with the square of their number.
    if len(first_joints) > MOST_LEGS:
        raise InvalidRobot(
            f"{tree.file or tree.name} has {len(first_joints)} moving joints that leave {root}; "
            f"a robot here has at most {MOST_LEGS} legs."
        )
    stems = [_stem(tree, joint) for joint in first_joints]
    legs = [stem[:3] for stem in stems if _is_leg(stem)]
    others = [stem for stem in stems if not _is_leg(stem)]
    # Legs come in pairs: of an odd number one was not recognised.
    if others and (len(legs) < 4 or len(legs) % 2):
        raise _not_three(others)
    if len(legs) < 4:
        raise InvalidRobot(
            f"{tree.file or tree.name} has {len(legs)} chains of three hinges that leave "
            f"{root}; a walking robot here has 4 legs or more."
        )
    moving = {joint.name for leg in legs for joint in leg}
    held = [
        joint
        for joint in tree.joints
        if joint.kind != "fixed" and joint.name not in moving and joint.child != root
    ]
    if held:
        names = ", ".join(joint.name for joint in held[:6]) + (", …" if len(held) > 6 else "")
        noun = "joint" if len(held) == 1 else "joints"
        findings.note(f"{noun} {names}", "held at angle 0, as part of no leg.", held[0].where)
    joints = (replace(joint, kind="fixed") if joint in held else joint for joint in tree.joints)
    tree = replace(tree, joints=tuple(joints))
    trunk = rigid_link(tree, root)
    chains = tuple(_chain(tree, trunk, leg) for leg in legs)
    spans = np.ptp([chain.hip for chain in chains], axis=0)
    if min(spans[:2]) < FLAT * spans[2]:
        raise InvalidRobot(
            f"the hips spread {1000 * spans[2]:.0f} mm along z and {1000 * min(spans[:2]):.0f} mm "
            f"along {'xy'[np.argmin(spans[:2])]}; z must be up.",
            where=tree.links[root].where,
            hint="give the root link x forward, y left and z up",
        )
    return Skeleton(trunk, chains)


def _trunk(tree: Tree, findings: Findings) -> str:
    """Return the root, or the link that moves freely in it."""
    root = tree.root.name
    _, joints = fixed_to(tree, root)
    if len(joints) != 1 or joints[0].kind not in FREE:
        return root
    what = f"was left out: joint {joints[0].name} lets {joints[0].child}, the trunk, move freely."
    findings.note(f"link {root}", what, joints[0].where)
    return joints[0].child


def _stem(tree: Tree, first: TreeJoint) -> tuple[TreeJoint, ...]:
    """Return the joints in a row from one of them outwards, up to an end or a branch."""
    stem, onward = [first], fixed_to(tree, first.child)[1]
    while len(onward) == 1:
        stem.append(onward[0])
        onward = fixed_to(tree, onward[0].child)[1]
    return tuple(stem)


def _is_leg(stem: Sequence[TreeJoint]) -> bool:
    """Return whether a stem is three hinges, with at most slides, or a gripper, behind them."""
    hinges = [joint.kind in HINGES for joint in stem]
    return sum(hinges) == 3 and all(hinges[:3])


def _not_three(stems: Sequence[Sequence[TreeJoint]]) -> InvalidRobot:
    """Return the error for chains that are no legs; it names one of the most frequent length."""
    # Legs come in numbers: a head or an arm beside them is a chain of a length of its own.
    counts = Counter(map(len, stems))
    length = max(counts, key=lambda length: (counts[length], length))
    stem = next(stem for stem in stems if len(stem) == length)
    names = ", ".join(joint.name for joint in stem[:6]) + (", …" if len(stem) > 6 else "")
    other = next((joint for joint in stem if joint.kind not in HINGES), None)
    if other is not None:
        what = f"joint {other.name} is {other.kind}"
    else:
        what = f"it has {len(stem)} hinge{'s' if len(stem) > 1 else ''} ({names})"
        if counts[length] > 1:
            what += f", as {counts[length] - 1} more of its chains have"
    return InvalidRobot(
        f"leg at joint {stem[0].name}: {what}; this model needs 3 hinges in a row, "
        "for coxa, femur and tibia.",
        where=stem[0].where,
        hint="make joints that do not move in walking fixed ones",
    )


def _chain(tree: Tree, trunk: RigidLink, joints: tuple[TreeJoint, ...]) -> Chain:
    links, poses = [trunk], [np.eye(4)]
    for joint in joints:
        poses.append(poses[-1] @ links[-1].pose_of(joint))
        links.append(rigid_link(tree, joint.child))
    return Chain(joints, tuple(links[1:]), np.array(poses[1:]))


def with_stops(joint: TreeJoint, assumed: float | None, findings: Findings) -> TreeJoint:
    """Return a hinge with its stops, those of an option, or none.

    A range of a turn or more is that of a motor that turns without end. Such joints, as continuous
    ones and those without limits, have half a turn to either side, or the assumed angle [rad].
    """
    subject, is_continuous = f"joint {joint.name}", joint.kind == "continuous"
    lower, upper = joint.lower, joint.upper
    ends = [abs(end) for end in (lower, upper) if math.isfinite(end)]
    is_likely = True
    words = f"limits {plain_number(lower)} to {plain_number(upper)} rad"
    if is_continuous:
        why = "it is continuous"
    elif lower == upper and not (lower == 0 and assumed is not None):
        what = f"{words} let it not move."
        findings.impossible(subject, what, joint.where, "--joint-limit-deg 90, or its stops")
        return replace(joint, lower=-math.inf, upper=math.inf)
    elif lower == upper == 0:
        why = f"{words} let it not move"
    elif lower >= upper:
        what = f"{words}; the upper must be larger."
        findings.impossible(subject, what, joint.where, "swap them in the file")
        return replace(joint, lower=-math.inf, upper=math.inf)
    elif max(ends, default=0.0) >= DEGREES:
        why, is_likely = f"{words} are {plain_number(max(ends) / TURN, 2)} turns", False
    elif not ends:
        why = "no limits in the file"
    elif upper - lower >= TURN and len(ends) == 2:
        why = f"{words} are a turn or more and no stops"
    else:
        if len(ends) == 1:
            half = math.pi if assumed is None else assumed
            what = f"{words}; ±{plain_number(math.degrees(half))}° was assumed at the other end."
            findings.note(subject, what, joint.where)
            if assumed is not None:
                lower, upper = max(lower, -assumed), min(upper, assumed)
        return replace(joint, lower=lower, upper=upper)
    half = math.pi if assumed is None else assumed
    what = f"{why}; ±{plain_number(math.degrees(half))}° was assumed."
    if not is_likely:
        radians = " to ".join(plain_number(math.radians(end)) for end in (lower, upper))
        findings.suspect(subject, what, joint.where, f"{radians} in the file, if these are degrees")
    else:
        hint = "--joint-limit-deg 90, for servos that turn by ±90°" if assumed is None else ""
        findings.note(subject, what, joint.where, hint)
    if assumed is None:
        return replace(joint, lower=-math.inf, upper=math.inf)
    return replace(joint, kind="revolute", lower=-assumed, upper=assumed)
