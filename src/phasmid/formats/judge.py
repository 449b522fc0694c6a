"""Plausibility of a robot's numbers: physically impossible and suspect ones."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Literal

import numpy as np
from jaxtyping import Float

from phasmid.errors import PhasmidError
from phasmid.formats.assumptions import DATA_SHEET, NO_MASS
from phasmid.formats.bodies import bounds, judge_body
from phasmid.formats.chains import FREE, Skeleton, skeleton
from phasmid.formats.findings import Finding, Findings, Severity, grouped
from phasmid.formats.legs import MIDDLE, names_in_order
from phasmid.formats.tree import HINGES, WHOLE_TURN, Tree
from phasmid.gait import shortfall, support_margin
from phasmid.kinematics import centre_of_mass, joint_angles, longest_stride, neutral_feet
from phasmid.robot import JOINTS, Leg, Robot, Servo
from phasmid.robot.inertial import Inertial
from phasmid.robot.link import LONGEST_LENGTH
from phasmid.units import STANDARD_GRAVITY, plain_number

ALIKE = 1e-6
"""Masses and inertias that differ by less than this part are one number, copied."""

UNEVEN = 0.1
"""Part by which the masses of a right link and its left counterpart may differ: cables and screws
make a few hundredths."""

LIGHTEST, HEAVIEST = 0.05, 200.0
"""Masses of walking robots with servos [kg]; a single small servo has 0.01, `Link` refuses 200."""

NARROWEST_RANGE = math.radians(5)
"""Ranges of joints narrower than this are unlikely for a leg [rad]."""

SHORTEST_STRIDE = 0.010
"""Strides shorter than this are unlikely [m]."""

LEANING = 0.1
"""Part of the half track by which the centre of mass may be off the middle."""

STRONGEST = 10.0
"""Torque, in weights of the robot at a leg's length, above which an effort is a placeholder:
the strongest walking machines have 1, the PhantomX 0.2."""

FASTEST = 50.0
"""No-load speed above which a number is a placeholder [rad/s]: hobby servos reach 13, the motors
of running quadrupeds 40."""


ACROSS = 0.1
"""Part of a leg's direction that may point to the body's other side: the sine of 5.7°."""

PLACES = 2e-3
"""Hips and neutral feet of a pair may lie this far from each other's mirror image [m]."""

LENGTHS = 0.01
"""Part by which the lengths of a pair may differ."""

DIRECTIONS = math.radians(1.0)
"""Angle by which the directions of a pair may differ from each other's mirror image [rad]."""

LIMITS = math.radians(20.0)
"""Angle by which limits of femur and tibia may differ in a pair [rad]."""


@np.errstate(over="ignore", invalid="ignore")
def judge(
    tree: Tree, bones: Skeleton | None = None, *, used: Literal["all", "masses", "none"] = "all"
) -> tuple[Finding, ...]:
    """Find impossible or suspect masses, inertias and limits of a tree.

    Args:
        tree: As it was read.
        bones: Its trunk and legs, if they are known already.
        used: Which of the links' numbers are used: masses, centres and inertias, masses alone, or
            none. Others are not judged.

    Returns:
        Findings, grouped.
    """
    found = Findings()
    if bones is None:
        try:
            bones = skeleton(tree)
        except PhasmidError as error:
            found.impossible("robot", error.what, error.where, error.hint)
    too_long = _lengths(tree)
    if used != "none":
        inertias = used == "all"
        if (slip := mass_slip(tree)) is not None:
            # With masses in grams, findings about single links are consequences.
            found.append(slip)
            found += _links(scaled_masses(tree, 1e-3, inertias=False), bones, inertias)
        else:
            found += _links(tree, bones, inertias) if not too_long else []
            if (total := _mass(tree)) > 0 and not LIGHTEST <= total <= HEAVIEST:
                what = (
                    f"weighs {plain_number(total)} kg in all; walking robots weigh {LIGHTEST:g} to "
                    f"{HEAVIEST:g} kg."
                )
                found.suspect("robot", what, hint="--total-mass-g as on a scale")
        if bones is not None:
            found += _legs(bones)
    return grouped([*found, *too_long, *_limits(tree)])


