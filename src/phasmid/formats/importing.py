"""Robots from kinematic trees: legs, masses, servo and stance in phasmid's terms."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidRobot, PhasmidError, plain
from phasmid.formats.assumptions import NO_MASS, Piece, servo_of, standing_feet, weighed
from phasmid.formats.bodies import possible
from phasmid.formats.chains import Skeleton, skeleton
from phasmid.formats.feet import feet_of
from phasmid.formats.findings import Finding, Findings, Severity, grouped
from phasmid.formats.judge import (
    judge,
    judge_servo,
    judge_standing,
    judge_symmetry,
    mass_slip,
    scaled_masses,
)
from phasmid.formats.legs import PRINTED, FoundLeg, found_leg, names_in_order
from phasmid.formats.options import ImportOptions
from phasmid.formats.tree import RigidLink, Tree, inverse
from phasmid.robot import JOINTS, Appearance, Body, Leg, Link, Robot, Servo
from phasmid.robot.inertial import Inertial
from phasmid.robot.table import LONGEST_NAME

THINNEST = 0.05
"""Height of a trunk of which only the hips are known [m], about that of a servo."""

MESHES = "robot.glb"
"""Name of the file of a robot's meshes beside a run or a robot file."""


@dataclass(frozen=True, eq=False)
class ImportFacts:
    """What was understood of a file, also of a robot that cannot walk.

    Attributes:
        name: Name of the robot.
        legs: The legs, in the robot's order, hips in the body frame.
        feet: Neutral feet in the hip frames [m], shape (L, 3); None where it cannot stand.
        masses: Masses of coxae, femora and tibiae [kg]; NaN where there is none, shape (L, 3).
        mass: Mass of all links [kg].
        servo: The servo; None where it is not known.
    """

    name: str
    legs: tuple[FoundLeg, ...]
    feet: Float[np.ndarray, "legs 3"] | None
    masses: Float[np.ndarray, "legs 3"]
    mass: float
    servo: Servo | None


@dataclass(frozen=True, eq=False)
class Imported:
    """Result of reading a robot.

    Attributes:
        robot: The robot; None where there can be none.
        findings: Findings of the reader, the leg finder and the judge.
        error: Why there is no robot; None where there is one.
        facts: What was understood; None where no legs were found.
    """

    robot: Robot | None
    findings: tuple[Finding, ...]
    error: PhasmidError | None = None
    facts: ImportFacts | None = None


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
    facts = None
    try:
        facts, pieces = _find_facts(tree, options, findings)
        robot = _robot(facts, pieces)
        findings += judge_standing(robot, assumed=True)
        findings += judge_symmetry(robot, read=True)
    except PhasmidError as error:
        error.where = error.where or tree.file
        if facts and facts.servo and facts.mass > 0:
            length = max(float(np.sum(leg.lengths)) for leg in facts.legs)
            findings += judge_servo(facts.servo, facts.mass, length)
        if not any(finding.severity is Severity.IMPOSSIBLE for finding in findings):
            findings.impossible("robot", error.what, error.where, error.hint)
        found = grouped(findings)
        return Imported(None, found, _first(found, error), facts)
    return Imported(robot, grouped(findings), None, facts)


def _first(findings: Sequence[Finding], error: PhasmidError) -> PhasmidError:
    """Return the first impossible finding as the error; the raised one may follow from it."""
    first = next(f for f in findings if f.severity is Severity.IMPOSSIBLE)
    if error.what in (first.what, first.sentence, f"{first.subject} {first.what}"):
        return error
    return InvalidRobot(first.sentence, where=first.where or error.where, hint=first.hint)


