"""Plausibility of a robot's numbers: physically impossible and suspect ones."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Literal

import numpy as np

from phasmid.errors import PhasmidError
from phasmid.formats.bodies import bounds, judge_body
from phasmid.formats.chains import FREE, Chain, Skeleton, skeleton
from phasmid.formats.extension import read_extension
from phasmid.formats.findings import Finding, Severity
from phasmid.formats.found import named_chains
from phasmid.formats.grouping import grouped
from phasmid.formats.load import judge_servo
from phasmid.formats.origins import WHOLE_TURN
from phasmid.formats.rigid import RigidLink, rigid_link
from phasmid.formats.symmetry import judge_symmetry
from phasmid.formats.tree import HINGES, Tree, TreeLink
from phasmid.gait import shortfall, support_margin
from phasmid.kinematics import centre_of_mass, joint_angles, longest_stride, neutral_feet
from phasmid.robot import JOINTS, Robot
from phasmid.robot.inertial import Inertial, merged
from phasmid.robot.link import LONGEST_LENGTH
from phasmid.units import plain_number

ALIKE = 1e-6
"""Masses and inertias that differ by less than this part are one number, copied."""

UNEVEN = 0.1
"""Part by which the masses of a right link and its left counterpart may differ: cables and screws
make a few hundredths."""

LIGHTEST, HEAVIEST = 0.05, 200.0
"""Weights of walking robots with servos [kg]; a single small servo has 0.01, `Link` refuses 200."""

NARROWEST_RANGE = math.radians(5)
"""Ranges of joints narrower than this are hardly a leg's [rad]."""

SHORTEST_STRIDE = 0.010
"""Strides shorter than this are hardly a walk [m]."""

LEANING = 0.1
"""Part of the half track by which the centre of mass may lie off the middle."""

NEGLIGIBLE = 0.05
"""Part of their inertia by which a link changes the links that it is fixed to, and part of their
length by which it moves their centre of mass, up to which its own numbers do not matter."""


@np.errstate(over="ignore", invalid="ignore")
def judge(
    tree: Tree, bones: Skeleton | None = None, *, used: Literal["all", "masses", "none"] = "all"
) -> tuple[Finding, ...]:
    """Find impossible or suspect masses, inertias and limits of a tree.

    Args:
        tree: As it was read.
        bones: Its trunk and legs, where they are known already.
        used: The part of its links' data in use: masses, centres and inertias, masses alone, or
            nothing. Faults of unused data are only counted.

    Returns:
        Findings, those that differ in nothing but their subject as one.
    """
    found: list[Finding] = []
    if bones is None:
        try:
            bones = skeleton(tree)
        except PhasmidError as error:
            found.append(Finding(Severity.IMPOSSIBLE, "robot", error.what, error.where, error.hint))
    long = length_slip(tree)
    if long:
        found += long
    for link in tree.links.values():
        found += _mesh_size(link)
    found += _joints(tree, placed=not long)
    weights = _weights(tree, bones, links=not long, inertias=True)
    shown = {
        "all": weights,
        "masses": _weights(tree, bones, links=not long, inertias=False),
        "none": [],
    }[used]
    unused = len(weights) - len(shown)
    if unused > 0:
        faults = "1 fault" if unused == 1 else f"{unused} faults"
        nouns = "centres of mass and inertias" if used == "masses" else "masses and inertias"
        what = f"{faults} in the file's {nouns}, which are not used."
        found.append(Finding(Severity.NOTE, "masses", what))
    return grouped([*shown, *found])


def _weights(tree: Tree, bones: Skeleton | None, *, links: bool, inertias: bool) -> list[Finding]:
    """Find faults of the links' masses, and of their inertias where these are used."""
    heavy = mass_slip(tree)
    if heavy is not None:
        # Of masses in grams, what is said of each link is a consequence.
        light = scaled_masses(tree, 1e-3, inertias=False)
        found = [heavy, *_bodies(light, bones, inertias=inertias)]
    else:
        found = _bodies(tree, bones, inertias=inertias) if links else []
        found += _total(tree)
    if bones is not None:
        found += _without_mass(bones)
        chains = _by_number(tree, bones)
        legs = {number: [link.inertial for link in c.links] for number, c in chains.items()}
        found += _copies(
            {
                number: [_heaviest(link.links) for link in chain.links]
                for number, chain in chains.items()
            }
        )
        hips = [chain.hip for chain in chains.values()]
        found += _uneven(legs, np.array(hips))
    return found