def judge_robot(robot: Robot) -> tuple[Finding, ...]:
    """Find what is suspect about a robot whose numbers are possible one by one.

    Args:
        robot: The robot, from a file of any kind.
    """
    legs = {
        leg.name: [Inertial(link.mass, link.com, link.inertia) for link in leg.links]
        for leg in robot.legs
    }
    found = [*_copies(legs), *_uneven(legs, robot.arrays.p_body_hip), *judge_symmetry(robot)]
    return grouped([*found, *judge_standing(robot), *_narrow(robot), *_look(robot)])


def judge_standing(robot: Robot, *, assumed: bool = False) -> tuple[Finding, ...]:
    """Find whether a robot stands on its neutral feet without toppling, and judge its servo.

    Args:
        robot: The robot.
        assumed: Whether the neutral feet are an assumption, so that the robot may stand otherwise.
    """
    found = Findings()
    try:
        q = joint_angles(robot.arrays, robot.arrays.neutral_foot)
    except PhasmidError as error:
        found.impossible("neutral feet", error.what, error.where, error.hint)
        return tuple(found)
    found += judge_servo(robot.servo, robot.mass, float(robot.arrays.lengths.sum(axis=1).max()))
    for leg, angles in zip(robot.legs, q, strict=True):
        for joint, angle, (low, high) in zip(JOINTS, angles, leg.joint_limits, strict=True):
            if not low <= angle <= high:
                found.impossible(
                    f"joint {leg.name}.{joint}",
                    f"stands at {_degrees(angle)}, outside its limits {_range(low, high)}.",
                    hint="move the neutral foot, or widen the limits",
                )
    com, feet = centre_of_mass(robot, q), neutral_feet(robot)
    margin = float(support_margin(feet[:, :2], np.ones(len(feet), dtype=bool), np.asarray(com[:2])))
    aside = float(com[1] - feet[:, 1].mean())
    hint = "move the neutral feet" if assumed else "check the trunk's centre of mass"
    if margin < 0:
        stance = "on the feet that phasmid assumed" if assumed else "in its neutral stance"
        severity = Severity.SUSPECT if assumed else Severity.IMPOSSIBLE
        what = f"it topples {stance}: {shortfall(margin)}."
        found.append(Finding(severity, "robot", what, hint=hint))
    elif abs(aside) > LEANING * float(np.ptp(feet[:, 1])) / 2:
        found.suspect(
            "robot",
            f"its centre of mass is {plain_number(1000 * abs(aside), 3)} mm to the "
            f"{'left' if aside > 0 else 'right'} of the middle of its feet.",
            hint=hint,
        )
    return tuple(found)


def judge_symmetry(robot: Robot, *, read: bool = False) -> tuple[Finding, ...]:
    """Find legs that point across the body, and pairs of legs that do not mirror each other.

    Args:
        robot: The robot.
        read: Whether its hips were computed from joints, not given as angles.
    """
    hips = np.array([leg.mount_position for leg in robot.legs])
    # An odd leg would move the mean.
    middle = float(np.median(hips[:, 1]))
    found = Findings()
    across = {leg.name for leg in robot.legs if _points_across(leg, middle)}
    for leg in robot.legs:
        if leg.name in across:
            yaw = plain_number(math.degrees(leg.mount_yaw))
            found.suspect(
                f"leg {leg.name}",
                f"points across the body: its hip is on the "
                f"{'left' if leg.mount_position[1] > middle else 'right'} and its yaw is {yaw}°.",
                hint="check the origin and axis of its first joint"
                if read
                else f"yaw_deg = {plain_number(-math.degrees(leg.mount_yaw))}",
            )
    right, left = (
        sorted(
            (leg for leg in robot.legs if side * (leg.mount_position[1] - middle) > MIDDLE),
            key=lambda leg: -leg.mount_position[0],
        )
        for side in (-1, 1)
    )
    if len(right) != len(left):
        found.note("robot", f"{len(right)} legs are on its right side and {len(left)} on its left.")
        return tuple(found)
    for one, other in zip(right, left, strict=True):
        unlike = _unlike(one, other, middle, directions=not across & {one.name, other.name})
        if unlike:
            what = f"is not the mirror image of leg {other.name}: {'; '.join(unlike)}."
            hint = "give both the same measures, unless the robot is built so"
            found.suspect(f"leg {one.name}", what, hint=hint)
    return tuple(found)


