"""From a kinematic tree to a robot: which links are legs, and what their numbers are here."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidRobot, PhasmidError, located
from phasmid.formats.chains import Chain, skeleton
from phasmid.formats.extension import Extension, LegExtension, read_extension
from phasmid.formats.findings import Finding, Severity
from phasmid.formats.foot import foot_of
from phasmid.formats.mounts import Mount, body_frame, hip_rotation, mount_of, names_in_order
from phasmid.formats.options import ImportOptions
from phasmid.formats.planar import Planar, planar
from phasmid.formats.rigid import RigidLink, inverse, moved
from phasmid.formats.servos import servo_of
from phasmid.formats.standing import Stance, standing_feet
from phasmid.formats.tree import Tree
from phasmid.robot import JOINTS, Appearance, Body, Leg, Link, Part, Robot, Servo

UPRIGHT = 0.5
"""Cosine of 60°: coxa axes that lean further lie."""

THINNEST = 0.05
"""Height of a trunk of which only the hips are known [m], about that of a servo."""


@dataclass(frozen=True, eq=False)
class LegFacts:
    """What of a file became a leg.

    A servo whose angle is the file's φ stands at our joint angle ``signs · φ + offsets``.

    Attributes:
        name: Of the leg.
        joints: The file's names of coxa, femur and tibia joint.
        links: The file's names of the links that became coxa, femur and tibia.
        foot: Where the foot comes from, in words.
        signs: 1 or -1 for each joint, shape (3,).
        offsets: Our angles where the file's are 0 [rad], shape (3,).
        lengths: Of coxa, femur and tibia [m], shape (3,).
        mount_position: Hip in the body frame [m], shape (3,).
        mount_angles: Yaw, pitch and roll of the hip [rad], shape (3,).
        limits: Lowest and highest joint angles of ours [rad], shape (3, 2).
        masses: Of coxa, femur and tibia [kg]; NaN where the file gives none, shape (3,).
        neutral_foot: In the hip frame [m]; None where it cannot stand, shape (3,).
    """

    name: str
    joints: tuple[str, str, str]
    links: tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]
    foot: str
    signs: Float[np.ndarray, "3"]
    offsets: Float[np.ndarray, "3"]
    lengths: Float[np.ndarray, "3"]
    mount_position: Float[np.ndarray, "3"]
    mount_angles: Float[np.ndarray, "3"]
    limits: Float[np.ndarray, "3 2"]
    masses: Float[np.ndarray, "3"]
    neutral_foot: Float[np.ndarray, "3"] | None


@dataclass(frozen=True, eq=False)
class ImportFacts:
    """What of a file became a robot, as far as it went.

    Attributes:
        name: Of the robot.
        trunk: The file's names of the links that became the trunk.
        legs: The legs, in the robot's order.
        mass: Of all links [kg].
        servo: The servo; None where the file and the options give none.
        servo_source: Where the servo comes from, in words.
        foot_source: Where the neutral feet come from, in words.
    """

    name: str
    trunk: tuple[str, ...]
    legs: tuple[LegFacts, ...]
    mass: float
    servo: Servo | None
    servo_source: str
    foot_source: str


@dataclass(frozen=True, eq=False)
class Imported:
    """What came of reading a robot.

    Attributes:
        robot: The robot; None where there can be none.
        findings: What the reader, this room and the judge found.
        error: Why there is no robot; None where there is one.
        facts: What of the file became what; None where no legs were found.
    """

    robot: Robot | None
    findings: tuple[Finding, ...]
    error: PhasmidError | None = None
    facts: ImportFacts | None = None


def robot_from_tree(tree: Tree, options: ImportOptions | None = None) -> Imported:
    """Make a robot of a kinematic tree.

    Legs are the chains of three hinges that leave the trunk; names of links and joints decide
    nothing but which frame is a foot.

    Args:
        tree: The tree, its joints at angle 0.
        options: What a person adds to the file.

    Returns:
        The robot, or why there is none; in either case all that was found.
    """
    options = options or ImportOptions()
    findings = list(tree.findings)
    facts: list[ImportFacts] = []
    try:
        robot = _robot(tree, options, findings, facts)
    except PhasmidError as error:
        error.where = error.where or tree.file
        findings.append(Finding(Severity.IMPOSSIBLE, "robot", error.what, error.where, error.hint))
        return Imported(None, tuple(findings), error, facts[0] if facts else None)
    return Imported(robot, tuple(findings), None, facts[0] if facts else None)


@dataclass(frozen=True, eq=False)
class _Found:
    """A leg on its way to the robot."""

    name: str
    chain: Chain
    said: LegExtension | None
    plan: Planar
    foot: str
    limits: Float[np.ndarray, "3 2"]


def _robot(
    tree: Tree, options: ImportOptions, findings: list[Finding], facts: list[ImportFacts]
) -> Robot:
    extension = read_extension(tree.extension, tree.file) if tree.extension else None
    bones = skeleton(tree)
    findings += bones.findings
    legs = [
        _found(number, name, chain, said, options.foot, findings)
        for number, (name, chain, said) in enumerate(_named(bones.chains, extension, findings), 1)
    ]
    hips = np.array([leg.plan.X_trunk_hip for leg in legs])
    X_body_trunk = np.eye(4)
    if extension is None:
        X_body_trunk = inverse(body_frame(hips[:, :3, 3], findings))
    mounts = []
    for number, (leg, X_trunk_hip) in enumerate(zip(legs, hips, strict=True), 1):
        mount, tilt = mount_of(X_body_trunk @ X_trunk_hip, leg.said)
        if tilt:
            findings.append(_levelled(number, tilt, leg))
        mounts.append(mount)
    feet, foot_source = _feet(legs, mounts, findings)
    motor = extension.motor if extension else None
    servo, servo_source = servo_of(bones.chains, options.servo, motor, findings)
    name = extension.name if extension else tree.name
    facts.append(
        ImportFacts(
            name,
            tuple(link.name for link in bones.trunk.links),
            tuple(
                _leg_facts(leg, mount, None if feet is None else feet[i])
                for i, (leg, mount) in enumerate(zip(legs, mounts, strict=True))
            ),
            sum(link.inertial.mass for link in tree.links.values() if link.inertial),
            servo,
            servo_source,
            foot_source,
        )
    )
    if feet is None:
        raise InvalidRobot(
            "no stance with knees up is within the joint limits.",
            hint="widen the limits, or check their signs",
        )
    if servo is None:
        raise InvalidRobot(
            "the joints have no effort and speed, so their servos are not known.",
            hint="--servo AX-12A",
        )
    made = tuple(
        _leg(leg, mount, foot) for leg, mount, foot in zip(legs, mounts, feet, strict=True)
    )
    return Robot(
        name,
        _body(bones.trunk, X_body_trunk, mounts, extension),
        made,
        servo,
        extension.description if extension else "",
        _appearance(bones.trunk, X_body_trunk, legs),
    )


def _named(
    chains: Sequence[Chain], extension: Extension | None, findings: list[Finding]
) -> list[tuple[str, Chain, LegExtension | None]]:
    """Legs in the robot's order, with their names and what an extension says of each."""
    if extension is not None:
        by_joint = {chain.joints[0].name: chain for chain in chains}
        said = {leg.joint: (name, leg) for name, leg in extension.legs.items()}
        if set(said) == set(by_joint) and len(said) == len(extension.legs):
            return [(name, by_joint[joint], leg) for joint, (name, leg) in said.items()]
        findings.append(
            Finding(
                Severity.SUSPECT,
                "phasmid extension",
                f"speaks of legs at joints {', '.join(list(said)[:6])}, and the file's legs are "
                f"at {', '.join(list(by_joint)[:6])}; what it says of legs was ignored.",
                hint="export the file anew",
            )
        )
    hips = np.array([chain.poses[0][:3, 3] for chain in chains])
    return [(name, chains[i], None) for name, i in names_in_order(hips)]


