"""The servo of a tree's joints."""

from __future__ import annotations

import math
from collections.abc import Sequence

from phasmid.errors import located
from phasmid.formats.chains import Chain
from phasmid.formats.findings import Finding, Severity
from phasmid.robot import Servo, load_servo
from phasmid.units import plain_number

LIKE = "AX-12A"
"""Hobby servo whose stiffness, rotor and friction stand in for what a file leaves out, and its
speed where a format, such as MJCF, has no word for it."""


def servo_of(
    chains: Sequence[Chain], option: str, said: Servo | None, findings: list[Finding]
) -> tuple[Servo | None, str]:
    """The servo of every joint: a named one, the file's own, or one of the file's numbers.

    Args:
        chains: The legs.
        option: Name of a servo; empty for none.
        said: The file's own; None where it has none.
        findings: Receives assumptions.

    Returns:
        The servo, None where it is unknown; and its origin, in words.

    Raises:
        InvalidInput: There is no servo of this name.
        InvalidRobot: The file's numbers are no servo's.
    """
    if option:
        with located("option --servo-model"):
            return load_servo(option), "option --servo-model"
    if said is not None:
        return said, "the file"
    joints = [joint for chain in chains for joint in chain.joints]
    efforts = [j.effort for j in joints if j.effort and math.isfinite(j.effort)]
    speeds = [j.velocity for j in joints if j.velocity and math.isfinite(j.velocity)]
    if not efforts:
        return None, ""
    like = load_servo(LIKE)
    torque, speed = min(efforts), min(speeds, default=like.no_load_speed)
    for what, unit, values in (("efforts", "N·m", efforts), ("speeds", "rad/s", speeds)):
        if values and max(values) > min(values):
            findings.append(
                Finding(
                    Severity.NOTE,
                    "servo",
                    f"{what} differ, {plain_number(min(values))} to {plain_number(max(values))} "
                    f"{unit}; every joint was given the least.",
                )
            )
    given = {
        "friction": max(joint.friction for joint in joints),
        "damping": max(joint.damping for joint in joints),
        "armature": max(joint.armature for joint in joints),
    }
    # A stronger servo is stiffer, heavier and has more friction.
    scale = torque / like.stall_torque
    stiffness = scale * like.stiffness
    assumed = [f"stiffness ({plain_number(stiffness, 3)} N·m/rad)"]
    assumed += [name for name, value in given.items() if not value]
    if not speeds:
        findings.append(
            Finding(
                Severity.NOTE,
                "servo",
                f"the file gives efforts and no speeds; {plain_number(speed)} rad/s, the {LIKE}'s "
                f"no-load speed, was assumed.",
                hint="--servo-model AX-12A, to take all from a data sheet",
            )
        )
    own = (
        f"{plain_number(torque)} N·m and {plain_number(speed)} rad/s are"
        if speeds
        else f"{plain_number(torque)} N·m is"
    )
    findings.append(
        Finding(
            Severity.NOTE,
            "servo",
            f"{own} the file's; in proportion to the {LIKE}'s were assumed: {', '.join(assumed)}.",
            hint="--servo-model AX-12A, to take all from a data sheet",
        )
    )
    numbers = {name: value or scale * getattr(like, name) for name, value in given.items()}
    # Friction and damping of a file are those of its joint, which a servo's ideal form has once.
    servo = Servo(
        "as in the file",
        stall_torque=torque,
        no_load_speed=speed,
        stiffness=stiffness,
        damping=numbers["damping"],
        viscous_friction=numbers["damping"],
        armature=numbers["armature"],
        friction=numbers["friction"],
    )
    return servo, "efforts and speeds of the file" if speeds else "efforts of the file"


def missing(chains: Sequence[Chain]) -> str:
    """Name the data that the joints of a file without a servo lack."""
    speeds = any(j.velocity for chain in chains for j in chain.joints)
    return "no effort" if speeds else "no effort and speed"
