"""Judgement of a robot's symmetry and of the directions of its legs."""

from __future__ import annotations

import math

import numpy as np

from phasmid.formats.findings import Finding, Findings
from phasmid.formats.legs import MIDDLE
from phasmid.robot import JOINTS, Leg, Robot
from phasmid.units import plain_number

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

_MIRROR = np.array([1.0, -1.0, 1.0])


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


def _points_across(leg: Leg, middle: float) -> bool:
    """Return whether a leg points to the side of the body on which its hip does not lie."""
    side = float(leg.mount_position[1]) - middle
    return abs(side) > MIDDLE and math.copysign(1, side) * float(leg.X_body_hip[1, 0]) < -ACROSS


def _unlike(one: Leg, other: Leg, middle: float, *, directions: bool) -> list[str]:
    """Describe the difference between a leg and the mirror image of its counterpart."""
    found = []
    axis = np.array([0.0, 2 * middle, 0.0])
    apart = float(np.linalg.norm(other.mount_position * _MIRROR + axis - one.mount_position))
    if apart > PLACES:
        found.append(f"the hips' places differ by {plain_number(1000 * apart, 3)} mm")
    turn = float(one.X_body_hip[:3, 0] @ (other.X_body_hip[:3, 0] * _MIRROR))
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
    foot = float(np.linalg.norm(other.neutral_foot * _MIRROR - one.neutral_foot))
    if foot > PLACES:
        found.append(f"their neutral feet differ by {plain_number(1000 * foot, 3)} mm")
    return found
