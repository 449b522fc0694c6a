"""Chains of hinges as named legs, in the robot's order, with our joint angles and their limits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.formats.chains import Chain
from phasmid.formats.extension import Extension, LegExtension
from phasmid.formats.findings import Finding, Severity
from phasmid.formats.foot import Foot
from phasmid.formats.mounts import hip_rotation, names_in_order
from phasmid.formats.planar import Planar, planar
from phasmid.formats.standing import UPRIGHT


@dataclass(frozen=True, eq=False)
class FoundLeg:
    """A leg on its way to the robot.

    Attributes:
        name: Of the leg.
        chain: Its three hinges.
        said: Its table in an extension; None without one.
        plan: Its frames and lengths.
        foot: Where the foot comes from, in words.
        limits: Lowest and highest joint angles of ours [rad], shape (3, 2).
    """

    name: str
    chain: Chain
    said: LegExtension | None
    plan: Planar
    foot: str
    limits: Float[np.ndarray, "3 2"]


def named_chains(
    chains: Sequence[Chain], extension: Extension | None, findings: list[Finding]
) -> list[tuple[str, Chain, LegExtension | None]]:
    """Return legs in the robot's order, with names and extensions."""
    if extension is not None:
        by_joint = {chain.joints[0].name: chain for chain in chains}
        said = {leg.joint: (name, leg) for name, leg in extension.legs.items()}
        if set(said) == set(by_joint) and len(said) == len(extension.legs):
            return [(name, by_joint[joint], leg) for joint, (name, leg) in said.items()]
        findings.append(
            Finding(
                Severity.SUSPECT,
                "phasmid extension",
                f"speaks of legs at joints {', '.join(list(said)[:6])}, and the file's legs are "
                f"at {', '.join(list(by_joint)[:6])}; what it says of legs was ignored.",
                hint="export the file anew",
            )
        )
    hips = np.array([chain.hip for chain in chains])
    return [(name, chains[i], None) for name, i in names_in_order(hips)]


def found_leg(
    number: int,
    name: str,
    chain: Chain,
    said: LegExtension | None,
    tip: Foot,
    findings: list[Finding],
) -> FoundLeg:
    """Find a chain's frames, angles and limits.

    Args:
        number: Of the leg in the robot, for messages.
        name: Of the leg.
        chain: Its three hinges.
        said: Its table in an extension; None without one.
        tip: Its foot.
        findings: Receives roundings and assumptions.

    Raises:
        InvalidRobot: It is no leg of this model.
    """
    X = chain.poses[2]
    foot = X[:3, :3] @ tip.point + X[:3, 3]
    # Files of this project have the hip's x at angle 0.
    zero = 0.0 if said is not None else _middle(chain)
    axis = chain.axes[0]
    if said is not None:
        up = hip_rotation((said.yaw, said.pitch, said.roll))[:, 2]
        plan = planar(chain, foot, number, up, zero)
    elif abs(axis[2]) >= UPRIGHT:
        plan = planar(chain, foot, number, np.array([0.0, 0.0, 1.0]), zero)
    else:
        # A lying coxa axis has no upper end; knees decide, which here bend one way.
        plan = planar(chain, foot, number, axis, zero)
        if float(np.mean(_limits(chain, plan)[2])) > 0:
            plan = planar(chain, foot, number, -axis, zero)
    findings += plan.findings
    return FoundLeg(name, chain, said, plan, tip.source, _limits(chain, plan))


def _middle(chain: Chain) -> float:
    """Return the coxa's angle in the file at which its leg points along the hip's x."""
    coxa = chain.joints[0]
    if coxa.kind == "continuous" or coxa.lower < 0 < coxa.upper:
        return 0.0
    middle = (coxa.lower + coxa.upper) / 2
    return middle if math.isfinite(middle) else 0.0


def _limits(chain: Chain, plan: Planar) -> Float[np.ndarray, "3 2"]:
    """Convert limits to our angles.

    A range of more than a turn is one turn; a range without an end ends there at half a turn.
    """
    limits = np.empty((3, 2))
    for row, joint, sign, offset in zip(
        limits, chain.joints, plan.signs, plan.offsets, strict=True
    ):
        ends = sorted((sign * joint.lower + offset, sign * joint.upper + offset))
        bounded = [math.isfinite(end) for end in ends]
        if joint.kind != "continuous" and bounded[0] != bounded[1]:
            end = math.remainder(ends[bounded.index(True)], 2 * math.pi)
            row[:] = (end, math.pi) if bounded[0] else (-math.pi, end)
            if row[0] < row[1]:
                continue
        if joint.kind == "continuous" or not ends[1] - ends[0] < 2 * math.pi:
            row[:] = -math.pi, math.pi
            continue
        # Angles are taken in (-pi, pi]; a range about another turn's angle is moved there.
        turns = round((ends[0] + ends[1]) / 2 / (2 * math.pi))
        row[:] = [end - 2 * math.pi * turns for end in ends]
    return limits
