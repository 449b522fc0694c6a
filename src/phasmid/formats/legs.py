"""Conversion of a kinematic tree to a robot: its legs, and their numbers in our frames."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Literal

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidRobot, PhasmidError, plain
from phasmid.formats.bodies import possible
from phasmid.formats.chains import Chain, Skeleton, skeleton
from phasmid.formats.extension import Extension, read_extension
from phasmid.formats.findings import Finding, Severity
from phasmid.formats.foot import feet_of
from phasmid.formats.found import FoundLeg, found_leg, named_chains
from phasmid.formats.grouping import grouped
from phasmid.formats.imported import Imported, ImportFacts, LegFacts
from phasmid.formats.judge import judge, judge_standing, mass_slip, scaled_masses
from phasmid.formats.load import judge_servo
from phasmid.formats.masses import Weighed, weighed
from phasmid.formats.mounts import Mount, body_frame, mount_of
from phasmid.formats.options import ImportOptions
from phasmid.formats.rigid import RigidLink, inverse
from phasmid.formats.servos import missing, servo_of
from phasmid.formats.standing import Stance, standing_feet
from phasmid.formats.symmetry import judge_symmetry
from phasmid.formats.tree import Tree
from phasmid.robot import JOINTS, Appearance, Body, Leg, Link, Robot
from phasmid.robot.inertial import Inertial
from phasmid.robot.table import LONGEST_NAME
from phasmid.units import plain_number

THINNEST = 0.05
"""Height of a trunk whose hips alone are known [m], about that of a servo."""

MESHES = "robot.glb"
"""Name of the file of a robot's meshes beside a run or a robot file."""


# Foreign numbers may be beyond any measure; what overflows is refused by its size.
@np.errstate(over="ignore", invalid="ignore")
def robot_from_tree(tree: Tree, options: ImportOptions | None = None) -> Imported:
    """Make a robot of a kinematic tree.

    Legs are the chains of three hinges that leave the trunk; names of links and joints decide
    nothing but which frame is a foot.

    Args:
        tree: The tree, its joints at angle 0.
        options: Data that the user adds to the file.

    Returns:
        The robot, or why there is none; in either case all that was found.
    """
    options = options or ImportOptions()
    findings = list(tree.findings)
    facts: list[ImportFacts] = []
    robot, error = None, None
    try:
        robot = _robot(tree, options, findings, facts)
    except PhasmidError as refusal:
        error = refusal
        error.where = error.where or tree.file
        if facts:
            findings += _servo(facts[0])
        if not any(finding.severity is Severity.IMPOSSIBLE for finding in findings):
            found = Finding(Severity.IMPOSSIBLE, "robot", error.what, error.where, error.hint)
            findings.append(found)
        error = _first(findings, error)
    return Imported(robot, grouped(findings), error, facts[0] if facts else None)


def _mended(tree: Tree, findings: list[Finding]) -> Tree:
    """Convert masses from grams to kilograms, where the options give the total mass."""
    if mass_slip(tree) is None:
        return tree
    what = "were taken for grams, which the inertias bear out; the inertias were kept."
    findings.append(Finding(Severity.NOTE, "masses", what, tree.file))
    return scaled_masses(tree, 1e-3, inertias=False)


def _on_a_scale(tree: Tree, options: ImportOptions) -> Tree:
    """Scale the tree to the total mass of the options, for the judge."""
    total = sum(link.inertial.mass for link in tree.links.values() if link.inertial)
    if options.total_mass is None or not (total > 0 and options.total_mass > 0):
        return tree
    return scaled_masses(tree, options.total_mass / total, inertias=True)


def _used(bones: Skeleton, options: ImportOptions) -> Literal["all", "masses", "none"]:
    """Return which masses and inertias of the file are used with the options."""
    if options.masses == "geometry":
        bodies = [bones.trunk, *(link for chain in bones.chains for link in chain.links)]
        weighed = all(body.inertial and body.inertial.mass for body in bodies)
        # Where one has no mass, the total is shared among all.
        return "masses" if weighed or options.total_mass is None else "none"
    return "all" if options.masses == "as-given" else "none"


