"""How a robot walks on with the legs that are left."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.control.command import Command
from phasmid.errors import InvalidGait
from phasmid.gait import Gait, load_gait, without_legs
from phasmid.kinematics import centre_of_mass, joint_angles, neutral_feet
from phasmid.robot import Robot

SHIFTS = (0.16, 0.12, 0.08, 0.04)
"""Farthest shifts of the body that are tried, in mean distances of the feet from their middle."""

SWINGS = (0.5, 0.7, 1.0)
"""Times of a swing that are tried [s]."""

DIRECTIONS = ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0))
"""Ways in which the robot shall be able to walk: ahead, back, to the left and to the right."""

Fastest = Callable[..., Any]
"""A walking controller's ``largest_velocity``."""


@dataclass(frozen=True, slots=True)
class Limping:
    """How the legs that are left are used.

    Attributes:
        gait: Of all legs; the phases of lost ones mean nothing.
        shift: How far the body stands aside, beside what the controller does by itself: ahead, to
            the left [m].
        period: Of a cycle [s]; None: as the controller is set.
    """

    gait: Gait
    shift: tuple[float, float]
    period: float | None

    def follow(self, command: Command) -> Command:
        """The command, as it is followed with these legs."""
        x, y, z, roll, pitch, yaw = command.pose
        pose = (x + self.shift[0], y + self.shift[1], z, roll, pitch, yaw)
        return replace(command, gait=self.gait, period=self.period, pose=pose)


def limping(
    robot: Robot,
    asked: str | Gait,
    lost: frozenset[int],
    held: Mapping[int, Float[np.ndarray, "3"]],
    fastest: Fastest | None = None,
) -> Limping:
    """How to walk on without some legs.

    A body that stands farther aside is held better by the feet that are left, but their legs are
    bent more and reach less far: of several shifts and times the one is taken with which the robot
    walks fastest, the mean over four directions.

    Args:
        robot: The robot, L legs.
        asked: The gait in which it walks on all legs, or its name.
        lost: Numbers of the lost legs.
        held: Joint angles of lost legs, by index [rad], each of shape (3,).
        fastest: Tells the largest velocity of a controller; None: nobody knows.

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
    feet = neutral_feet(robot)
    size = float(np.linalg.norm((feet - feet.mean(axis=0))[:, :2], axis=1).mean())
    best, refused = None, None
    quickest = -1.0
    for share in SHIFTS:
        try:
            limp = without_legs(whole, sorted(lost), feet, com, farthest=share * size)
        except InvalidGait as error:
            refused = refused or error
            continue
        # Lost legs lift with another one, so that the gait is one of enough feet.
        offsets = [limp.gait.offsets[0]] * legs
        for leg, offset in zip(limp.indices, limp.gait.offsets, strict=True):
            offsets[int(leg)] = offset
        gait = replace(limp.gait, offsets=tuple(offsets))
        if fastest is None:
            return Limping(gait, limp.shift, None)
        # A controller that knows lost legs stands aside for them by itself.
        own = without_legs(gait, sorted(lost), feet, com).shift
        aside = (limp.shift[0] - own[0], limp.shift[1] - own[1])
        for swing in SWINGS:
            period = swing / gait.swing_fraction
            speeds = [
                float(np.abs(fastest(way, **_ways(gait, aside, period, lost)).velocity).max())
                for way in DIRECTIONS
            ]
            if np.mean(speeds) > quickest:
                quickest = float(np.mean(speeds))
                best = Limping(gait, aside, period)
    if best is None:
        assert refused is not None
        raise refused
    return best


def _ways(
    gait: Gait, shift: tuple[float, float], period: float, lost: frozenset[int]
) -> dict[str, Any]:
    pose = (*shift, 0.0, 0.0, 0.0, 0.0)
    return {"gait": gait, "period": period, "pose": pose, "lost_legs": lost}
