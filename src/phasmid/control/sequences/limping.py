"""How a robot walks on with the legs that are left."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from phasmid.control.command import Command
from phasmid.gait import Gait, load_gait, without_legs
from phasmid.kinematics import centre_of_mass, joint_angles, neutral_feet
from phasmid.robot import Robot


@dataclass(frozen=True, slots=True)
class Limping:
    """How the legs that are left are used.

    Attributes:
        gait: Of all legs; the phases of lost ones mean nothing.
        shift: How far the body stands aside, beside what the controller does by itself: ahead, to
            the left [m].
    """

    gait: Gait
    shift: tuple[float, float]

    def follow(self, command: Command) -> Command:
        """The command, as it is followed with these legs."""
        x, y, z, roll, pitch, yaw = command.pose
        pose = (x + self.shift[0], y + self.shift[1], z, roll, pitch, yaw)
        # A time that was asked for all legs may leave too little for the swings of fewer.
        return replace(command, gait=self.gait, period=None, pose=pose)


def limping(
    robot: Robot,
    asked: str | Gait,
    lost: frozenset[int],
    held: Mapping[int, Float[np.ndarray, "3"]],
) -> Limping:
    """How to walk on without some legs.

    Args:
        robot: The robot, L legs.
        asked: The gait in which it walks on all legs, or its name.
        lost: Numbers of the lost legs.
        held: Joint angles of lost legs, by index [rad], each of shape (3,).

    Raises:
        InvalidGait: The legs do not hold the robot, whatever the order in which they lift.
    """
    legs = len(robot.legs)
    whole = load_gait(asked, legs) if isinstance(asked, str) else asked
    arrays = robot.arrays
    q = joint_angles(arrays, arrays.neutral_foot)
    for leg, angles in held.items():
        q[leg] = angles
    com = centre_of_mass(robot, q)[:2]
    limp = without_legs(whole, sorted(lost), neutral_feet(robot), com)
    # Lost legs lift with another one, so that the gait is one of enough feet.
    offsets = [limp.gait.offsets[0]] * legs
    for leg, offset in zip(limp.indices, limp.gait.offsets, strict=True):
        offsets[int(leg)] = offset
    return Limping(replace(limp.gait, offsets=tuple(offsets)), limp.shift)