def _find_facts(
    tree: Tree, options: ImportOptions, findings: Findings
) -> tuple[ImportFacts, list[Piece]]:
    """Find the legs, the servo, the neutral feet, and the masses in the frames of Table 1."""
    if options.masses == "as-given" and options.total_mass is not None and mass_slip(tree):
        what = "were taken for grams, as the inertias show; the inertias were kept."
        findings.note("masses", what, tree.file)
        tree = scaled_masses(tree, 1e-3, inertias=False)
    bones = skeleton(tree)
    findings += bones.findings
    findings += _judged(tree, bones, options)
    legs = _legs(bones, options, findings)
    middle = np.mean([leg.position for leg in legs], axis=0)
    if np.linalg.norm(middle) > PRINTED:
        shown = ", ".join(f"{round(1000 * float(c), 2) + 0.0:.2f}" for c in middle)
        findings.note("body", f"its origin was moved by ({shown}) mm, amid the coxa axes.")
    else:
        middle = np.zeros(3)
    X_body_up = np.eye(4)
    X_body_up[:3, 3] = -middle
    # Without the round-off beside 0.
    hips = [np.where(np.abs(p) < 1e-15, 0.0, p) for p in (leg.position - middle for leg in legs)]
    legs = [replace(leg, position=hip) for leg, hip in zip(legs, hips, strict=True)]
    feet = standing_feet(legs)
    if feet is not None:
        level = legs[0].R_level_hip @ feet[0]
        findings.note(
            "neutral feet",
            f"{1000 * level[0]:.0f} mm out from the coxa axes and "
            f"{-1000 * (level[2] + legs[0].position[2]):.0f} mm below the body's origin are an "
            "assumption.",
            hint=f"phasmid convert {tree.file or 'FILE'} robot.toml, and change neutral_foot_mm "
            "there",
        )
    servo = servo_of(bones.chains, options.servo, tree.servo, findings)
    pieces = weighed(_pieces(bones, legs, X_body_up), options, findings)
    masses = [p.inertial.mass if p.inertial else np.nan for p in pieces]
    facts = ImportFacts(
        plain(tree.name).strip()[:LONGEST_NAME] or "robot",
        tuple(legs),
        feet,
        np.reshape(masses[1:], (-1, 3)),
        float(np.nansum(masses)),
        servo,
    )
    return facts, pieces


def _judged(tree: Tree, bones: Skeleton, options: ImportOptions) -> tuple[Finding, ...]:
    """Judge those masses and inertias that are used with the options, as on a scale."""
    has_all = all(body.inertial and body.inertial.mass for body in bones.bodies)
    if options.masses == "geometry" and not has_all and options.total_mass is not None:
        # The total is shared among all.
        return judge(tree, bones, used="none")
    total = sum(link.inertial.mass for link in tree.links.values() if link.inertial)
    if options.total_mass is not None and total > 0:
        tree = scaled_masses(tree, options.total_mass / total, inertias=True)
    return judge(tree, bones, used="all" if options.masses == "as-given" else "masses")


def _legs(bones: Skeleton, options: ImportOptions, findings: Findings) -> list[FoundLeg]:
    """Find all legs.

    Raises:
        PhasmidError: Some do not fit this model; the error is the first one's, and the findings
            name all of them.
    """
    order = names_in_order(np.array([chain.hip for chain in bones.chains]))
    names, chains = [name for name, _ in order], [bones.chains[i] for _, i in order]
    legs: list[FoundLeg] = []
    errors: list[PhasmidError] = []
    feet = feet_of(chains, options.foot)
    for number, (name, chain, foot) in enumerate(zip(names, chains, feet, strict=True), 1):
        subject = f"leg {number}"
        try:
            if isinstance(foot, PhasmidError):
                raise foot
            legs.append(found_leg(number, name, chain, foot, findings))
        except PhasmidError as error:
            what = error.what.removeprefix(f"{subject}: ")
            findings.impossible(subject, what, error.where, error.hint)
            errors.append(error)
            continue
        if foot.finding:
            findings.append(foot.finding)
        for joint in chain.joints:
            if joint.kind == "continuous" or not np.isfinite(joint.upper - joint.lower):
                what = "no limits in the file; ±180° was assumed."
                findings.note(f"joint {joint.name}", what, joint.where)
    if errors:
        raise errors[0]
    return legs


