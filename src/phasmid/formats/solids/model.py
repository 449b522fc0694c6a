"""The parametric model: a robot's numbers in, an assembly of solids out."""

from __future__ import annotations

import numpy as np

from phasmid import kinematics
from phasmid.formats.solids.assembly import Assembly
from phasmid.formats.solids.legs import leg_parts, room
from phasmid.formats.solids.servo_case import case_of
from phasmid.formats.solids.trunk import trunk_parts
from phasmid.robot import JOINTS, Robot


def build(robot: Robot) -> Assembly:
    """Return the solids of a robot, standing on its neutral feet.

    Args:
        robot: Any number of legs, at any place and tilt, of any lengths.

    Raises:
        PhasmidError: build123d is not installed.
    """
    case = case_of(robot.servo, min(room(leg) for leg in robot.legs))
    links = {"body": trunk_parts(robot, case)}
    poses = {"body": np.eye(4)}
    for leg in robot.legs:
        parts = leg_parts(leg, case)
        q = kinematics.joint_angles(leg, leg.neutral_foot)
        frames = leg.X_body_hip @ kinematics.leg_frames(leg, q)
        for number, joint in enumerate(JOINTS):
            links[f"{leg.name}.{joint}"] = parts[joint]
            poses[f"{leg.name}.{joint}"] = frames[number]
    return Assembly(robot.name, links, poses)