def judge_robot(robot: Robot) -> tuple[Finding, ...]:
    """Find suspect combinations of a robot's numbers, each of which is possible.

    Args:
        robot: From a file of any kind.
    """
    legs = {
        leg.name: [Inertial(link.mass, link.com, link.inertia) for link in leg.links]
        for leg in robot.legs
    }
    found = _copies(legs) + _uneven(legs, robot.arrays.p_body_hip)
    found += judge_symmetry(robot)
    return grouped([*found, *judge_standing(robot), *_narrow(robot), *_look(robot)])


def judge_standing(robot: Robot, *, assumed: bool = False) -> tuple[Finding, ...]:
    """Find whether a robot stands on its neutral feet without toppling.

    Args:
        robot: The robot.
        assumed: Whether phasmid assumed the neutral feet, so that the robot may stand on others.
    """
    try:
        q = joint_angles(robot.arrays, robot.arrays.neutral_foot)
    except PhasmidError as error:
        return (Finding(Severity.IMPOSSIBLE, "neutral feet", error.what, error.where, error.hint),)
    length = float(robot.arrays.lengths.sum(axis=1).max())
    found = list(judge_servo(robot.servo, robot.mass, length))
    for leg, angles in zip(robot.legs, q, strict=True):
        for joint, angle, (low, high) in zip(JOINTS, angles, leg.joint_limits, strict=True):
            if not low <= angle <= high:
                found.append(
                    Finding(
                        Severity.IMPOSSIBLE,
                        f"joint {leg.name}.{joint}",
                        f"stands at {plain_number(math.degrees(angle))}°, outside its limits "
                        f"[{plain_number(math.degrees(low))}°, "
                        f"{plain_number(math.degrees(high))}°].",
                        hint="move the neutral foot, or widen the limits",
                    )
                )
    hint = "move the neutral feet" if assumed else "check the trunk's centre of mass"
    com, feet = centre_of_mass(robot, q), neutral_feet(robot)
    margin = float(support_margin(feet[:, :2], np.ones(len(feet), dtype=bool), np.asarray(com[:2])))
    if margin < 0:
        found.append(
            Finding(
                Severity.SUSPECT if assumed else Severity.IMPOSSIBLE,
                "robot",
                f"it topples on the feet that phasmid assumed: {shortfall(margin)}."
                if assumed
                else f"it topples in its neutral stance: {shortfall(margin)}.",
                hint=hint,
            )
        )
    track = float(np.ptp(feet[:, 1]))
    aside = float(com[1] - feet[:, 1].mean())
    if margin >= 0 and abs(aside) > LEANING * track / 2:
        found.append(
            Finding(
                Severity.SUSPECT,
                "robot",
                f"its centre of mass lies {plain_number(1000 * abs(aside), 3)} mm to the "
                f"{'left' if aside > 0 else 'right'} of the middle of its feet.",
                hint=hint,
            )
        )
    return tuple(found)


def _bodies(tree: Tree, bones: Skeleton | None = None, *, inertias: bool = True) -> list[Finding]:
    """Find faults of the links' masses and inertias, one by one."""
    found: list[Finding] = []
    fixed = _fixed_to_others(tree, bones)
    for link in tree.links.values():
        if link.inertial is None:
            continue
        joints = [joint.X_parent_child[:3, 3] for joint in tree.joints_from(link.name)]
        box = bounds(link.parts, joints)
        if not link.complete:
            # Without one of its meshes nobody knows where its matter is.
            box = replace(box, volume=math.nan, solid=False)
        faults = judge_body(f"link {link.name}", link.inertial, box, link.where, inertias=inertias)
        if faults and link.name in fixed and not _matters(link, fixed[link.name]):
            carrier = fixed[link.name].name
            faults = [
                replace(
                    fault,
                    severity=Severity.SUSPECT,
                    what=f"{fault.what.removesuffix('.')}; it hardly matters, as the link is fixed "
                    f"to {carrier} and light beside it.",
                )
                if fault.severity is Severity.IMPOSSIBLE
                else fault
                for fault in faults
            ]
        found += faults
    return found


