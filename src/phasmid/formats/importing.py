"""Robots from kinematic trees: legs, masses, servo and stance in phasmid's terms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidRobot, PhasmidError, plain
from phasmid.formats.assumptions import (
    NO_MASS,
    Piece,
    possible_inertia,
    servo_of,
    standing_feet,
    strength_of,
    weighed,
)
from phasmid.formats.chains import Chain, Skeleton, skeleton
from phasmid.formats.feet import find_foot, foot_places
from phasmid.formats.findings import Finding, Findings, Severity, grouped
from phasmid.formats.judge import judge_links, judge_robot
from phasmid.formats.legs import PRINTED, FoundLeg, found_leg, names_in_order
from phasmid.formats.tree import RigidLink, Tree, inverse
from phasmid.robot import JOINTS, Appearance, Body, Leg, Link, Robot
from phasmid.robot.table import LONGEST_NAME
from phasmid.scenario.tables import ImportOptions

THINNEST = 0.05
"""Height of a trunk of which only the hips are known [m], about that of a servo."""

MESHES = "robot.glb"
"""Name of the file of a robot's meshes beside a run or a robot file."""


@dataclass(frozen=True, eq=False)
class Imported:
    """Result of reading a robot.

    Attributes:
        robot: The robot; None where there can be none.
        findings: Findings of the reader, the leg finder and the judge.
        legs: The file's legs, in the robot's order; empty where none were found.
    """

    robot: Robot | None
    findings: tuple[Finding, ...]
    legs: tuple[FoundLeg, ...] = ()

    @property
    def impossible(self) -> list[Finding]:
        """Findings for which the robot cannot walk."""
        return [f for f in self.findings if f.severity is Severity.IMPOSSIBLE]


# Numbers of a file may be beyond any measure; what overflows is refused by its size.
@np.errstate(over="ignore", invalid="ignore")
def robot_from_tree(tree: Tree, options: ImportOptions | None = None) -> Imported:
    """Convert a kinematic tree to a robot.

    Legs are the chains of three hinges that leave the trunk. Names of links decide only which
    frame is a foot.

    Args:
        tree: The tree, its joints at angle 0.
        options: Data that the file lacks.

    Returns:
        The robot, or why there is none; in either case all findings.
    """
    options = options or ImportOptions()
    findings = Findings(tree.findings)
    legs: tuple[FoundLeg, ...] = ()
    robot = None
    try:
        bones = skeleton(tree, findings)
        legs = _legs(bones, options.foot, findings)
        if not findings.any_impossible:
            X_body_trunk, legs = _centred(legs, findings)
            robot = _robot(tree, _pieces(bones, legs, X_body_trunk), legs, options, findings)
    except PhasmidError as error:
        findings.impossible("robot", error.what, error.where or tree.file, error.hint)
    if robot is not None:
        findings += judge_robot(robot, read=True)
    return Imported(None if findings.any_impossible else robot, grouped(findings), legs)


def _legs(bones: Skeleton, foot: str, findings: Findings) -> tuple[FoundLeg, ...]:
    """Find the legs; those that do not fit this model become findings."""
    order = names_in_order(np.array([chain.hip for chain in bones.chains]))
    places = foot_places(foot, len(order))
    legs: list[FoundLeg] = []
    for number, ((name, index), place) in enumerate(zip(order, places, strict=True), 1):
        chain = bones.chains[index]
        try:
            end = find_foot(number, chain, place, findings)
            legs.append(found_leg(number, name, chain, end, findings))
        except PhasmidError as error:
            what = error.what.removeprefix(f"leg {number}: ")
            findings.impossible(f"leg {number}", what, error.where, error.hint)
        _note_endless(chain, findings)
    return tuple(legs)


def _note_endless(chain: Chain, findings: Findings) -> None:
    for joint in chain.joints:
        if joint.kind == "continuous" or not np.isfinite(joint.upper - joint.lower):
            what = "no limits in the file; ±180° was assumed."
            findings.note(f"joint {joint.name}", what, joint.where)


def _centred(
    legs: Sequence[FoundLeg], findings: Findings
) -> tuple[Float[np.ndarray, "4 4"], tuple[FoundLeg, ...]]:
    """Return the trunk's frame in the body's, whose origin is amid the hips, and hips in it."""
    X_body_trunk = np.eye(4)
    middle = np.mean([leg.position for leg in legs], axis=0)
    if np.linalg.norm(middle) > PRINTED:
        shown = ", ".join(f"{round(1000 * float(c), 2) + 0.0:.2f}" for c in middle)
        findings.note("body", f"its origin was moved by ({shown}) mm, amid the coxa axes.")
        X_body_trunk[:3, 3] = -middle
    hips = [leg.position + X_body_trunk[:3, 3] for leg in legs]
    # Without the round-off beside 0.
    hips = [np.where(np.abs(hip) < 1e-15, 0.0, hip) for hip in hips]
    return X_body_trunk, tuple(replace(g, position=p) for g, p in zip(legs, hips, strict=True))


