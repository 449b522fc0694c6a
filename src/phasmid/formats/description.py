"""Description of a robot in numbers."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from phasmid.errors import PhasmidError
from phasmid.formats.importing import Imported
from phasmid.formats.legs import FoundLeg
from phasmid.kinematics import joint_angles, longest_stride
from phasmid.robot import JOINTS, Leg, Robot
from phasmid.units import STANDARD_GRAVITY


def describe(imported: Imported) -> dict[str, Any]:
    """Describe an imported robot and its findings in plain values for JSON.

    Keys carry their units. ``possible``: the robot can walk as it is; ``robot``: its numbers, None
    where there is no robot; ``findings``: as `Finding`.

    Args:
        imported: As `import_robot` gives it.
    """
    described = None
    if imported.robot is not None:
        described = _robot(imported.robot)
        for leg, found in zip(described["legs"], imported.legs, strict=False):
            leg["file"] = _origin(found)
    return {
        "possible": imported.robot is not None and not imported.impossible,
        "robot": described,
        "findings": [
            {**asdict(finding), "severity": finding.severity.value} for finding in imported.findings
        ],
    }


def _origin(leg: FoundLeg) -> dict[str, Any]:
    """Describe the joints of the file that became a leg, and the zeros of their angles."""
    return {
        "joints": list(leg.joints),
        "links": [list(link.poses) for link in leg.chain.links],
        "foot": leg.foot,
        "signs": [int(sign) for sign in leg.signs],
        "offsets_deg": np.degrees(leg.offsets).tolist(),
    }


def _robot(robot: Robot) -> dict[str, Any]:
    body, look = robot.body, robot.appearance
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
            "name": robot.servo.name,
            "stall_torque_nm": robot.servo.stall_torque,
            "no_load_speed_rad_per_s": robot.servo.no_load_speed,
        },
        "body": {"mass_g": 1000 * body.mass, "size_mm": _mm(body.size), "com_mm": _mm(body.com)},
        "legs": [_leg(leg) for leg in robot.legs],
        "longest_stride_mm": {"ahead": 1000 * ahead, "sideways": 1000 * side},
        "meshes": sum(map(len, look.parts.values())) if look else 0,
    }


def _leg(leg: Leg) -> dict[str, Any]:
    try:
        neutral = np.degrees(joint_angles(leg, leg.neutral_foot)).tolist()
    except PhasmidError:
        neutral = None
    angles = {"yaw": leg.mount_yaw, "pitch": leg.mount_pitch, "roll": leg.mount_roll}
    return {
        "name": leg.name,
        "lengths_mm": _mm(leg.lengths),
        "lateral_offsets_mm": _mm(leg.lateral_offsets),
        "hip_mm": _mm(leg.mount_position),
        **{f"{name}_deg": float(np.degrees(angle)) for name, angle in angles.items()},
        "neutral_foot_mm": _mm(leg.neutral_foot),
        "neutral_deg": neutral,
        "limits_deg": dict(zip(JOINTS, np.degrees(leg.joint_limits).tolist(), strict=True)),
        "masses_g": [1000 * link.mass for link in leg.links],
    }


def _mm(values: np.ndarray) -> list[float]:
    return [float(1000 * value) for value in values]