def _pieces(bones: Skeleton, legs: Sequence[FoundLeg], X_body_up: np.ndarray) -> list[Piece]:
    """Return the trunk and all links in their frames, with the file's masses."""

    def piece(rigid: RigidLink, X: np.ndarray, leg: str, joint: str, length: float) -> Piece:
        inertial = possible(rigid.inertial.at(X)) if rigid.inertial else None
        parts = tuple(part.at(X) for part in rigid.parts)
        subject = f"link {rigid.name}"
        return Piece(subject, leg, joint, length, size, inertial, parts, rigid.links[0].where)

    X_body_trunk = X_body_up @ bones.X_up_trunk
    hips = np.array([leg.position for leg in legs])
    size = _body_size(bones.trunk, X_body_trunk, hips)
    pieces = [piece(bones.trunk, X_body_trunk, "", "body", 0.0)]
    for leg in legs:
        for i, (joint, rigid) in enumerate(zip(JOINTS, leg.chain.links, strict=True)):
            X = inverse(leg.X_trunk_links[i]) @ leg.chain.poses[i]
            pieces.append(piece(rigid, X, leg.name, joint, float(leg.lengths[i])))
    return pieces


def _robot(facts: ImportFacts, pieces: Sequence[Piece]) -> Robot:
    """Build the robot from what was understood."""
    if facts.feet is None:
        raise InvalidRobot(
            "no stance with knees up is within the joint limits.",
            hint="widen the limits, or check their signs",
        )
    if facts.servo is None:
        raise InvalidRobot(
            "the joints have no effort, so their servos are not known.",
            hint="--servo-model AX-12A",
        )
    trunk, *links = pieces
    legs = [
        _leg(leg, foot, links[3 * i : 3 * i + 3])
        for i, (leg, foot) in enumerate(zip(facts.legs, facts.feet, strict=True))
    ]
    with _named(trunk) as inertial:
        body = Body(inertial.mass, inertial.com, inertial.inertia, trunk.size)
    parts = {f"{p.leg}.{p.joint}" if p.leg else "body": p.parts for p in pieces if p.parts}
    look = Appearance.of(parts, MESHES) if parts else None
    return Robot(facts.name, body, tuple(legs), facts.servo, "", look)


def _leg(leg: FoundLeg, foot: Float[np.ndarray, "3"], pieces: Sequence[Piece]) -> Leg:
    links = {}
    for piece, left in zip(pieces, leg.lateral_offsets, strict=True):
        with _named(piece) as own:
            numbers = (piece.length, own.mass, own.com, own.inertia, float(left))
            links[piece.joint] = Link(piece.joint, *numbers)
    yaw, pitch, roll = map(float, leg.angles)
    _, e2, e3 = map(float, leg.offsets)
    return Leg(
        leg.name,
        **links,
        mount_position=leg.position,
        mount_yaw=yaw,
        mount_pitch=pitch,
        mount_roll=roll,
        neutral_foot=foot,
        joint_limits=leg.limits,
        femur_bend=e2,
        tibia_bend=e2 + e3,
    )


@contextmanager
def _named(piece: Piece) -> Iterator[Inertial]:
    """Give the mass of a link, and name the file's link in errors about the robot's."""
    if piece.inertial is None or piece.inertial.mass == 0:
        moves = "moves but" if piece.leg else "is the trunk and"
        raise InvalidRobot(f"{piece.subject} {moves} has no mass.", where=piece.where, hint=NO_MASS)
    try:
        yield piece.inertial
    except InvalidRobot as error:
        what = error.what
        for ours in (f"link {piece.joint}:", "body:"):
            what = what.replace(ours, f"{piece.subject}:")
        raise InvalidRobot(what, where=piece.where, hint="--masses geometry") from None


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