def _fixed_to_others(tree: Tree, bones: Skeleton | None) -> dict[str, RigidLink]:
    """The rigid links of several links, by the name of each link besides their first."""
    if bones is not None:
        rigid = [bones.trunk, *(link for chain in bones.chains for link in chain.links)]
    else:
        moved = [joint.child for joint in tree.joints if joint.kind != "fixed"]
        rigid = [rigid_link(tree, name) for name in (tree.root.name, *moved)]
    # Of a scaled tree the bones have the older masses.
    return {
        link.name: replace(each, links=tuple(tree.links[link.name] for link in each.links))
        for each in rigid
        for link in each.links[1:]
        if len(each.links) > 1
    }


@np.errstate(over="ignore", invalid="ignore", divide="ignore")
def _matters(link: TreeLink, rigid: RigidLink) -> bool:
    """Return whether a link changes the mass, centre or inertia of those that it is fixed to."""
    pieces = [(rigid.poses[each.name], each.inertial) for each in rigid.links if each.inertial]
    whole = merged([inertial.at(X) for X, inertial in pieces])
    rest = merged([each.at(X) for X, each in pieces if each is not link.inertial])
    if whole is None or rest is None or not 0 <= whole.mass - rest.mass < NEGLIGIBLE * rest.mass:
        return True
    corners = [X[:3, 3] for X, _ in pieces] + [j.X_parent_child[:3, 3] for j in rigid.joints]
    size = bounds(rigid.parts, corners).size
    shift = float(np.linalg.norm(whole.com - rest.com)) / size
    change = float(np.linalg.norm(whole.inertia - rest.inertia) / np.linalg.norm(rest.inertia))
    return not (shift < NEGLIGIBLE and change < NEGLIGIBLE)


def scaled_masses(tree: Tree, factor: float, *, inertias: bool) -> Tree:
    """The tree with other masses, and its inertias scaled as they are or kept.

    Args:
        tree: The tree.
        factor: Of every mass.
        inertias: Whether inertias are scaled with the masses.
    """
    links = {}
    for name, link in tree.links.items():
        inertial = link.inertial
        if inertial is not None:
            inertia = factor * inertial.inertia if inertias else inertial.inertia
            inertial = Inertial(factor * inertial.mass, inertial.com, inertia)
        links[name] = replace(link, inertial=inertial)
    return replace(tree, links=links)


@np.errstate(over="ignore", invalid="ignore")
def mass_slip(tree: Tree) -> Finding | None:
    """Find masses in grams: a thousand times too large for their own inertias.

    Args:
        tree: As it was read.
    """
    total = sum(link.inertial.mass for link in tree.links.values() if link.inertial)
    if not HEAVIEST < total <= 1000 * HEAVIEST:
        return None
    light = scaled_masses(tree, 1e-3, inertias=False)
    before, after = (
        sum(f.severity is Severity.IMPOSSIBLE for f in _bodies(each)) for each in (tree, light)
    )
    if after >= before:
        return None
    return Finding(
        Severity.IMPOSSIBLE,
        "robot",
        f"weighs {plain_number(total)} kg in all, and its inertias are those of "
        f"{plain_number(total / 1000)} kg; masses must be in kilograms, and these look like grams.",
        tree.file,
        "divide every mass by 1000, or --total-mass-g as on a scale",
    )


def length_slip(tree: Tree) -> list[Finding]:
    """Find lengths in millimetres: most joints farther apart than those of any robot.

    Args:
        tree: As it was read.
    """
    away = [float(np.linalg.norm(j.X_parent_child[:3, 3])) for j in tree.joints]
    away = [length for length in away if length > 0]
    far = [length for length in away if length > LONGEST_LENGTH]
    if not far or 2 * len(far) < len(away) or not max(far) <= 1000 * LONGEST_LENGTH:
        return []
    what = (
        f"{len(far)} of its joints stand {plain_number(min(far))} to {plain_number(max(far))} m "
        f"from their parents' frames; lengths above {LONGEST_LENGTH:g} m are refused. They look "
        "like millimetres."
    )
    hint = "divide every length by 1000: xyz of all origins are metres"
    return [Finding(Severity.IMPOSSIBLE, "robot", what, tree.file, hint)]


