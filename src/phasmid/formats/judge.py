"""Plausibility of a robot's numbers: suspect ones, and those with which it cannot stand.

Impossible masses and inertias are refused by `Link` and `Body`, for files of all formats alike.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from phasmid.errors import PhasmidError
from phasmid.formats.assumptions import DATA_SHEET, Piece
from phasmid.formats.chains import Chain
from phasmid.formats.findings import Finding, Findings, Severity, grouped, mm
from phasmid.formats.legs import MIDDLE
from phasmid.gait import shortfall, support_margin
from phasmid.kinematics import (
    body_height,
    centre_of_mass,
    joint_angles,
    neutral_feet,
    trunk_clearance,
)
from phasmid.robot import JOINTS, Leg, Robot
from phasmid.servo.rules import contradictions
from phasmid.units import STANDARD_GRAVITY, plain_number

SMALLEST = 0.04
"""Links are taken as at least this long [m]: a servo sits beside a short link."""

OUTSIDE = 0.1
"""Part of a link's length by which its matter may be outside its meshes: these leave out screws,
cables and horns."""

ALIKE = 1e-6
"""Masses that differ by less than this part are one number, copied."""

STRONGEST = 10.0
"""Torque, in weights of the robot at a leg's length, above which an effort is a placeholder:
the strongest walking machines have 1, the PhantomX 0.2."""

FASTEST = 50.0
"""No-load speed above which a number is a placeholder [rad/s]: hobby servos reach 13, the motors
of running quadrupeds 40."""

ACROSS = 0.1
"""Part of a leg's direction that may point to the body's other side: the sine of 5.7°."""

PLACES = 2.0
"""Hips and feet of a pair may lie this far from each other's mirror image, and lengths of its
links differ by as much [mm]."""

DIRECTIONS, LIMITS = 1.0, 20.0
"""Angles by which the directions and the joint limits of a pair may differ [°]."""

MASSES = 0.1
"""Part by which masses of a pair may differ: cables make hundredths of a mass."""


def judge_links(chains: Iterable[Chain], links: Iterable[Piece], masses: str) -> Findings:
    """Find suspect masses and inertias of the links of a file, those with possible numbers.

    ``masses`` is the option, which is not advised where it was taken.
    """
    found = Findings()
    for link in links:
        if link.parts:
            _judge_matter(link, found)
    for number, chain in enumerate(chains, 1):
        weights = [
            max(link.inertial.mass if link.inertial else 0.0 for link in rigid.links)
            for rigid in chain.links
        ]
        if weights[0] > 0 and np.allclose(weights, weights[0], ALIKE, 0):
            what = (
                f"coxa, femur and tibia all have {plain_number(1000 * weights[0])} g; unlike parts "
                "must have masses of their own."
            )
            hint = "weigh them" if masses == "geometry" else 'masses = "geometry", or weigh them'
            found.suspect(f"leg {number}", what, hint=hint)
    return found


def _judge_matter(link: Piece, found: Findings) -> None:
    """Compare centre of mass and inertia of a link with the box of its meshes."""
    assert link.inertial is not None
    low = np.minimum(link.box[0], 0.0)
    high = np.maximum(link.box[1], [link.length, 0.0, 0.0])
    size = max(float((high - low).max()), SMALLEST)
    com, moments = link.inertial.com, np.linalg.eigvalsh(link.inertial.inertia)
    outside = float(np.maximum(np.maximum(low - com, com - high), 0.0).max())
    hint = 'masses = "geometry", which spreads each mass over its link\'s box'
    if outside > OUTSIDE * size:
        what = f"centre of mass is {mm(outside)} outside its {mm(size)} box."
        found.suspect(link.subject, what, link.where, hint)
    radius = math.sqrt(max(float(moments[2]), 0.0) / link.mass)
    farthest = float(np.linalg.norm(np.maximum(com - low, high - com)))
    if radius > farthest + OUTSIDE * size:
        what = (
            f"inertia {moments[2]:.3g} kg m² with {plain_number(1000 * link.mass)} g gives a "
            f"gyration radius of {mm(radius)}; its matter is at most {mm(farthest)} from its "
            "centre of mass."
        )
        found.suspect(link.subject, what, link.where, hint)


def judge_robot(robot: Robot, *, read: bool = False) -> tuple[Finding, ...]:
    """Find what is suspect about a robot whose numbers are possible one by one.

    Args:
        robot: The robot, from a file of any kind.
        read: Whether neutral feet were assumed, as from a URDF.
    """
    found = Findings()
    _judge_servo(robot, found)
    _judge_symmetry(robot, found, assumed=read)
    _judge_stance(robot, found, assumed=read)
    try:
        _ = robot.appearance and robot.appearance.parts
    except PhasmidError as error:
        found.suspect("appearance", error.what, error.where, error.hint)
    return grouped(found)


def _judge_servo(robot: Robot, found: Findings) -> None:
    """Find torques and speeds that are placeholders."""
    arrays, length = robot.arrays, float(robot.arrays.lengths.sum(axis=1).max())
    effort, speed = float(arrays.stall_torque.max()), float(arrays.no_load_speed.max())
    times = effort / (robot.mass * STANDARD_GRAVITY * length)
    if times > STRONGEST:
        what = (
            f"effort {effort:.4g} N·m would lift {times:.0f} such robots at a leg's "
            f"length; the limit is {STRONGEST:g}."
        )
        found.suspect("servos", what, hint=DATA_SHEET)
    if speed > FASTEST:
        what = f"speed is {speed:.4g} rad/s; the limit is {FASTEST:g} rad/s."
        found.suspect("servos", what, hint=DATA_SHEET)
    for sentence in contradictions(robot.servo):
        found.note("servos", sentence)


def _judge_stance(robot: Robot, found: Findings, *, assumed: bool) -> None:
    """Find whether the robot stands on its neutral feet, which may be an assumption."""
    try:
        q = joint_angles(robot.arrays, robot.arrays.neutral_foot)
    except PhasmidError as error:
        found.impossible("neutral feet", error.what, error.where, error.hint)
        return
    for leg, angles in zip(robot.legs, q, strict=True):
        limits = np.degrees(leg.joint_limits)
        for joint, angle, (low, high) in zip(JOINTS, np.degrees(angles), limits, strict=True):
            if not low <= angle <= high:
                found.impossible(
                    f"joint {leg.name}.{joint}",
                    f"stands at {angle:.4g}°, outside its limits {low:.4g}° to {high:.4g}°.",
                    hint="move the neutral foot, or widen the limits",
                )
    com, feet = centre_of_mass(robot, q), neutral_feet(robot)
    clearance = trunk_clearance(robot, body_height(robot), np.zeros(6))
    if clearance < 0 and not assumed:
        what = f"the trunk reaches {mm(-clearance)} below the feet."
        found.impossible("neutral feet", what, hint="lower feet, or check the trunk's box")
    margin = float(support_margin(feet[:, :2], np.ones(len(feet), dtype=bool), np.asarray(com[:2])))
    if margin < 0:
        stance = "on the feet that phasmid assumed" if assumed else "in its neutral stance"
        severity = Severity.SUSPECT if assumed else Severity.IMPOSSIBLE
        hint = "move the neutral feet" if assumed else "check the trunk's centre of mass"
        what = f"it topples {stance}: {shortfall(margin)}."
        found.append(Finding(severity, "robot", what, hint=hint))


def _judge_symmetry(robot: Robot, found: Findings, *, assumed: bool) -> None:
    """Find legs that point across the body, and pairs of legs that do not mirror each other."""
    # An odd leg would move the mean.
    middle = float(np.median([leg.mount_position[1] for leg in robot.legs]))
    sides = {leg.name: leg.mount_position[1] - middle for leg in robot.legs}
    for leg in robot.legs:
        side = sides[leg.name]
        if abs(side) > MIDDLE and np.sign(side) * leg.X_body_hip[1, 0] < -ACROSS:
            yaw, where = math.degrees(leg.mount_yaw), "left" if side > 0 else "right"
            what = (
                f"points across the body: its hip is on the {where} and its yaw is "
                f"{plain_number(yaw)}°."
            )
            found.suspect(f"leg {leg.name}", what, hint=f"yaw_deg = {plain_number(-yaw)}")
    by_x = sorted(robot.legs, key=lambda leg: -leg.mount_position[0])
    right, left = ([leg for leg in by_x if sign * sides[leg.name] > MIDDLE] for sign in (-1, 1))
    if len(right) != len(left):
        found.note("robot", f"{len(right)} legs are on its right side and {len(left)} on its left.")
        return
    for one, other in zip(right, left, strict=True):
        if unlike := _differences(one, other, middle, assumed=assumed):
            what = f"is not the mirror image of leg {other.name}: {'; '.join(unlike)}."
            hint = "give both the same measures, unless the robot is built so"
            found.suspect(f"leg {one.name}", what, hint=hint)


def _differences(one: Leg, other: Leg, middle: float, *, assumed: bool) -> list[str]:
    """Describe the differences between a leg and the mirror image of its counterpart."""
    mirror = np.array([1.0, -1.0, 1.0])
    hip = other.mount_position * mirror + [0.0, 2 * middle, 0.0] - one.mount_position
    foot = other.neutral_foot * mirror - one.neutral_foot
    cosine = float(one.X_body_hip[:3, 0] @ (other.X_body_hip[:3, 0] * mirror))
    limits = np.degrees(np.abs(one.joint_limits[1:] - other.joint_limits[1:]).max())
    differences = [
        ("the hips' places", 1000 * np.linalg.norm(hip), PLACES, " mm"),
        ("their directions", math.degrees(math.acos(np.clip(cosine, -1, 1))), DIRECTIONS, "°"),
        ("their joint limits", limits, LIMITS, "°"),
    ]
    if not assumed:
        # Feet that were chosen say nothing about the file.
        differences.append(("their neutral feet", 1000 * np.linalg.norm(foot), PLACES, " mm"))
    for a, b in zip(one.links, other.links, strict=True):
        differences += [
            (f"the {a.name}s' lengths", 1000 * abs(a.length - b.length), PLACES, " mm"),
            (
                f"the {a.name}s' masses",
                1000 * abs(a.mass - b.mass),
                1000 * MASSES * max(a.mass, b.mass),
                " g",
            ),
        ]
    return [
        f"{what} differ by {plain_number(float(difference), 3)}{unit}"
        for what, difference, most, unit in differences
        if difference > most
    ]