def _first(findings: Sequence[Finding], error: PhasmidError) -> PhasmidError:
    """Return the first impossible finding as the error; the raised one may follow from it."""
    first = next(f for f in grouped(findings) if f.severity is Severity.IMPOSSIBLE)
    if error.what in (first.what, first.sentence, f"{first.subject} {first.what}"):
        return error
    return InvalidRobot(first.sentence, where=first.where or error.where, hint=first.hint)


def _robot(
    tree: Tree, options: ImportOptions, findings: list[Finding], facts: list[ImportFacts]
) -> Robot:
    """Build the robot, and collect findings and facts."""
    extension = read_extension(tree.extension, tree.file) if tree.extension else None
    if options.masses == "as-given" and options.total_mass is not None:
        tree = _mended(tree, findings)
    bones = skeleton(tree, upright=extension is None)
    findings += bones.findings
    used = _used(bones, options)
    findings += judge(tree if used == "none" else _on_a_scale(tree, options), bones, used=used)
    legs = _legs(bones.chains, extension, options, findings)
    hips = np.array([leg.plan.X_trunk_hip for leg in legs])
    # With an extension the file is this project's own, and its root link is the body.
    X_body_up = np.eye(4)
    if extension is None:
        X_body_up = inverse(body_frame(hips[:, :3, 3], findings))
    mounts = []
    for number, (leg, X_trunk_hip) in enumerate(zip(legs, hips, strict=True), 1):
        mount, tilt = mount_of(X_body_up @ X_trunk_hip, leg.said)
        if tilt:
            findings.append(_levelled(number, tilt, leg))
        mounts.append(mount)
    feet, foot_source = _feet(legs, mounts, tree.file or "FILE", findings)
    motor = extension.motor if extension else None
    servo, servo_source = servo_of(bones.chains, options.servo, motor or tree.servo, findings)
    pieces = _weighed(bones.trunk, legs, X_body_up @ bones.X_up_trunk, mounts, extension)
    pieces = weighed(pieces, options, findings)
    name = extension.name if extension else printable(tree.name)
    facts.append(
        ImportFacts(
            name,
            _names(bones.trunk),
            tuple(
                _leg_facts(leg, mount, None if feet is None else feet[i], pieces[_of_leg(i)])
                for i, (leg, mount) in enumerate(zip(legs, mounts, strict=True))
            ),
            sum(piece.inertial.mass for piece in pieces if piece.inertial),
            _mass_source(options),
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
            f"the joints have {missing(bones.chains)}, so their servos are not known.",
            hint="--servo-model AX-12A",
        )
    made = tuple(
        _leg(leg, mount, foot, pieces[_of_leg(i)])
        for i, (leg, mount, foot) in enumerate(zip(legs, mounts, feet, strict=True))
    )
    robot = Robot(
        name,
        _body(pieces[0]),
        made,
        servo,
        extension.description if extension else "",
        _appearance(pieces),
    )
    said = all(leg.said is not None for leg in legs)
    findings += judge_standing(robot, assumed=not said)
    findings += judge_symmetry(robot, read=True)
    return robot


def printable(name: str) -> str:
    """Return the name of a foreign robot in the form that robot files accept."""
    return plain(name).strip()[:LONGEST_NAME] or "robot"


def _legs(
    chains: Sequence[Chain],
    extension: Extension | None,
    options: ImportOptions,
    findings: list[Finding],
) -> list[FoundLeg]:
    """Find all legs.

    Raises:
        PhasmidError: Some are none of this model; the error is the first one's, and the findings
            name all of them.
    """
    named = named_chains(chains, extension, findings)
    names, ours = [name for name, _, _ in named], [chain for _, chain, _ in named]
    feet = feet_of(names, ours, options.foot, findings)
    legs: list[FoundLeg] = []
    errors: dict[int, PhasmidError] = {}
    for number, ((name, chain, said), foot) in enumerate(zip(named, feet, strict=True), 1):
        try:
            if isinstance(foot, PhasmidError):
                raise foot
            legs.append(found_leg(number, name, chain, said, foot, findings))
            if said is None:
                findings += _unlimited(chain)
        except PhasmidError as error:
            errors[number] = error
    if not errors:
        return legs
    for number, refusal in errors.items():
        subject = f"leg {number}"
        what = refusal.what.removeprefix(f"{subject}: ")
        findings.append(Finding(Severity.IMPOSSIBLE, subject, what, refusal.where, refusal.hint))
    raise next(iter(errors.values()))


def _unlimited(chain: Chain) -> list[Finding]:
    return [
        Finding(
            Severity.NOTE,
            f"joint {joint.name}",
            "no limits in the file; ±180° was assumed.",
            where=joint.where,
        )
        for joint in chain.joints
        if joint.kind == "continuous" or math.isinf(joint.upper - joint.lower)
    ]


def _of_leg(index: int) -> slice:
    """Return the slice of a leg's links among all, behind the trunk."""
    return slice(1 + 3 * index, 4 + 3 * index)


def _mass_source(options: ImportOptions) -> str:
    source = {
        "as-given": "the file",
        "geometry": "the file's masses, spread over the links' boxes",
    }.get(options.masses, f"those of {options.masses}, scaled to the lengths")
    if options.total_mass is None:
        return source
    return f"{source}; scaled to {plain_number(options.total_mass)} kg in all"


def _servo(facts: ImportFacts) -> tuple[Finding, ...]:
    """Judge the servo of a robot that is impossible for other reasons."""
    if facts.servo is None or not facts.legs or not facts.mass > 0:
        return ()
    length = max(float(np.sum(leg.lengths)) for leg in facts.legs)
    return judge_servo(facts.servo, facts.mass, length)


def _levelled(number: int, tilt: float, leg: FoundLeg) -> Finding:
    reach = float(leg.plan.lengths.sum())
    return Finding(
        Severity.NOTE,
        f"leg {number}",
        f"coxa axis was turned by {plain_number(math.degrees(tilt), 2)}° to be vertical, which "
        f"moves the foot by {plain_number(1000 * reach * tilt, 2)} mm at most.",
        where=leg.chain.joints[0].where,
    )


def _feet(
    legs: Sequence[FoundLeg], mounts: Sequence[Mount], file: str, findings: list[Finding]
) -> tuple[Float[np.ndarray, "legs 3"] | None, str]:
    """Return neutral feet in the hip frames, and their origin."""
    said = [leg.said.neutral_foot for leg in legs if leg.said is not None]
    if len(said) == len(legs):
        return np.array(said), "the file's phasmid extension"
    feet = standing_feet([_stance(leg, mount) for leg, mount in zip(legs, mounts, strict=True)])
    if feet is not None:
        level = mounts[0].R_level_hip @ feet[0]
        findings.append(
            Finding(
                Severity.NOTE,
                "neutral feet",
                f"stand {1000 * level[0]:.0f} mm out from the coxa axes and "
                f"{-1000 * (level[2] + mounts[0].position[2]):.0f} mm below the body's origin: "
                "an assumption.",
                hint=f"phasmid convert {file} robot.toml, and change neutral_foot_mm there",
            )
        )
    return feet, "assumed in proportion to the legs"


def _stance(leg: FoundLeg, mount: Mount) -> Stance:
    plan, height = leg.plan, float(mount.position[2])
    return Stance(plan.lengths, plan.lateral_offsets, leg.limits, mount.R_level_hip, height)


def _leg_facts(
    leg: FoundLeg,
    mount: Mount,
    foot: Float[np.ndarray, "3"] | None,
    pieces: Sequence[Weighed],
) -> LegFacts:
    coxa, femur, tibia = leg.chain.links
    masses = [piece.inertial.mass if piece.inertial else math.nan for piece in pieces]
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


def _weighed(
    trunk: RigidLink,
    legs: Sequence[FoundLeg],
    X_body_trunk: Float[np.ndarray, "4 4"],
    mounts: Sequence[Mount],
    extension: Extension | None,
) -> list[Weighed]:
    """Return the trunk and all links in their frames, with the file's masses."""

    def piece(rigid: RigidLink, X: np.ndarray, leg: str, joint: str, length: float) -> Weighed:
        return Weighed(
            f"link {rigid.name}",
            leg,
            joint,
            length,
            size,
            possible(rigid.inertial.at(X)) if rigid.inertial else None,
            tuple(part.at(X) for part in rigid.parts),
            rigid.links[0].where,
        )

    hips = np.array([mount.position for mount in mounts])
    size = np.array(extension.body_size) if extension else body_size(trunk, X_body_trunk, hips)
    span = float(np.mean(np.linalg.norm(hips, axis=1)))
    pieces = [piece(trunk, X_body_trunk, "", "body", span)]
    for leg in legs:
        for i, (joint, rigid) in enumerate(zip(JOINTS, leg.chain.links, strict=True)):
            X = inverse(leg.plan.X_trunk_links[i]) @ leg.chain.poses[i]
            pieces.append(piece(rigid, X, leg.name, joint, float(leg.plan.lengths[i])))
    return pieces


def _leg(
    leg: FoundLeg, mount: Mount, foot: Float[np.ndarray, "3"], pieces: Sequence[Weighed]
) -> Leg:
    links = {}
    for piece, left in zip(pieces, leg.plan.lateral_offsets, strict=True):
        inertial = _mass_of(piece)
        measures = inertial.mass, inertial.com, inertial.inertia, float(left)
        with _speaking_of(piece):
            links[piece.joint] = Link(piece.joint, piece.length, *measures)
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


def _body(piece: Weighed) -> Body:
    inertial = _mass_of(piece)
    with _speaking_of(piece):
        return Body(inertial.mass, inertial.com, inertial.inertia, piece.size)


def _mass_of(piece: Weighed) -> Inertial:
    if piece.inertial is None or piece.inertial.mass == 0:
        moves = "moves but" if piece.leg else "is the trunk and"
        raise InvalidRobot(
            f"{piece.subject} {moves} has no mass.",
            where=piece.where,
            hint="--masses phantomx-mk4, or geometry with --total-mass-g",
        )
    return piece.inertial


@contextmanager
def _speaking_of(piece: Weighed) -> Iterator[None]:
    """Name the file's link in errors of ours."""
    try:
        yield
    except InvalidRobot as error:
        what = error.what
        for ours in (f"link {piece.joint}:", "body:"):
            what = what.replace(ours, f"{piece.subject}:")
        # Its own hints are about the keys of a TOML file.
        hint = "--masses geometry, or --masses phantomx-mk4"
        raise InvalidRobot(what, where=piece.where, hint=hint) from None


def body_size(
    trunk: RigidLink, X_body_trunk: Float[np.ndarray, "4 4"], hips: Float[np.ndarray, "legs 3"]
) -> Float[np.ndarray, "3"]:
    """The box about the body's origin that reaches as far forward, aside and down as the trunk.

    The ground must stay clear of it, so parts above the hips do not count. Without
    meshes it reaches to the hips.

    Args:
        trunk: The trunk.
        X_body_trunk: The trunk's frame in the body, shape (4, 4).
        hips: In the body frame [m], shape (L, 3).

    Returns:
        Length, width and height [m], shape (3,).
    """
    points = [part.at(X_body_trunk).vertices for part in trunk.parts] or [hips]
    low, high = np.concatenate(points).min(axis=0), np.concatenate(points).max(axis=0)
    size = 2 * np.maximum(-low, [high[0], high[1], 0.0])
    # Hips of one height do not show that of the trunk.
    return np.maximum(size, THINNEST)


def _appearance(pieces: Sequence[Weighed]) -> Appearance | None:
    parts = {f"{p.leg}.{p.joint}" if p.leg else "body": p.parts for p in pieces if p.parts}
    return Appearance.of(parts, MESHES) if parts else None
