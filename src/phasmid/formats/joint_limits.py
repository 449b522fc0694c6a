"""Limits of a file's joints: its stops, or what is assumed where it has none."""

from __future__ import annotations

import math
from dataclasses import replace

from phasmid.formats.findings import Findings
from phasmid.formats.tree import TreeJoint
from phasmid.units import plain_number

TURN = 2 * math.pi
"""A range of this or more stops no angle [rad]."""

DEGREES = 20.0
"""Limits from here on are taken for degrees [rad]: no published leg turns by three turns."""


def with_stops(joint: TreeJoint, assumed: float | None, findings: Findings) -> TreeJoint:
    """Return a hinge with its stops, those of an option, or none.

    A range of a turn or more is that of a motor that turns without end. Such joints, as continuous
    ones and those without limits, have half a turn to either side, or the assumed angle [rad].
    """
    subject, is_continuous = f"joint {joint.name}", joint.kind == "continuous"
    lower, upper = joint.lower, joint.upper
    ends = [abs(end) for end in (lower, upper) if math.isfinite(end)]
    is_likely = True
    words = f"limits {plain_number(lower)} to {plain_number(upper)} rad"
    if is_continuous:
        why = "it is continuous"
    elif lower == upper and not (lower == 0 and assumed is not None):
        what = f"{words} let it not move."
        findings.impossible(subject, what, joint.where, "--joint-limit-deg 90, or its stops")
        return replace(joint, lower=-math.inf, upper=math.inf)
    elif lower == upper == 0:
        why = f"{words} let it not move"
    elif lower >= upper:
        what = f"{words}; the upper must be larger."
        findings.impossible(subject, what, joint.where, "swap them in the file")
        return replace(joint, lower=-math.inf, upper=math.inf)
    elif max(ends, default=0.0) >= DEGREES:
        why, is_likely = f"{words} are {plain_number(max(ends) / TURN, 2)} turns", False
    elif not ends:
        why = "no limits in the file"
    elif upper - lower >= TURN and len(ends) == 2:
        why = f"{words} are a turn or more and no stops"
    else:
        if len(ends) == 1:
            half = math.pi if assumed is None else assumed
            what = f"{words}; ±{plain_number(math.degrees(half))}° was assumed at the other end."
            findings.note(subject, what, joint.where)
            if assumed is not None:
                lower, upper = max(lower, -assumed), min(upper, assumed)
        return replace(joint, lower=lower, upper=upper)
    half = math.pi if assumed is None else assumed
    what = f"{why}; ±{plain_number(math.degrees(half))}° was assumed."
    if not is_likely:
        radians = " to ".join(plain_number(math.radians(end)) for end in (lower, upper))
        findings.suspect(subject, what, joint.where, f"{radians} in the file, if these are degrees")
    else:
        hint = "--joint-limit-deg 90, for servos that turn by ±90°" if assumed is None else ""
        findings.note(subject, what, joint.where, hint)
    if assumed is None:
        return replace(joint, lower=-math.inf, upper=math.inf)
    return replace(joint, kind="revolute", lower=-assumed, upper=assumed)
