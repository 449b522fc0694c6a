"""The servo of a tree's joints."""

from __future__ import annotations

import math
from collections.abc import Sequence

from phasmid.errors import located
from phasmid.formats.chains import Chain
from phasmid.formats.findings import Findings
from phasmid.robot import Servo, load_servo
from phasmid.units import plain_number

LIKE = "AX-12A"
"""Hobby servo whose stiffness, rotor and friction stand in for what a file leaves out, and its
speed in formats without speeds, such as MJCF."""

DATA_SHEET = "--servo-model AX-12A, to take all from a data sheet"
"""Hint where numbers of a servo are assumed or unlikely."""


def servo_of(
    chains: Sequence[Chain], option: str, own: Servo | None, findings: Findings
) -> Servo | None:
    """Return the servo of every joint: a named one, the file's own, or one of the file's numbers.

    Args:
        chains: The legs.
        option: Name of a servo; empty for none.
        own: The file's servo; None where it names none.
        findings: Receives what was assumed.

    Returns:
        The servo; None where it is not known.

    Raises:
        InvalidInput: There is no servo of this name.
        InvalidRobot: The file's numbers are no servo's.
    """
    if option:
        with located("option --servo-model"):
            return load_servo(option)
    if own is not None:
        return own
    joints = [joint for chain in chains for joint in chain.joints]
    efforts = [j.effort for j in joints if j.effort and math.isfinite(j.effort)]
    speeds = [j.velocity for j in joints if j.velocity and math.isfinite(j.velocity)]
    if not efforts:
        return None
    like = load_servo(LIKE)
    for what, unit, values in (("efforts", "N·m", efforts), ("speeds", "rad/s", speeds)):
        if values and max(values) > min(values):
            findings.note(
                "servo",
                f"{what} differ, {plain_number(min(values))} to {plain_number(max(values))} "
                f"{unit}; every joint was given the least.",
            )
    torque, speed = min(efforts), min(speeds, default=like.no_load_speed)
    # A stronger servo is stiffer, heavier and has more friction.
    scale = torque / like.stall_torque
    stiffness = scale * like.stiffness
    assumed = [f"stiffness {plain_number(stiffness, 3)} N·m/rad"]
    if not speeds:
        assumed.append(f"no-load speed {plain_number(speed)} rad/s")
    numbers = {}
    for name in ("friction", "damping", "armature"):
        numbers[name] = max(getattr(joint, name) for joint in joints)
        if not numbers[name]:
            numbers[name] = scale * getattr(like, name)
            assumed.append(name)
    findings.note(
        "servo",
        f"the file gives {plain_number(torque)} N·m"
        + (f" and {plain_number(speed)} rad/s" if speeds else "")
        + f"; assumed from the {LIKE}'s: {', '.join(assumed)}.",
        hint=DATA_SHEET,
    )
    # Friction and damping of a file are those of its joint.
    return Servo(
        "as in the file",
        stall_torque=torque,
        no_load_speed=speed,
        stiffness=stiffness,
        viscous_friction=numbers["damping"],
        **numbers,
    )