def _found(
    number: int,
    name: str,
    chain: Chain,
    said: LegExtension | None,
    option: str,
    findings: list[Finding],
) -> _Found:
    p_tibia_foot, source, notes = foot_of(chain, option, number)
    findings += notes
    X = chain.poses[2]
    foot = X[:3, :3] @ p_tibia_foot + X[:3, 3]
    zero = _middle(chain)
    axis = chain.axes[0]
    if said is not None:
        up = hip_rotation((said.yaw, said.pitch, said.roll))[:, 2]
        plan = planar(chain, foot, number, up, zero)
    elif abs(axis[2]) >= UPRIGHT:
        plan = planar(chain, foot, number, np.array([0.0, 0.0, 1.0]), zero)
    else:
        # A lying coxa axis has no upper end; knees decide, which here bend one way.
        plan = planar(chain, foot, number, axis, zero)
        if float(np.mean(_limits(chain, plan)[2])) > 0:
            plan = planar(chain, foot, number, -axis, zero)
    findings += plan.findings
    return _Found(name, chain, said, plan, source, _limits(chain, plan))


def _middle(chain: Chain) -> float:
    """The coxa's angle in the file at which its leg points along the hip's x."""
    coxa = chain.joints[0]
    if coxa.kind == "continuous" or coxa.lower < 0 < coxa.upper:
        return 0.0
    middle = (coxa.lower + coxa.upper) / 2
    return middle if math.isfinite(middle) else 0.0


