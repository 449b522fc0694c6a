"""Robots from kinematic trees: legs, masses, servo and stance in phasmid's terms."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidRobot, PhasmidError, plain
from phasmid.formats.bodies import possible
from phasmid.formats.chains import Skeleton, skeleton
from phasmid.formats.feet import feet_of
from phasmid.formats.findings import Finding, Findings, Severity, grouped
from phasmid.formats.judge import judge, judge_servo, judge_standing, mass_slip, scaled_masses
from phasmid.formats.legs import PRINTED, FoundLeg, found_leg, names_in_order
from phasmid.formats.masses import NO_MASS, Piece, weighed
from phasmid.formats.options import ImportOptions
from phasmid.formats.servos import servo_of
from phasmid.formats.standing import standing_feet
from phasmid.formats.symmetry import judge_symmetry
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
        options: What a person adds to the file.

    Returns:
        The robot, or why there is none; in either case all findings.
    """
    options = options or ImportOptions()
    findings = Findings(tree.findings)
    facts = None
    try:
        facts, pieces = _understood(tree, options, findings)
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


def _understood(
    tree: Tree, options: ImportOptions, findings: Findings
) -> tuple[ImportFacts, list[Piece]]:
    """Find the legs, the servo, the neutral feet, and the masses in the frames of Table 1."""
    if options.masses == "as-given" and options.total_mass is not None and mass_slip(tree):
        what = "were taken for grams, as the inertias show; the inertias were kept."
        findings.note("masses", what, tree.file)
        tree = scaled_masses(tree, 1e-3, inertias=False)
    bones = skeleton(tree)
    findings += bones.findings
    used = _used(bones, options)
    findings += judge(tree if used == "none" else _on_a_scale(tree, options), bones, used=used)
    legs = _legs(bones, options, findings)
    middle = np.mean([leg.position for leg in legs], axis=0)
    if np.linalg.norm(middle) > PRINTED:
        shown = ", ".join(f"{round(1000 * float(c), 2) + 0.0:.2f}" for c in middle)
        findings.note("body", f"its origin was moved by ({shown}) mm, amid the coxa axes.")
    else:
        middle = np.zeros(3)
    X_body_up = np.eye(4)
    X_body_up[:3, 3] = -middle
    legs = [replace(leg, position=_rounded(leg.position - middle)) for leg in legs]
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


def _rounded(position: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    """Remove round-off beside 0."""
    return np.where(np.abs(position) < 1e-15, 0.0, position)


def _on_a_scale(tree: Tree, options: ImportOptions) -> Tree:
    """Scale the tree to the total mass of the options, for the judge."""
    total = sum(link.inertial.mass for link in tree.links.values() if link.inertial)
    if options.total_mass is None or not total > 0:
        return tree
    return scaled_masses(tree, options.total_mass / total, inertias=True)


def _used(bones: Skeleton, options: ImportOptions) -> Literal["all", "masses", "none"]:
    """Return which masses and inertias of the file are used with the options."""
    if options.masses == "as-given":
        return "all"
    # Where one has no mass, the total is shared among all.
    has_all = all(body.inertial and body.inertial.mass for body in bones.bodies)
    return "masses" if has_all or options.total_mass is None else "none"


def _legs(bones: Skeleton, options: ImportOptions, findings: Findings) -> list[FoundLeg]:
    """Find all legs.

    Raises:
        PhasmidError: Some do not fit this model; the error is the first one's, and the findings
            name all of them.
    """
    named = names_in_order(np.array([chain.hip for chain in bones.chains]))
    chains = [bones.chains[i] for _, i in named]
    legs: list[FoundLeg] = []
    errors: list[PhasmidError] = []
    for number, foot in enumerate(feet_of(chains, options.foot), 1):
        name, chain, subject = named[number - 1][0], chains[number - 1], f"leg {number}"
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
    legs = [
        _leg(leg, foot, pieces[1 + 3 * i : 4 + 3 * i])
        for i, (leg, foot) in enumerate(zip(facts.legs, facts.feet, strict=True))
    ]
    trunk, inertial = pieces[0], _mass_of(pieces[0])
    with _named(trunk):
        body = Body(inertial.mass, inertial.com, inertial.inertia, trunk.size)
    parts = {f"{p.leg}.{p.joint}" if p.leg else "body": p.parts for p in pieces if p.parts}
    look = Appearance.of(parts, MESHES) if parts else None
    return Robot(facts.name, body, tuple(legs), facts.servo, "", look)


def _leg(leg: FoundLeg, foot: Float[np.ndarray, "3"], pieces: Sequence[Piece]) -> Leg:
    links = {}
    for piece, left in zip(pieces, leg.lateral_offsets, strict=True):
        inertial = _mass_of(piece)
        with _named(piece):
            links[piece.joint] = Link(
                piece.joint,
                piece.length,
                inertial.mass,
                inertial.com,
                inertial.inertia,
                float(left),
            )
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


def _mass_of(piece: Piece) -> Inertial:
    if piece.inertial is None or piece.inertial.mass == 0:
        moves = "moves but" if piece.leg else "is the trunk and"
        raise InvalidRobot(f"{piece.subject} {moves} has no mass.", where=piece.where, hint=NO_MASS)
    return piece.inertial


@contextmanager
def _named(piece: Piece) -> Iterator[None]:
    """Name the file's link in errors about a robot's link."""
    try:
        yield
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
