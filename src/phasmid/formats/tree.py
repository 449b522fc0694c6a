"""Kinematic trees: links and joints of any names, between a file's format and a robot."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidRobot, Unreachable
from phasmid.formats.findings import Finding
from phasmid.kinematics import joint_angles
from phasmid.robot import JOINTS, Leg, Link, Part, Robot
from phasmid.robot.inertial import Inertial, merged
from phasmid.servo import Servo

HINGES = frozenset({"revolute", "continuous"})
"""Kinds of joints that turn; a continuous one has no limits."""

WHOLE_TURN = 2.02 * math.pi
"""A turn and a hundredth [rad]: limits of ±6.28 or ±6.3 rad are in use, larger ones are degrees."""

VERTICAL = 2e-15
"""Some round-offs: the x axis of a frame is vertical if its level part is shorter."""

ENDLESS = 1000.0
"""Limits of a joint from here on mean none [rad]."""


@dataclass(frozen=True, eq=False)
class TreeLink:
    """A link of a tree.

    Attributes:
        name: As in the file.
        inertial: Its mass; None where the file gives none.
        parts: Its look, in the link's frame.
        where: File and line.
        balls: Centre in the link's frame and radius of its collision spheres, and of the ends of
            its capsules [m], four numbers each.
    """

    name: str
    inertial: Inertial | None = None
    parts: tuple[Part, ...] = ()
    where: str = ""
    balls: tuple[tuple[float, float, float, float], ...] = ()


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
        stiffness: Torque over angle error of its position control [N·m/rad]; 0 where it is unknown.
        servo_damping: Torque over speed error of that control [N·m·s/rad]; 0 where it is unknown.
        home: Angle of the stance that the file gives [rad]; None without one.
        follows: Name of the joint whose angle it takes, by a gear or linkage; empty for none.
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
    stiffness: float = 0.0
    servo_damping: float = 0.0
    home: float | None = None
    follows: str = ""
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
        names = Counter(joint.name for joint in self.joints)
        by_child: dict[str, TreeJoint] = {}
        for joint in self.joints:
            if names[joint.name] > 1:
                raise InvalidRobot(f"two joints are called {joint.name}.", where=joint.where)
            for end in (joint.parent, joint.child):
                if end not in self.links:
                    raise InvalidRobot(
                        f'joint {joint.name} names a link "{end}", which is not there.',
                        where=joint.where,
                    )
            first = by_child.setdefault(joint.child, joint)
            if first is not joint:
                raise InvalidRobot(
                    f"link {joint.child} has two parents (joints {first.name}, {joint.name}).",
                    where=joint.where,
                )
        roots = [name for name in self.links if name not in by_child]
        if len(roots) != 1:
            raise root_error(self.file or self.name, roots)
        # Links that hang on a ring of joints are not reached from the root.
        reached = [roots[0]]
        for name in reached:
            reached += [joint.child for joint in self.joints_from(name)]
        attached = set(reached)
        if lost := [name for name in self.links if name not in attached]:
            raise InvalidRobot(
                f"link {lost[0]} hangs on a ring of joints that is not tied to the root link.",
                where=self.links[lost[0]].where,
            )

    @cached_property
    def root(self) -> TreeLink:
        """The link without a parent."""
        (root,) = set(self.links) - {joint.child for joint in self.joints}
        return self.links[root]

    @cached_property
    def _outgoing(self) -> Mapping[str, Sequence[TreeJoint]]:
        outgoing: dict[str, list[TreeJoint]] = {name: [] for name in self.links}
        for joint in self.joints:
            outgoing[joint.parent].append(joint)
        return outgoing

    def joints_from(self, link: str) -> Sequence[TreeJoint]:
        """Return the joints that a link carries."""
        return self._outgoing[link]


def ended(lower: float, upper: float) -> tuple[float, float]:
    """Return limits, infinite where a file's mean none [rad]."""
    return lower if lower > -ENDLESS else -math.inf, upper if upper < ENDLESS else math.inf


def root_error(file: str, roots: Sequence[str], hint: str = "") -> InvalidRobot:
    """Return the error for no root link, or several."""
    named = f" ({', '.join(roots[:6])}{', …' if len(roots) > 6 else ''})" if roots else ""
    what = f"{file} has {len(roots)} root links{named}; exactly 1 is needed."
    return InvalidRobot(what, hint=hint)


@dataclass(frozen=True, eq=False)
class RigidLink:
    """Links of a file that move as one, in the frame of the first of them.

    Attributes:
        links: The links, that which stands nearest the root first.
        poses: Pose of each link's frame in the first one's, by name, shape (4, 4).
        ends: Those of its links that carry no joint at all, besides the first.
        inertial: Mass and inertia of all of them; None where none has any.
        parts: Their look.
    """

    links: tuple[TreeLink, ...]
    poses: Mapping[str, Float[np.ndarray, "4 4"]]
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


def rigid_link(tree: Tree, first: str) -> RigidLink:
    """Join a link and all that is fixed to it, outwards."""
    poses, _ = fixed_to(tree, first)
    links = tuple(tree.links[name] for name in poses)
    return RigidLink(
        links,
        poses,
        tuple(link for link in links[1:] if not tree.joints_from(link.name)),
        merged([link.inertial.at(poses[link.name]) for link in links if link.inertial]),
        tuple(part.at(poses[link.name]) for link in links for part in link.parts),
    )


