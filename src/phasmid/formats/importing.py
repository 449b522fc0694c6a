"""Robots from kinematic trees: legs, masses, servo and stance in phasmid's terms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidRobot, plain
from phasmid.formats.assumptions import (
    LIKE,
    NO_MASS,
    Piece,
    possible_inertia,
    ratios_of,
    servo_of,
    weighed,
)
from phasmid.formats.chains import Skeleton, skeleton, with_stops
from phasmid.formats.feet import PRINTED, common_radius, find_foot, foot_places
from phasmid.formats.findings import Finding, Findings, Severity, grouped
from phasmid.formats.forward import AXES, judge_forward
from phasmid.formats.import_options import ImportOptions
from phasmid.formats.judge import judge_links, judge_robot
from phasmid.formats.legs import FoundLeg, found_leg, names_in_order
from phasmid.formats.stance import with_stance
from phasmid.formats.tree import RigidLink, Tree, inverse
from phasmid.robot import JOINTS, Appearance, Body, Leg, Link, Robot
from phasmid.servo import Servo, load_servo
from phasmid.tables import LONGEST_NAME

STAND_IN = 0.1
"""Mass of a link that stands in for an impossible one while the rest is judged [kg]."""

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
    """Convert a kinematic tree, its joints at angle 0, to a robot, with all findings.

    Legs are the chains of three hinges that leave the trunk. Names of links decide only which
    frame is a foot.
    """
    options = options or ImportOptions()
    findings = Findings(tree.findings)
    legs: tuple[FoundLeg, ...] = ()
    robot = None
    with findings.refusals("robot", tree.file):
        bones = skeleton(tree, findings, AXES[options.forward])
        bones = _with_stops(bones, options.joint_limit, findings)
        judge_forward(bones.chains, options.forward, findings)
        legs = _legs(bones, options.foot, findings)
        servo = _servo(tree, bones, options, findings)
        if len(legs) == len(bones.chains):
            X_body_trunk, legs = _centred(legs, findings)
            pieces = _pieces(bones, legs, X_body_trunk)
            robot = _robot(tree, pieces, legs, servo, options, findings)
        else:
            _judge_bare(bones, findings)
    if robot is not None and not findings.any_impossible:
        findings += judge_robot(robot, read=True)
    return Imported(None if findings.any_impossible else robot, grouped(findings), legs)


def _with_stops(bones: Skeleton, assumed: float | None, findings: Findings) -> Skeleton:
    """Return a skeleton whose joints have the stops that they have in truth."""
    chains = tuple(
        replace(chain, joints=tuple(with_stops(joint, assumed, findings) for joint in chain.joints))
        for chain in bones.chains
    )
    for joint in (joint for chain in chains for joint in chain.joints if joint.follows):
        what = (
            "follows another joint in the file, without a motor of its own; here it is moved by a "
            "servo of its own."
        )
        hint = "no <mimic> or <equality> in the file, if the joint has a servo"
        findings.suspect(f"joint {joint.name}", what, joint.where, hint)
    return replace(bones, chains=chains)


def _legs(bones: Skeleton, foot: str, findings: Findings) -> tuple[FoundLeg, ...]:
    """Find the legs; those that do not fit this model become findings."""
    order = names_in_order(np.array([chain.hip for chain in bones.chains]))
    places = foot_places(foot, len(order))
    legs: list[FoundLeg] = []
    for number, ((name, index), place) in enumerate(zip(order, places, strict=True), 1):
        chain = bones.chains[index]
        with findings.refusals(f"leg {number}"):
            end = find_foot(number, chain, place, findings)
            legs.append(found_leg(number, name, chain, end, findings))
    return tuple(legs)


def _servo(tree: Tree, bones: Skeleton, options: ImportOptions, findings: Findings) -> Servo:
    """Return the servo of all joints; where it is unknown, which is a finding, a stand-in."""
    joints = [joint for chain in bones.chains for joint in chain.joints]
    with findings.refusals("servo", tree.file):
        return servo_of(joints, options.servo_model, tree.servo, findings)
    return load_servo(LIKE)


def _judge_bare(bones: Skeleton, findings: Findings) -> None:
    """Find links without a mass, where legs that do not fit keep the robot from being built."""
    for rigid in (bones.trunk, *(link for chain in bones.chains for link in chain.links)):
        if rigid.inertial is None or not rigid.inertial.mass:
            subject, where = f"link {rigid.name}", rigid.links[0].where
            findings.impossible(subject, "has no mass.", where, NO_MASS)


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
    hips = [_without_round_off(leg.position + X_body_trunk[:3, 3]) for leg in legs]
    return X_body_trunk, tuple(replace(g, position=p) for g, p in zip(legs, hips, strict=True))


def _without_round_off(place: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    return np.where(np.abs(place) < 1e-15, 0.0, place)


def _pieces(
    bones: Skeleton, legs: Sequence[FoundLeg], X_body_trunk: Float[np.ndarray, "4 4"]
) -> list[Piece]:
    """Return the trunk and all links in their frames, with the file's masses."""

    def piece(rigid: RigidLink, X: np.ndarray, joint: str, leg: FoundLeg | None = None) -> Piece:
        inertial = possible_inertia(rigid.inertial.at(X)) if rigid.inertial else None
        parts = tuple(part.at(X) for part in rigid.parts)
        named = next((link for link in rigid.links if link.inertial), rigid.links[0])
        return Piece(f"link {named.name}", named.where, joint, leg, hips, inertial, parts)

    hips = np.array([leg.position for leg in legs])
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
    servo: Servo,
    options: ImportOptions,
    findings: Findings,
) -> Robot | None:
    """Build the robot; where links are impossible, which are findings, from stand-ins."""
    with findings.refusals("robot", tree.file):
        pieces = weighed(pieces, options, findings)
    made = [_link(piece, findings) for piece in pieces]
    possible = [piece for piece, link in zip(pieces, made, strict=True) if link]
    findings += judge_links([leg.chain for leg in legs], possible, options.masses)
    is_own = not (options.servo_model or tree.servo)
    ratios = [ratios_of(leg, servo) if is_own else {} for leg in legs]
    filled = [
        link or _link(piece.spread(STAND_IN), Findings())
        for piece, link in zip(pieces, made, strict=True)
    ]
    if None in filled:
        return None
    parts = {piece.name: piece.parts for piece in pieces if piece.parts}
    body, *links = filled
    robot = Robot(
        plain(tree.name).strip()[:LONGEST_NAME] or "robot",
        cast("Body", body),
        tuple(
            _leg(leg, cast("list[Link]", links[3 * i : 3 * i + 3]), ratios[i])
            for i, leg in enumerate(legs)
        ),
        servo,
        "",
        Appearance.of(parts, MESHES) if parts else None,
        common_radius([leg.radius for leg in legs], findings),
    )
    with findings.refusals("robot", tree.file):
        return with_stance(robot, legs, findings, tree.file, is_solid=bool(pieces[0].parts))
    return None