def _narrow(robot: Robot) -> list[Finding]:
    """Joints that hardly turn, or legs that hardly step, as of radians taken for degrees."""
    found = []
    for leg in robot.legs:
        for joint, (low, high) in zip(JOINTS, leg.joint_limits, strict=True):
            if high - low >= NARROWEST_RANGE:
                continue
            ends = f"[{plain_number(math.degrees(low))}°, {plain_number(math.degrees(high))}°]"
            what = f"turns by {plain_number(math.degrees(high - low), 3)}° in all, {ends}."
            hint = "limits of TOML files are degrees: coxa_deg = [-50, 50]"
            found.append(Finding(Severity.SUSPECT, f"joint {leg.name}.{joint}", what, hint=hint))
    if found:
        return found
    try:
        stride = min(longest_stride(robot), longest_stride(robot, math.pi / 2))
    except PhasmidError:
        # A foot out of reach is reported already.
        return []
    if 0 < stride < SHORTEST_STRIDE:
        what = (
            f"its longest stride is {plain_number(1000 * stride, 3)} mm; a walking robot's is "
            f"{1000 * SHORTEST_STRIDE:g} mm or more."
        )
        hint = "wider joint limits, or a neutral foot amid the reach"
        found.append(Finding(Severity.SUSPECT, "robot", what, hint=hint))
    return found


def _by_number(tree: Tree, bones: Skeleton) -> dict[str, Chain]:
    """Chains by their number in the robot, counted from 1."""
    try:
        said = read_extension(tree.extension, tree.file) if tree.extension else None
    except PhasmidError:
        # Whoever makes the robot refuses it.
        said = None
    named = named_chains(bones.chains, said, [])
    return {str(number): chain for number, (_, chain, _) in enumerate(named, 1)}


def _look(robot: Robot) -> list[Finding]:
    if robot.appearance is None:
        return []
    try:
        names = set(robot.appearance.parts)
    except PhasmidError as error:
        return [Finding(Severity.SUSPECT, "appearance", error.what, error.where, error.hint)]
    known = {"body", *JOINTS, *(f"{leg}.{joint}" for leg in robot.leg_names for joint in JOINTS)}
    return [
        Finding(Severity.NOTE, "appearance", f'"{name}" is the look of no link of this robot.')
        for name in sorted(names - known)
    ]


def _total(tree: Tree) -> list[Finding]:
    total = sum(link.inertial.mass for link in tree.links.values() if link.inertial)
    if LIGHTEST <= total <= HEAVIEST or total <= 0:
        return []
    factor = 1e-3 if total > HEAVIEST else 1e3
    fits = LIGHTEST <= total * factor <= HEAVIEST
    return [
        Finding(
            Severity.SUSPECT,
            "robot",
            f"weighs {plain_number(total)} kg in all; walking robots weigh {LIGHTEST:g} to "
            f"{HEAVIEST:g} kg" + (f"; times {factor:g} it would." if fits else "."),
            hint="--total-mass-g as on a scale",
        )
    ]


def _mesh_size(link: TreeLink) -> list[Finding]:
    if not link.parts:
        return []
    size = bounds(link.parts, ()).size
    if size <= LONGEST_LENGTH:
        return []
    what = (
        f"its mesh is {plain_number(size)} m long; lengths above {LONGEST_LENGTH:g} m are "
        f"refused. In millimetres it would be {plain_number(size)} mm."
    )
    return [Finding(Severity.SUSPECT, f"link {link.name}", what, link.where, "--mesh-unit mm")]