def fixed_to(
    tree: Tree, first: str
) -> tuple[dict[str, Float[np.ndarray, "4 4"]], tuple[TreeJoint, ...]]:
    """Return poses of all links fixed to a link, outwards, in it by name; and joints that move."""
    poses = {first: np.eye(4)}
    moving: list[TreeJoint] = []
    frontier = [first]
    while frontier:
        parent = frontier.pop()
        for joint in tree.joints_from(parent):
            if joint.kind == "fixed":
                poses[joint.child] = poses[parent] @ joint.X_parent_child
                frontier.append(joint.child)
            else:
                moving.append(joint)
    return poses, tuple(moving)


def with_link_turned(tree: Tree, name: str, quarters: int) -> Tree:
    """Return a tree in which a link's frame is turned left about its z by quarter turns."""
    if not quarters:
        return tree
    X = np.eye(4)
    X[:2, :2] = np.linalg.matrix_power(np.array([[0.0, -1.0], [1.0, 0.0]]), quarters % 4)
    link = tree.links[name]
    turned = replace(
        link,
        inertial=link.inertial and link.inertial.at(X),
        parts=tuple(part.at(X) for part in link.parts),
        balls=tuple((*(X[:3, :3] @ ball[:3]).tolist(), ball[3]) for ball in link.balls),
    )
    joints = (
        replace(joint, X_parent_child=X @ joint.X_parent_child) if joint.parent == name else joint
        for joint in tree.joints
    )
    return replace(tree, links={**tree.links, name: turned}, joints=tuple(joints))


def inverse(X: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "4 4"]:
    """Return the inverse of a pose."""
    R = X[:3, :3].T
    Y = np.eye(4)
    Y[:3, :3], Y[:3, 3] = R, -R @ X[:3, 3]
    return Y


def rpy_of(R: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3"]:
    """Return roll, pitch and yaw of a rotation Rz(yaw) Ry(pitch) Rx(roll) [rad], shape (3,).

    The roll is taken from the remainder of the yaw, so that both are exact near a pitch of a right
    angle. There each of them alone is not determined, and the yaw takes all.
    """
    level = math.hypot(R[0, 0], R[1, 0])
    vertical = level < VERTICAL
    yaw = math.atan2(-R[0, 1], R[1, 1]) if vertical else math.atan2(R[1, 0], R[0, 0])
    c, s = math.cos(yaw), math.sin(yaw)
    roll = math.atan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    return np.array([0.0 if vertical else roll, math.atan2(-R[2, 0], level), yaw])


def tree_of(robot: Robot) -> Tree:
    """Convert a robot to a tree; its links' frames are the body's and those of Table 1.

    Links are ``base_link``, ``LEG_coxa_link``, ``LEG_femur_link``, ``LEG_tibia_link`` and the
    massless ``LEG_foot``; joints ``LEG_coxa``, ``LEG_femur``, ``LEG_tibia`` and the fixed
    ``LEG_foot_joint``. Every hinge turns about its child's z, and its angle is that of Table 1.
    """
    body, look, arrays = robot.body, robot.appearance, robot.arrays
    trunk = Inertial(body.mass, body.com, body.inertia)
    links = {"base_link": TreeLink("base_link", trunk, look.body if look else ())}
    joints: list[TreeJoint] = []
    for number, leg in enumerate(robot.legs):
        # From the coxa's frame to the femur's: a quarter turn about x.
        poses = (
            leg.X_body_hip,
            _end(leg.coxa, [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
            _end(leg.femur),
        )
        parent = "base_link"
        stance = _stance(leg)
        for joint, link, X, limits, home in zip(
            JOINTS, leg.links, poses, leg.joint_limits, stance, strict=True
        ):
            at = number, JOINTS.index(joint)
            strength = float(arrays.strength[at])
            name = f"{leg.name}_{joint}"
            child = f"{name}_link"
            parts = look.link(leg.name, joint) if look else ()
            inertial = Inertial(link.mass, link.com, link.inertia)
            balls = (
                ((*link.end.tolist(), robot.foot_radius),)
                if joint == "tibia" and robot.foot_radius
                else ()
            )
            links[child] = TreeLink(child, inertial, parts, balls=balls)
            joints.append(
                TreeJoint(
                    name,
                    "revolute",
                    parent,
                    child,
                    X,
                    lower=float(limits[0]),
                    upper=float(limits[1]),
                    effort=float(arrays.stall_torque[at]),
                    velocity=float(arrays.no_load_speed[at]),
                    friction=float(arrays.friction[at]),
                    damping=robot.servo.viscous_friction,
                    armature=float(arrays.armature[at]),
                    stiffness=strength * robot.servo.stiffness,
                    servo_damping=strength * robot.servo.damping,
                    home=home,
                )
            )
            parent = child
        foot = f"{leg.name}_foot"
        links[foot] = TreeLink(foot)
        joints.append(TreeJoint(f"{foot}_joint", "fixed", parent, foot, _end(leg.tibia)))
    return Tree(robot.name, links, tuple(joints))


def _stance(leg: Leg) -> list[float | None]:
    """Return the angles of a leg at its neutral foot [rad]; None where that is out of reach."""
    try:
        return list(map(float, joint_angles(leg, leg.neutral_foot)))
    except Unreachable:
        return [None] * 3


def _end(link: Link, R: list[list[float]] | None = None) -> np.ndarray:
    """Return the pose of the next link's frame, or of the foot, in a link's frame."""
    X = np.eye(4)
    if R is not None:
        X[:3, :3] = R
    X[:3, 3] = link.end
    return X
