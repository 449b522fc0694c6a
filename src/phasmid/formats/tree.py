"""A kinematic tree: links and joints of any names, between a file's format and a robot."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidRobot
from phasmid.formats.findings import Finding
from phasmid.robot import Part, Servo
from phasmid.robot.inertial import Inertial

HINGES = frozenset({"revolute", "continuous"})
"""Kinds of joints that turn; a continuous one has no limits."""


@dataclass(frozen=True, eq=False)
class TreeLink:
    """A link of a tree.

    Attributes:
        name: As in the file.
        inertial: Its mass; None where the file gives none.
        parts: Its look, in the link's frame.
        where: File and line.
        balls: Centre in the link's frame and radius of its collision spheres [m], four numbers
            each.
        complete: Whether all of its meshes were read, so that `parts` show where its matter is.
    """

    name: str
    inertial: Inertial | None = None
    parts: tuple[Part, ...] = ()
    where: str = ""
    balls: tuple[tuple[float, float, float, float], ...] = ()
    complete: bool = True


@dataclass(frozen=True, eq=False)
class TreeJoint:
    """A joint of a tree.

    Attributes:
        name: As in the file.
        kind: ``revolute``, ``continuous``, ``fixed``, or another word of the file for a joint
            that walking robots' legs do not have.
        parent: Name of the link that carries it.
        child: Name of the link that it moves.
        X_parent_child: Pose of the child's frame in the parent's at joint angle 0, shape (4, 4).
        axis: Unit vector in the child's frame about which it turns, shape (3,).
        lower: Lowest angle [rad]; minus infinity without a limit.
        upper: Highest angle [rad]; infinity without a limit.
        effort: Largest torque [N·m]; None where it is unknown.
        velocity: Highest speed [rad/s]; None where it is unknown.
        damping: Viscous friction [N·m·s/rad].
        friction: Dry friction [N·m].
        armature: Inertia of the rotor behind the gears [kg·m²].
        where: File and line.
    """

    name: str
    kind: str
    parent: str
    child: str
    X_parent_child: Float[np.ndarray, "4 4"]
    axis: Float[np.ndarray, "3"] = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    lower: float = -np.inf
    upper: float = np.inf
    effort: float | None = None
    velocity: float | None = None
    damping: float = 0.0
    friction: float = 0.0
    armature: float = 0.0
    where: str = ""


@dataclass(frozen=True, eq=False)
class Tree:
    """Links and joints that form one tree.

    Attributes:
        name: Of the robot.
        links: By name, in the file's order.
        joints: In the file's order.
        file: Name of the file, for messages.
        findings: What the reader ignored or assumed.
        servo: The motor of every joint; None where the file names none.

    Raises:
        InvalidRobot: A joint names a link that is not there, a link has two parents, or there is
            no root link or more than one.
    """

    name: str
    links: Mapping[str, TreeLink]
    joints: tuple[TreeJoint, ...]
    file: str = ""
    findings: tuple[Finding, ...] = ()
    servo: Servo | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "links", MappingProxyType(dict(self.links)))
        names = Counter(joint.name for joint in self.joints)
        for joint in self.joints:
            if names[joint.name] > 1:
                raise InvalidRobot(f"two joints are called {joint.name}.", where=joint.where)
            for end in (joint.parent, joint.child):
                if end not in self.links:
                    raise InvalidRobot(
                        f'joint {joint.name} names a link "{end}", which is not there.',
                        where=joint.where,
                    )
        by_child: dict[str, TreeJoint] = {}
        for joint in self.joints:
            first = by_child.setdefault(joint.child, joint)
            if first is not joint:
                raise InvalidRobot(
                    f"link {joint.child} has two parents (joints {first.name}, {joint.name}).",
                    where=joint.where,
                )
        roots = [name for name in self.links if name not in by_child]
        if len(roots) != 1:
            named = f" ({', '.join(roots[:6])}{', …' if len(roots) > 6 else ''})" if roots else ""
            raise InvalidRobot(
                f"{self.file or self.name} has {len(roots)} root links{named}; "
                "exactly 1 is needed.",
            )
        # Links on a closed loop of joints are not reached from the root.
        reached = {roots[0]}
        frontier = [roots[0]]
        while frontier:
            for joint in self.joints_from(frontier.pop()):
                reached.add(joint.child)
                frontier.append(joint.child)
        lost = [name for name in self.links if name not in reached]
        if lost:
            raise InvalidRobot(
                f"link {lost[0]} hangs on a ring of joints that is not tied to the root link.",
                where=self.links[lost[0]].where,
            )

    @cached_property
    def root(self) -> TreeLink:
        """The link without a parent."""
        children = {joint.child for joint in self.joints}
        return next(link for name, link in self.links.items() if name not in children)

    @cached_property
    def _outgoing(self) -> Mapping[str, tuple[TreeJoint, ...]]:
        outgoing: dict[str, list[TreeJoint]] = {name: [] for name in self.links}
        for joint in self.joints:
            outgoing[joint.parent].append(joint)
        return {name: tuple(joints) for name, joints in outgoing.items()}

    def joints_from(self, link: str) -> tuple[TreeJoint, ...]:
        """Joints that a link carries."""
        return self._outgoing[link]
