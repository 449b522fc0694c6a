"""A robot in numbers, as people and programs read them."""

from __future__ import annotations

from typing import Any

import numpy as np

from phasmid.errors import PhasmidError
from phasmid.formats.findings import Severity
from phasmid.formats.imported import Imported
from phasmid.kinematics import joint_angles, longest_stride
from phasmid.robot import JOINTS, Leg, Robot
from phasmid.units import STANDARD_GRAVITY


def describe(imported: Imported) -> dict[str, Any]:
    """What was understood of a robot and what was found, in plain values for JSON.

    Keys carry their units. ``possible`` is whether it can walk as it is; ``robot`` is None where
    there is none, and ``why_not`` says why.

    Args:
        imported: As `import_robot` gives it.
    """
    robot = imported.robot
    described = _robot(robot) if robot is not None else None
    strides = described["longest_stride_mm"] if described else {}
    stands = strides.get("ahead", 0.0) > 0
    impossible = any(f.severity is Severity.IMPOSSIBLE for f in imported.findings)
    why_not = "" if imported.error is None else imported.error.what
    if described and not stands:
        why_not = "the neutral feet cannot be reached within the joint limits."
    return {
        "possible": robot is not None and stands and not impossible,
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


def _robot(robot: Robot) -> dict[str, Any]:
    body, servo = robot.body, robot.servo
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
        "servo": {
            "name": servo.name,
            "stall_torque_nm": servo.stall_torque,
            "no_load_speed_rad_per_s": servo.no_load_speed,
        },
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
        "hip_mm": _mm(leg.mount_position),
        "yaw_deg": float(np.degrees(leg.mount_yaw)),
        "pitch_deg": float(np.degrees(leg.mount_pitch)),
        "roll_deg": float(np.degrees(leg.mount_roll)),
        "neutral_foot_mm": _mm(leg.neutral_foot),
        "neutral_deg": neutral,
        "limits_deg": dict(zip(JOINTS, np.degrees(leg.joint_limits).tolist(), strict=True)),
        "masses_g": [1000 * link.mass for link in leg.links],
    }


def _mm(values: np.ndarray) -> list[float]:
    return [float(1000 * value) for value in values]