def judge_servo(servo: Servo, mass: float, length: float) -> tuple[Finding, ...]:
    """Find torques and speeds that are placeholders.

    Args:
        servo: Servo of every joint.
        mass: Mass of the whole robot [kg].
        length: Length of its longest leg [m].
    """
    found = Findings()
    times = servo.stall_torque / (mass * STANDARD_GRAVITY * length)
    if times > STRONGEST:
        found.suspect(
            "servos",
            f"effort {servo.stall_torque:.4g} N·m would lift {times:.0f} such robots at a leg's "
            f"length; the limit is {STRONGEST:g}.",
            hint=DATA_SHEET,
        )
    if servo.no_load_speed > FASTEST:
        what = f"speed is {servo.no_load_speed:.4g} rad/s; the limit is {FASTEST:g} rad/s."
        found.suspect("servos", what, hint=DATA_SHEET)
    return tuple(found)


def scaled_masses(tree: Tree, factor: float, *, inertias: bool) -> Tree:
    """Scale all masses of a tree.

    Args:
        tree: The tree.
        factor: Factor of every mass.
        inertias: Whether inertias are scaled too.
    """
    links = {}
    for name, link in tree.links.items():
        inertial = link.inertial
        if inertial is not None:
            scaled = inertial.scaled(factor)
            inertial = scaled if inertias else replace(inertial, mass=scaled.mass)
        links[name] = replace(link, inertial=inertial)
    return replace(tree, links=links)