def _link(piece: Piece, findings: Findings) -> Link | Body | None:
    """Return the trunk or a link; None where no body can have its numbers, with a finding."""
    own, leg = piece.inertial, piece.leg
    if own is None or own.mass == 0:
        moves = "moves but" if leg else "is the trunk and"
        findings.impossible(piece.subject, f"{moves} has no mass.", piece.where, NO_MASS)
        return None
    try:
        if leg is None:
            low, high = piece.box
            centre = _without_round_off((low + high) / 2)
            return Body(own.mass, own.com, own.inertia, high - low, centre)
        left = float(leg.lateral_offsets[JOINTS.index(piece.joint)])
        return Link(piece.joint, piece.length, own.mass, own.com, own.inertia, left)
    except InvalidRobot as error:
        what = error.what.removeprefix(f"link {piece.joint}: ").removeprefix("body: ")
        findings.impossible(piece.subject, what, piece.where, "--masses geometry")
        return None


def _leg(leg: FoundLeg, links: Sequence[Link], ratios: Mapping[str, Any]) -> Leg:
    """Return a leg of the robot, its neutral foot anywhere before its hip."""
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
        neutral_foot=np.array([leg.lengths.sum() / 2, 0.0, 0.0]),
        joint_limits=leg.limits,
        femur_bend=e2,
        tibia_bend=e2 + e3,
        **ratios,
    )
