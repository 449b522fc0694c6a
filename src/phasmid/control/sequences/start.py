"""Whether a robot stands or lies at its start, from joint angles, foot contacts and tilt."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.control.sequences.ground import (
    GroundPlane,
    knees_and_feet,
    resting_ground,
    up_direction,
)
from phasmid.experiment.observation import Observation
from phasmid.kinematics import neutral_feet
from phasmid.robot import Robot

SAG = 0.05
"""Largest deviation of feet that stand at neutral under load, as a share of the length of femur and
tibia."""

STEEPEST_STANCE, LEVEL, STEEPEST_GROUND = np.cos(np.radians([20, 10, 50]))
"""Least cosines for a robot on its feet: of the ground's normal to the body's z axis; to the
measured vertical where one reading without contact sensors suffices, and at all. Terrain rises by
45° at most, and legs give way by some degrees."""

CONFIRMED, DECIDED = 0.1, 0.5
"""Time for which doubtful readings must agree that the robot stands, and after which it lies [s]:
twenty and a hundred updates; a foot that chatters touches within one of the former."""


class Reading(NamedTuple):
    """What one observation tells of a start.

    Attributes:
        stands: Joint angles, contacts and tilt are those of a robot on its feet.
        lies: Joint angles and contacts are those of a robot on its trunk.
        is_level: The ground is nearly level.
    """

    stands: bool
    lies: bool
    is_level: bool


class StartJudge:
    """Tells from one observation after the other whether a robot stands at its start.

    A clear first observation decides. Contacts of all observations count, since feet that slide
    touch now and then; the other readings must agree for a time.

    Args:
        robot: The robot, L legs.
        q: Joint angles at the start [rad], shape (L, 3).
        time: Of the start [s].

    Attributes:
        at_home: Whether the feet are at their neutral places, but for what the legs give way.
        ground: Ground under the robot by its joint angles and the last tilt.
    """

    def __init__(self, robot: Robot, q: Float[np.ndarray, "legs 3"], time: float) -> None:
        self._robot, self._q = robot, q
        self._begin = self._doubtful = time
        self._touched = np.zeros(len(robot.legs), dtype=bool)
        feet = knees_and_feet(robot, q)[1] - neutral_feet(robot)
        self.at_home = bool(
            np.abs(feet).max() < SAG * robot.arrays.lengths[:, 1:].sum(axis=1).min()
        )
        self.ground: GroundPlane = resting_ground(robot, q)
        self._may_stand = self._has_feet_below(self.ground)

    def add(self, observation: Observation) -> bool | None:
        """Return whether the robot stands; None while that is doubtful."""
        reading, time = self._read(observation), observation.time
        sure = observation.contact is not None or reading.is_level
        if reading.stands and (sure or time - self._doubtful >= CONFIRMED):
            return True
        if reading.lies or time - self._begin >= DECIDED:
            return False
        if not reading.stands:
            self._doubtful = time
        return None

    def _read(self, observation: Observation) -> Reading:
        up, contact = up_direction(observation.orientation), observation.contact
        self.ground = resting_ground(self._robot, self._q, up)
        if contact is not None:
            self._touched |= contact
        has_feet_below = self._has_feet_below(self.ground)
        # On uneven ground a stance may balance on two feet.
        touches = self._touched.sum() >= (1 if self.at_home else 3)
        upright = 1.0 if up is None else float(self.ground.normal @ up)
        return Reading(
            has_feet_below and (contact is None or touches) and upright >= STEEPEST_GROUND,
            not (has_feet_below or self._may_stand or touches),
            upright >= LEVEL,
        )

    def _has_feet_below(self, ground: GroundPlane) -> bool:
        """Return whether joint angles are those of a robot on its feet."""
        is_raised = not ground.belly_contact and ground.contact.sum() >= 3
        return self.at_home or bool(is_raised and ground.normal[2] >= STEEPEST_STANCE)