@np.errstate(over="ignore", invalid="ignore")
def mass_slip(tree: Tree) -> Finding | None:
    """Find masses in grams: a thousand times too large for their own inertias.

    Args:
        tree: As it was read.
    """
    total = _mass(tree)
    if not HEAVIEST < total <= 1000 * HEAVIEST:
        return None
    light = scaled_masses(tree, 1e-3, inertias=False)
    before, after = (
        sum(f.severity is Severity.IMPOSSIBLE for f in _links(each, None, inertias=True))
        for each in (tree, light)
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


def _mass(tree: Tree) -> float:
    return sum(link.inertial.mass for link in tree.links.values() if link.inertial)


def _lengths(tree: Tree) -> Findings:
    """Find joints farther apart than those of any robot."""
    found = Findings()
    distances = {
        joint: float(np.linalg.norm(joint.X_parent_child[:3, 3]))
        for joint in tree.joints
        if joint.kind not in FREE
    }
    far = [joint for joint, distance in distances.items() if distance > LONGEST_LENGTH]
    if far:
        longest = max(far, key=lambda joint: distances[joint])
        found.impossible(
            f"joint {longest.name}",
            f"it is {plain_number(distances[longest])} m from its parent's frame, and "
            f"{len(far)} of {len(distances)} joints are more than {LONGEST_LENGTH:g} m; such "
            "lengths are refused.",
            longest.where,
            "divide lengths by 1000 if they are millimetres: xyz of all origins are metres",
        )
    return found


def _links(tree: Tree, bones: Skeleton | None, inertias: bool) -> Findings:
    """Judge masses and inertias of single links.

    What is impossible of a link that is fixed to others is only suspect where all of them
    together, as they are simulated, make a possible body.
    """
    found, held = Findings(), _possible_together(bones)
    for link in tree.links.values():
        if link.inertial is None:
            continue
        joints = [joint.X_parent_child[:3, 3] for joint in tree.joints_from(link.name)]
        box = bounds(link.parts, joints)
        if not link.complete:
            # A missing mesh may hold matter elsewhere.
            box = replace(box, volume=math.nan, solid=False)
        for fault in judge_body(
            f"link {link.name}", link.inertial, box, link.where, inertias=inertias
        ):
            if fault.severity is Severity.IMPOSSIBLE and link.name in held:
                what = fault.what.removesuffix(".")
                what = f"{what}; with the links that it is fixed to it is possible."
                fault = replace(fault, severity=Severity.SUSPECT, what=what)
            found.append(fault)
    return found


def _possible_together(bones: Skeleton | None) -> set[str]:
    """Return names of links that are fixed to others with which they make a possible body."""
    found: set[str] = set()
    for rigid in bones.bodies if bones else ():
        if len(rigid.links) < 2 or rigid.inertial is None:
            continue
        joints = [rigid.pose_of(joint)[:3, 3] for joint in rigid.joints]
        faults = judge_body("", rigid.inertial, bounds(rigid.parts, joints), "")
        if all(fault.severity is not Severity.IMPOSSIBLE for fault in faults):
            found |= {i.name for i in rigid.links if i.inertial and i.inertial.mass >= 0}
    return found


def _limits(tree: Tree) -> Findings:
    """Judge limits, efforts and speeds of the hinges."""
    found = Findings()
    for joint in tree.joints:
        if joint.kind not in HINGES:
            continue
        subject = f"joint {joint.name}"
        if joint.kind == "revolute" and joint.lower >= joint.upper:
            what = f"its limits are {_range(joint.lower, joint.upper)}; the upper must be larger."
            hint = "make it a fixed joint, or give it limits"
            found.impossible(subject, what, joint.where, hint)
        largest = max((abs(e) for e in (joint.lower, joint.upper) if math.isfinite(e)), default=0)
        if largest > WHOLE_TURN:
            found.impossible(
                subject,
                f"its limits reach {plain_number(largest)} rad; a leg's joint turns by one turn at "
                "most.",
                joint.where,
                f"{plain_number(math.radians(largest), 5)}, if these are degrees",
            )
        for noun, value in (("effort", joint.effort), ("speed", joint.velocity)):
            if value is not None and not 0 < value < math.inf:
                what = f"its {noun} is {value:g}; it must be finite and greater than 0."
                found.suspect(subject, what, joint.where, DATA_SHEET)
    return found


def _legs(bones: Skeleton) -> Findings:
    """Compare the masses of the legs' links."""
    found = Findings()
    for chain in bones.chains:
        for link in chain.links:
            if link.inertial is None or link.inertial.mass == 0:
                subject = f"link {link.name}"
                found.impossible(subject, "moves but has no mass.", link.links[0].where, NO_MASS)
    hips = np.array([chain.hip for chain in bones.chains])
    order = [i for _, i in names_in_order(hips)]
    masses, heaviest = {}, {}
    for number, i in enumerate(order, 1):
        links = bones.chains[i].links
        masses[str(number)] = [link.inertial for link in links]
        heaviest[str(number)] = [
            max((own.inertial for own in link.links if own.inertial), key=_own_mass, default=None)
            for link in links
        ]
    return Findings([*found, *_copies(heaviest), *_uneven(masses, hips[order])])


def _own_mass(inertial: Inertial) -> float:
    return inertial.mass


def _copies(legs: Mapping[str, Sequence[Inertial | None]]) -> Findings:
    """Find legs whose three links have one mass and one inertia: a number that was copied."""
    found = Findings()
    for name, links in legs.items():
        numbers = [
            [link.mass, *np.linalg.eigvalsh(link.inertia)] for link in links if link is not None
        ]
        if len(numbers) == 3 and numbers[0][0] and np.allclose(numbers, numbers[0], ALIKE, 0):
            what = (
                f"coxa, femur and tibia all have {plain_number(1000 * numbers[0][0])} g and the "
                "same inertia; unlike parts must have masses of their own."
            )
            found.suspect(f"leg {name}", what, hint="weigh them, or --masses geometry")
    return found


def _uneven(
    legs: Mapping[str, Sequence[Inertial | None]], hips: Float[np.ndarray, "legs 3"]
) -> Findings:
    """Find links whose counterpart on the other side has another mass."""
    found = Findings()
    width = float(np.ptp(hips[:, 1]))
    placed = zip(legs, hips - hips.mean(axis=0), strict=True)
    for (a, p), (b, q) in combinations(placed, 2):
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
                found.suspect(f"leg {a}", what, hint="weigh both")
    return found


def _narrow(robot: Robot) -> Findings:
    """Find joints that hardly turn, or legs that hardly step, as of radians taken for degrees."""
    found = Findings()
    for leg in robot.legs:
        for joint, (low, high) in zip(JOINTS, leg.joint_limits, strict=True):
            if high - low < NARROWEST_RANGE:
                what = f"turns by {_degrees(high - low, 3)} in all, {_range(low, high)}."
                hint = "limits of TOML files are degrees: coxa_deg = [-50, 50]"
                found.suspect(f"joint {leg.name}.{joint}", what, hint=hint)
    if found:
        return found
    try:
        stride = min(longest_stride(robot), longest_stride(robot, math.pi / 2))
    except PhasmidError:
        # A foot out of reach is reported already.
        return found
    if 0 < stride < SHORTEST_STRIDE:
        found.suspect(
            "robot",
            f"its longest stride is {plain_number(1000 * stride, 3)} mm; a walking robot's is "
            f"{1000 * SHORTEST_STRIDE:g} mm or more.",
            hint="wider joint limits, or a neutral foot amid the reach",
        )
    return found


def _look(robot: Robot) -> Findings:
    """Find meshes that cannot be read, or that belong to no link."""
    found = Findings()
    if robot.appearance is None:
        return found
    try:
        names = set(robot.appearance.parts)
    except PhasmidError as error:
        found.suspect("appearance", error.what, error.where, error.hint)
        return found
    known = {"body", *JOINTS, *(f"{leg}.{joint}" for leg in robot.leg_names for joint in JOINTS)}
    for name in sorted(names - known):
        found.note("appearance", f'"{name}" is no link of this robot; its mesh is not shown.')
    return found


def _degrees(angle: float, digits: int = 4) -> str:
    return f"{plain_number(math.degrees(angle), digits)}°"


def _range(low: float, high: float) -> str:
    return f"[{_degrees(low)}, {_degrees(high)}]"


def _points_across(leg: Leg, middle: float) -> bool:
    """Return whether a leg points to the side of the body on which its hip does not lie."""
    side = float(leg.mount_position[1]) - middle
    return abs(side) > MIDDLE and math.copysign(1, side) * float(leg.X_body_hip[1, 0]) < -ACROSS


def _unlike(one: Leg, other: Leg, middle: float, *, directions: bool) -> list[str]:
    """Describe the difference between a leg and the mirror image of its counterpart."""
    found = []
    axis = np.array([0.0, 2 * middle, 0.0])
    apart = float(np.linalg.norm(other.mount_position * [1, -1, 1] + axis - one.mount_position))
    if apart > PLACES:
        found.append(f"the hips' places differ by {plain_number(1000 * apart, 3)} mm")
    turn = float(one.X_body_hip[:3, 0] @ (other.X_body_hip[:3, 0] * [1, -1, 1]))
    angle = math.acos(min(1.0, max(-1.0, turn)))
    if directions and angle > DIRECTIONS:
        found.append(f"their directions differ by {plain_number(math.degrees(angle), 3)}°")
    for joint, a, b in zip(JOINTS, one.lengths, other.lengths, strict=True):
        if abs(a - b) > LENGTHS * max(a, b):
            found.append(
                f"its {joint} is {plain_number(1000 * a)} mm long and that one's "
                f"{plain_number(1000 * b)} mm"
            )
    ranges = np.abs(one.joint_limits[1:] - other.joint_limits[1:]).max()
    if ranges > LIMITS:
        found.append(f"their joint limits differ by {plain_number(math.degrees(ranges), 3)}°")
    foot = float(np.linalg.norm(other.neutral_foot * [1, -1, 1] - one.neutral_foot))
    if foot > PLACES:
        found.append(f"their neutral feet differ by {plain_number(1000 * foot, 3)} mm")
    return found
