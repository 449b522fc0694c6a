"""Description of a robot in numbers."""

from __future__ import annotations

from typing import Any

import numpy as np

from phasmid.errors import PhasmidError
from phasmid.formats.findings import Severity
from phasmid.formats.importing import Imported, ImportFacts
from phasmid.formats.legs import FoundLeg
from phasmid.kinematics import joint_angles, longest_stride
from phasmid.robot import JOINTS, Leg, Robot, Servo
from phasmid.units import STANDARD_GRAVITY


def describe(imported: Imported) -> dict[str, Any]:
    """Describe an imported robot and its findings in plain values for JSON.

    Keys carry their units. ``possible``: the robot can walk as it is; ``why_not``: the reason
    why it cannot; ``robot``: its numbers, also of an impossible robot, None without legs.

    Args:
        imported: As `import_robot` gives it.
    """
    robot, facts = imported.robot, imported.facts
    described = None
    if robot is not None:
        described = _robot(robot)
    elif facts is not None:
        described = _describe_facts(facts)
    if described and facts is not None:
        for leg, found in zip(described["legs"], facts.legs, strict=True):
            leg["file"] = _origin(found)
    stands = robot is not None and described and described["longest_stride_mm"]["ahead"] > 0
    impossible = any(f.severity is Severity.IMPOSSIBLE for f in imported.findings)
    why_not = "" if imported.error is None else imported.error.what
    if robot is not None and not stands:
        why_not = "the neutral feet cannot be reached within the joint limits."
    return {
        "possible": bool(stands) and not impossible,
        "why_not": why_not,
        "robot": described,
        "findings": [
            {
                "severity": finding.severity.value,
                "subject": finding.subject,
                "what": finding.what,
                "where": finding.where,
                "hint": finding.hint,
            }
            for finding in imported.findings
        ],
    }


def _describe_facts(facts: ImportFacts) -> dict[str, Any]:
    """Describe a file whose robot is impossible."""
    described = {
        "name": facts.name,
        "mass_g": 1000 * facts.mass,
        "weight_n": facts.mass * STANDARD_GRAVITY,
        "legs": [
            {
                "name": leg.name,
                "lengths_mm": _mm(leg.lengths),
                "hip_mm": _mm(leg.position),
                **_angles(*leg.angles),
                "neutral_foot_mm": None if facts.feet is None else _mm(facts.feet[i]),
                "neutral_deg": None,
                "limits_deg": dict(zip(JOINTS, np.degrees(leg.limits).tolist(), strict=True)),
                "masses_g": [None if np.isnan(m) else 1000 * float(m) for m in facts.masses[i]],
            }
            for i, leg in enumerate(facts.legs)
        ],
    }
    return described if facts.servo is None else described | {"servo": _servo(facts.servo)}


def _origin(leg: FoundLeg) -> dict[str, Any]:
    """Describe the joints of the file that became a leg, and the zeros of their angles."""
    return {
        "joints": list(leg.joints),
        "links": [list(link.poses) for link in leg.chain.links],
        "foot": leg.foot,
        "signs": [int(sign) for sign in leg.signs],
        "offsets_deg": np.degrees(leg.offsets).tolist(),
    }


def _servo(servo: Servo) -> dict[str, Any]:
    return {
        "name": servo.name,
        "stall_torque_nm": servo.stall_torque,
        "no_load_speed_rad_per_s": servo.no_load_speed,
    }


def _angles(yaw: float, pitch: float, roll: float) -> dict[str, float]:
    names = ("yaw_deg", "pitch_deg", "roll_deg")
    return dict(zip(names, np.degrees([yaw, pitch, roll]).tolist(), strict=True))


def _robot(robot: Robot) -> dict[str, Any]:
    body = robot.body
    try:
        ahead, side = longest_stride(robot), longest_stride(robot, np.pi / 2)
    except PhasmidError:
        # A neutral foot out of reach leaves no stride at all.
        ahead = side = 0.0
    return {
        "name": robot.name,
        "description": robot.description,
        "mass_g": 1000 * robot.mass,
        "weight_n": robot.mass * STANDARD_GRAVITY,
        "servo": _servo(robot.servo),
        "body": {"mass_g": 1000 * body.mass, "size_mm": _mm(body.size), "com_mm": _mm(body.com)},
        "legs": [_leg(leg) for leg in robot.legs],
        "longest_stride_mm": {"ahead": 1000 * ahead, "sideways": 1000 * side},
        "meshes": 0 if robot.appearance is None else _count(robot),
    }


def _count(robot: Robot) -> int:
    assert robot.appearance is not None
    return sum(map(len, robot.appearance.parts.values()))


def _leg(leg: Leg) -> dict[str, Any]:
    try:
        neutral = np.degrees(joint_angles(leg, leg.neutral_foot)).tolist()
    except PhasmidError:
        neutral = None
    return {
        "name": leg.name,
        "lengths_mm": _mm(leg.lengths),
        "lateral_offsets_mm": _mm(leg.lateral_offsets),
        "hip_mm": _mm(leg.mount_position),
        **_angles(leg.mount_yaw, leg.mount_pitch, leg.mount_roll),
        "neutral_foot_mm": _mm(leg.neutral_foot),
        "neutral_deg": neutral,
        "limits_deg": dict(zip(JOINTS, np.degrees(leg.joint_limits).tolist(), strict=True)),
        "masses_g": [1000 * link.mass for link in leg.links],
    }


def _mm(values: np.ndarray) -> list[float]:
    return [float(1000 * value) for value in values]