def _limits(chain: Chain, plan: Planar) -> Float[np.ndarray, "3 2"]:
    """Limits in our angles: a range that turns more than once is one turn."""
    limits = np.empty((3, 2))
    for row, joint, sign, offset in zip(
        limits, chain.joints, plan.signs, plan.offsets, strict=True
    ):
        ends = sorted((sign * joint.lower + offset, sign * joint.upper + offset))
        if joint.kind == "continuous" or not ends[1] - ends[0] < 2 * math.pi:
            row[:] = -math.pi, math.pi
            continue
        # Angles are taken in (-pi, pi]; a range about another turn's angle is moved there.
        turns = round((ends[0] + ends[1]) / 2 / (2 * math.pi))
        row[:] = [end - 2 * math.pi * turns for end in ends]
    return limits


def _levelled(number: int, tilt: float, leg: _Found) -> Finding:
    reach = float(leg.plan.lengths.sum())
    return Finding(
        Severity.NOTE,
        f"leg {number}",
        f"coxa axis was turned by {math.degrees(tilt):.2g}° to be vertical, which moves the foot "
        f"by {1000 * reach * tilt:.2g} mm at most.",
        where=leg.chain.joints[0].where,
    )


def _feet(
    legs: Sequence[_Found], mounts: Sequence[Mount], findings: list[Finding]
) -> tuple[Float[np.ndarray, "legs 3"] | None, str]:
    """Neutral feet in the hip frames, and where they come from."""
    said = [leg.said.neutral_foot for leg in legs if leg.said is not None]
    if len(said) == len(legs):
        return np.array(said), "the file's phasmid extension"
    feet = standing_feet(
        [
            Stance(leg.plan.lengths, leg.limits, mount.R_level_hip, float(mount.position[2]))
            for leg, mount in zip(legs, mounts, strict=True)
        ]
    )
    if feet is not None:
        level = mounts[0].R_level_hip @ feet[0]
        findings.append(
            Finding(
                Severity.NOTE,
                "neutral feet",
                f"stand {1000 * level[0]:.0f} mm out from the coxa axes and "
                f"{-1000 * (level[2] + mounts[0].position[2]):.0f} mm below the body's origin: "
                "an assumption.",
                hint="neutral_foot_mm in the robot's TOML file",
            )
        )
    return feet, "assumed in proportion to the legs"


