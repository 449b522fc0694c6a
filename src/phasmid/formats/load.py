"""Whether a robot's servos can hold it up."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.formats.findings import Finding, Severity
from phasmid.kinematics import jacobian, joint_angles
from phasmid.robot import JOINTS, Servo
from phasmid.units import STANDARD_GRAVITY

STEADY = 0.2
"""Part of its stall torque that the maker of the AX-12A advises as the most for long."""

STRONGEST = 10.0
"""Torque, in weights of the robot at a leg's length, above which an effort is a placeholder:
the strongest walking machines have 1, the PhantomX 0.2."""

FASTEST = 50.0
"""No-load speed above which a number is a placeholder [rad/s]: hobby servos reach 13, the motors
of running quadrupeds 40."""


@dataclass(frozen=True, eq=False)
class Standing:
    """Legs that stand; a robot's ``arrays`` will do as well.

    Attributes:
        lengths: Of coxa, femur and tibia [m], shape (L, 3).
        R_body_hip: Rotations of the hip frames, shape (L, 3, 3).
        neutral_foot: In the hip frames [m], shape (L, 3).
    """

    lengths: Float[np.ndarray, "legs 3"]
    R_body_hip: Float[np.ndarray, "legs 3 3"]
    neutral_foot: Float[np.ndarray, "legs 3"]


def judge_load(
    names: Sequence[str], legs: Standing, mass: float, servo: Servo
) -> tuple[Finding, ...]:
    """Compare what standing asks of the servos with what they give.

    The weight is shared alike by the feet that stand; links' own weights above their joints
    are left out, which makes the torques somewhat too small.

    Args:
        names: Of the legs.
        legs: Lengths, tilts and neutral feet of the legs.
        mass: Of the whole robot [kg].
        servo: Of every joint.

    Source: Eq. 11 at rest, τ = −Jᵀ F.
    """
    found: list[Finding] = []
    count, weight = len(names), mass * STANDARD_GRAVITY
    torques = standing_torques(legs, weight / count)
    most = float(torques.max())
    # Of legs that bear alike, the first.
    leg, joint = np.argwhere(torques >= most * (1 - 1e-9))[0]
    stands = math.ceil(count / 2)
    alternate = most * count / stands
    place = f"{names[int(leg)]}.{JOINTS[int(joint)]}"
    stall = servo.stall_torque
    needs = f"{weight:.3g} N on all {count} feet ask {most:.3g} N·m of joint {place}"
    if most > stall:
        what = f"{needs}; servo {servo.name} stalls at {stall:.3g} N·m."
        found.append(Finding(Severity.IMPOSSIBLE, "servos", what, hint=_STRONGER))
    elif alternate > stall:
        what = (
            f"{weight:.3g} N on {stands} of {count} feet ask {alternate:.3g} N·m of joint {place}; "
            f"servo {servo.name} stalls at {stall:.3g} N·m, so no half of the legs holds it."
        )
        found.append(Finding(Severity.SUSPECT, "servos", what, hint=_STRONGER))
    elif most > STEADY * stall:
        what = (
            f"{needs}, {100 * most / stall:.0f} % of stall; makers advise at most "
            f"{100 * STEADY:.0f} % for long."
        )
        found.append(Finding(Severity.NOTE, "servos", what))
    length = float(legs.lengths.sum(axis=1).max())
    times = stall / (weight * length)
    if times > STRONGEST:
        what = (
            f"effort {stall:.4g} N·m would lift {times:.0f} such robots at a leg's length; "
            "it is hardly a servo's."
        )
        found.append(Finding(Severity.SUSPECT, "servos", what, hint=_NAMED))
    if servo.no_load_speed > FASTEST:
        what = (
            f"speed {servo.no_load_speed:.4g} rad/s is hardly a servo's; it should be at most "
            f"{FASTEST:g} rad/s."
        )
        found.append(Finding(Severity.SUSPECT, "servos", what, hint=_NAMED))
    return tuple(found)


_STRONGER = "--servo-model MX-28, a smaller --total-mass-g, or feet nearer to the hips"
_NAMED = "--servo-model AX-12A, to take all from a data sheet"


def standing_torques(legs: Standing, load: float) -> Float[np.ndarray, "legs 3"]:
    """Size of each joint's torque while every neutral foot bears the same load.

    Args:
        legs: The legs, L of them.
        load: Upward force of the ground on each foot [N].

    Returns:
        Torques [N·m], shape (L, 3).
    """
    J = jacobian(legs, joint_angles(legs, legs.neutral_foot))
    up_hip = legs.R_body_hip[:, 2, :]
    return np.asarray(np.abs(load * np.einsum("lij,li->lj", J, up_hip)))