def _joints(tree: Tree, *, placed: bool) -> list[Finding]:
    found: list[Finding] = []
    for joint in tree.joints:
        subject = f"joint {joint.name}"
        away = float(np.linalg.norm(joint.X_parent_child[:3, 3]))
        if placed and away > LONGEST_LENGTH and joint.kind not in FREE:
            what = (
                f"it stands {plain_number(away)} m from its parent's frame; lengths above "
                f"{LONGEST_LENGTH:g} m are refused. In millimetres it would be "
                f"{plain_number(away)} mm."
            )
            found.append(Finding(Severity.IMPOSSIBLE, subject, what, joint.where, "use metres"))
        if joint.kind not in HINGES:
            continue
        if joint.kind == "revolute" and joint.lower >= joint.upper:
            what = (
                f"its limits {plain_number(math.degrees(joint.lower))}° to "
                f"{plain_number(math.degrees(joint.upper))}° leave it no way; the upper must be "
                "above the lower."
            )
            hint = "make it a fixed joint, or give it limits"
            found.append(Finding(Severity.IMPOSSIBLE, subject, what, joint.where, hint))
        ends = [abs(end) for end in (joint.lower, joint.upper) if math.isfinite(end)]
        if ends and max(ends) > WHOLE_TURN:
            what = (
                f"its limits reach {plain_number(max(ends))} rad, {max(ends) / (2 * math.pi):.1f} "
                f"turns; a leg's joint turns by one at most. {plain_number(max(ends))}° would be "
                f"{plain_number(math.radians(max(ends)))} rad."
            )
            hint = f"{plain_number(math.radians(max(ends)), 5)}, in radians"
            found.append(Finding(Severity.IMPOSSIBLE, subject, what, joint.where, hint))
        for noun, value in (("effort", joint.effort), ("speed", joint.velocity)):
            if value is not None and not (value > 0 and math.isfinite(value)):
                what = f"its {noun} is {value:g}; it must be finite and greater than 0."
                hint = "--servo-model AX-12A, to take all from a data sheet"
                found.append(Finding(Severity.SUSPECT, subject, what, joint.where, hint))
    return found


def _without_mass(bones: Skeleton) -> list[Finding]:
    return [
        Finding(
            Severity.IMPOSSIBLE,
            f"link {link.name}",
            "moves but has no mass.",
            link.links[0].where,
            "--masses phantomx-mk4, or geometry with --total-mass-g",
        )
        for chain in bones.chains
        for link in chain.links
        if link.inertial is None or link.inertial.mass == 0
    ]


def _heaviest(links: Sequence[TreeLink]) -> Inertial | None:
    return max(
        (link.inertial for link in links if link.inertial), key=lambda i: i.mass, default=None
    )


def _copies(legs: Mapping[str, Sequence[Inertial | None]]) -> list[Finding]:
    """Legs whose three links share one mass and one inertia: a number that was copied."""
    found = []
    for name, links in legs.items():
        first = links[0]
        if first is None or not first.mass:
            continue
        moments = [np.linalg.eigvalsh(link.inertia) for link in links if link is not None]
        if len(moments) == 3 and all(
            other is not None
            and math.isclose(other.mass, first.mass, rel_tol=ALIKE)
            and np.allclose(moment, moments[0], rtol=ALIKE, atol=0)
            for other, moment in zip(links, moments, strict=True)
        ):
            what = (
                f"coxa, femur and tibia all have {plain_number(1000 * first.mass)} g and the same "
                f"inertia; unlike parts must have masses of their own."
            )
            hint = "weigh them, or --masses phantomx-mk4"
            found.append(Finding(Severity.SUSPECT, f"leg {name}", what, hint=hint))
    return found


def _uneven(legs: Mapping[str, Sequence[Inertial | None]], hips: np.ndarray) -> list[Finding]:
    """Links whose counterpart on the other side has another mass."""
    found = []
    width = float(np.ptp(hips[:, 1]))
    middle = hips.mean(axis=0)
    for (a, p), (b, q) in combinations(zip(legs, hips - middle, strict=True), 2):
        # Counterparts mirror each other, each away from the middle.
        if np.linalg.norm(p * [1, -1, 1] - q) > UNEVEN * width or abs(p[1]) < UNEVEN * width:
            continue
        for joint, one, other in zip(JOINTS, legs[a], legs[b], strict=True):
            if one is None or other is None or not (one.mass > 0 and other.mass > 0):
                continue
            if abs(one.mass - other.mass) > UNEVEN * max(one.mass, other.mass):
                what = (
                    f"its {joint} has {plain_number(1000 * one.mass)} g, and that of leg {b}, "
                    f"across the body, {plain_number(1000 * other.mass)} g; a pair should weigh "
                    "the same."
                )
                found.append(Finding(Severity.SUSPECT, f"leg {a}", what, hint="weigh both"))
    return found