def _leg_facts(leg: _Found, mount: Mount, foot: Float[np.ndarray, "3"] | None) -> LegFacts:
    coxa, femur, tibia = leg.chain.links
    masses = [link.inertial.mass if link.inertial else math.nan for link in (coxa, femur, tibia)]
    a, b, c = (joint.name for joint in leg.chain.joints)
    return LegFacts(
        leg.name,
        (a, b, c),
        (_names(coxa), _names(femur), _names(tibia)),
        leg.foot,
        leg.plan.signs,
        leg.plan.offsets,
        leg.plan.lengths,
        mount.position,
        mount.angles,
        leg.limits,
        np.array(masses),
        foot,
    )


def _names(link: RigidLink) -> tuple[str, ...]:
    return tuple(piece.name for piece in link.links)


def _leg(leg: _Found, mount: Mount, foot: Float[np.ndarray, "3"]) -> Leg:
    links = {}
    for i, (joint, rigid) in enumerate(zip(JOINTS, leg.chain.links, strict=True)):
        if rigid.inertial is None or rigid.inertial.mass == 0:
            raise InvalidRobot(
                f"link {rigid.name} moves but has no mass.",
                where=rigid.links[0].where,
                hint="give it mass and inertia, or take them: --masses phantomx-mk4",
            )
        X_link_file = inverse(leg.plan.X_trunk_links[i]) @ leg.chain.poses[i]
        inertial = moved(rigid.inertial, X_link_file)
        with located(rigid.links[0].where):
            links[joint] = Link(
                joint, float(leg.plan.lengths[i]), inertial.mass, inertial.com, inertial.inertia
            )
    yaw, pitch, roll = mount.angles
    _, e2, e3 = leg.plan.offsets
    said = leg.said
    return Leg(
        leg.name,
        **links,
        mount_position=mount.position,
        mount_yaw=float(yaw),
        mount_pitch=float(pitch),
        mount_roll=float(roll),
        neutral_foot=foot,
        joint_limits=leg.limits,
        femur_bend=said.femur_bend if said else float(e2),
        tibia_bend=said.tibia_bend if said else float(e2 + e3),
    )


def _body(
    trunk: RigidLink,
    X_body_trunk: Float[np.ndarray, "4 4"],
    mounts: Sequence[Mount],
    extension: Extension | None,
) -> Body:
    if trunk.inertial is None or trunk.inertial.mass == 0:
        raise InvalidRobot(
            f"link {trunk.name}, the trunk, has no mass.", where=trunk.links[0].where
        )
    inertial = moved(trunk.inertial, X_body_trunk)
    if extension is not None:
        size = np.array(extension.body_size)
    else:
        size = body_size(trunk, X_body_trunk, np.array([mount.position for mount in mounts]))
    with located(trunk.links[0].where):
        return Body(inertial.mass, inertial.com, inertial.inertia, size)


def body_size(
    trunk: RigidLink, X_body_trunk: Float[np.ndarray, "4 4"], hips: Float[np.ndarray, "legs 3"]
) -> Float[np.ndarray, "3"]:
    """The box about the body's origin that holds the trunk's meshes, or its hips without any.

    Args:
        trunk: The trunk.
        X_body_trunk: The trunk's frame in the body, shape (4, 4).
        hips: In the body frame [m], shape (L, 3).

    Returns:
        Length, width and height [m], shape (3,).
    """
    points = [part.at(X_body_trunk).vertices for part in trunk.parts] or [hips]
    size = 2 * np.abs(np.concatenate(points)).max(axis=0)
    # Hips of one height say nothing of the trunk's.
    return np.maximum(size, THINNEST)


def _appearance(
    trunk: RigidLink, X_body_trunk: Float[np.ndarray, "4 4"], legs: Sequence[_Found]
) -> Appearance | None:
    parts: dict[str, tuple[Part, ...]] = {}
    if trunk.parts:
        parts["body"] = tuple(part.at(X_body_trunk) for part in trunk.parts)
    for leg in legs:
        for i, (joint, rigid) in enumerate(zip(JOINTS, leg.chain.links, strict=True)):
            if rigid.parts:
                X = inverse(leg.plan.X_trunk_links[i]) @ leg.chain.poses[i]
                parts[f"{leg.name}.{joint}"] = tuple(part.at(X) for part in rigid.parts)
    return Appearance.of(parts) if parts else None