def _pieces(
    bones: Skeleton, legs: Sequence[FoundLeg], X_body_trunk: Float[np.ndarray, "4 4"]
) -> list[Piece]:
    """Return the trunk and all links in their frames, with the file's masses."""

    def piece(rigid: RigidLink, X: np.ndarray, joint: str, leg: FoundLeg | None = None) -> Piece:
        inertial = possible_inertia(rigid.inertial.at(X)) if rigid.inertial else None
        parts = tuple(part.at(X) for part in rigid.parts)
        named = next((link for link in rigid.links if link.inertial), rigid.links[0])
        return Piece(f"link {named.name}", named.where, joint, leg, size, inertial, parts)

    hips = np.array([leg.position for leg in legs])
    size = _body_size(bones.trunk, X_body_trunk, hips)
    return [piece(bones.trunk, X_body_trunk, "body")] + [
        piece(rigid, inverse(X_trunk_link) @ X_trunk_rigid, joint, leg)
        for leg in legs
        for joint, rigid, X_trunk_link, X_trunk_rigid in zip(
            JOINTS, leg.chain.links, leg.X_trunk_links, leg.chain.poses, strict=True
        )
    ]


def _robot(
    tree: Tree,
    pieces: Sequence[Piece],
    legs: Sequence[FoundLeg],
    options: ImportOptions,
    findings: Findings,
) -> Robot | None:
    """Build the robot; None where a link is impossible, which becomes a finding."""
    pieces = weighed(pieces, options, findings)
    made = [_link(piece, findings) for piece in pieces]
    possible = [piece for piece, link in zip(pieces, made, strict=True) if link]
    findings += judge_links([leg.chain for leg in legs], possible)
    joints = [joint for leg in legs for joint in leg.chain.joints]
    servo = servo_of(joints, options.servo_model, tree.servo, findings)
    is_own = not (options.servo_model or tree.servo)
    strengths = [strength_of(leg, servo) if is_own else np.ones(3) for leg in legs]
    feet = standing_feet(legs)
    level = legs[0].R_level_hip @ feet[0]
    findings.note(
        "neutral feet",
        f"{1000 * level[0]:.0f} mm out from the coxa axes and "
        f"{-1000 * (level[2] + legs[0].position[2]):.0f} mm below the body's origin are an "
        "assumption.",
        hint=f"phasmid convert {tree.file or 'FILE'} robot.toml, and change neutral_foot_mm there",
    )
    if findings.any_impossible:
        return None
    parts = {piece.name: piece.parts for piece in pieces if piece.parts}
    links = cast("list[Link]", made[1:])
    return Robot(
        plain(tree.name).strip()[:LONGEST_NAME] or "robot",
        cast("Body", made[0]),
        tuple(
            _leg(leg, foot, links[3 * i : 3 * i + 3], strengths[i])
            for i, (leg, foot) in enumerate(zip(legs, feet, strict=True))
        ),
        servo,
        "",
        Appearance.of(parts, MESHES) if parts else None,
    )


def _link(piece: Piece, findings: Findings) -> Link | Body | None:
    """Return the trunk or a link; None where no body can have its numbers, with a finding."""
    own, leg = piece.inertial, piece.leg
    if own is None or own.mass == 0:
        moves = "moves but" if leg else "is the trunk and"
        findings.impossible(piece.subject, f"{moves} has no mass.", piece.where, NO_MASS)
        return None
    try:
        if leg is None:
            return Body(own.mass, own.com, own.inertia, piece.size)
        left = float(leg.lateral_offsets[JOINTS.index(piece.joint)])
        return Link(piece.joint, piece.length, own.mass, own.com, own.inertia, left)
    except InvalidRobot as error:
        what = error.what.removeprefix(f"link {piece.joint}: ").removeprefix("body: ")
        findings.impossible(piece.subject, what, piece.where, "--masses geometry")
        return None


def _leg(
    leg: FoundLeg,
    foot: Float[np.ndarray, "3"],
    links: Sequence[Link],
    strength: Float[np.ndarray, "3"],
) -> Leg:
    coxa, femur, tibia = links
    yaw, pitch, roll = map(float, leg.angles)
    _, e2, e3 = map(float, leg.offsets)
    return Leg(
        leg.name,
        coxa,
        femur,
        tibia,
        mount_position=leg.position,
        mount_yaw=yaw,
        mount_pitch=pitch,
        mount_roll=roll,
        neutral_foot=foot,
        joint_limits=leg.limits,
        femur_bend=e2,
        tibia_bend=e2 + e3,
        strength=strength,
    )


def _body_size(
    trunk: RigidLink, X_body_trunk: Float[np.ndarray, "4 4"], hips: Float[np.ndarray, "legs 3"]
) -> Float[np.ndarray, "3"]:
    """Return the box about the body's origin that reaches as far forward, sideways and down.

    It bounds what the ground must stay clear of, so that what is above the hips does not count.
    Without meshes it reaches to the hips.
    """
    points = [part.at(X_body_trunk).vertices for part in trunk.parts] or [hips]
    low, high = np.concatenate(points).min(axis=0), np.concatenate(points).max(axis=0)
    size = 2 * np.maximum(-low, [high[0], high[1], 0.0])
    # Hips of one height do not show that of the trunk.
    return np.maximum(size, THINNEST)
