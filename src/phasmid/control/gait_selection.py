"""Gait selection: writes the gait of a command into a reference, with all legs or without some."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Bool, Float

from phasmid.control.settings import EngineSettings
from phasmid.control.types import Model, Reference
from phasmid.errors import InvalidInput
from phasmid.gait import Gait, Limp, default_gait, load_gait, without_legs
from phasmid.kinematics import centre_of_mass, joint_angles, neutral_feet
from phasmid.robot import Robot

SWAYING_SWING, SWING_TIME = 2 / 3, 0.5
"""Duration of a swing with the default period: of gaits that sway, and of others [s]."""

TURN, NEARER = math.radians(22), 0.8
"""Neutral feet of legs that cannot walk without sway: angle by which a leg turns towards a lost
neighbour, at most half of the way to its limit [rad]; distance from the hip, as a share."""


class GaitSelector:
    """The gait of an engine, and those of commands.

    Args:
        robot: The robot, L legs.
        settings: Gait and period of the engine.
        model: The robot's numbers, with the joint angles of lost legs.

    Attributes:
        gait: Gait of the engine.

    Raises:
        InvalidInput: There is no such gait for the robot.
        InvalidGait: The gait does not fit the robot.
    """

    def __init__(self, robot: Robot, settings: EngineSettings, model: Model) -> None:
        self._robot, self._model, self._period = robot, model, settings.period
        self._nominal = neutral_feet(robot)
        self._home = joint_angles(robot.arrays, np.array(robot.arrays.neutral_foot))
        self.gait = self._find(settings.gait)

    def write(
        self,
        reference: Reference,
        gait: str | Gait | None,
        period: float | None,
        lost: frozenset[int],
    ) -> tuple[Float[np.ndarray, "2"], Float[np.ndarray, "legs 3"]]:
        """Write a gait; return its shift of the body [m], shape (2,), and neutral feet, (L, 3).

        Args:
            reference: Its gait, phases and used legs are written.
            gait: Name of a gait, or the gait; None for the engine's.
            period: Duration of a cycle [s]; None for the engine's.
            lost: Numbers of legs that are not used.

        Raises:
            InvalidInput: There is no such gait.
            InvalidGait: The gait does not fit the robot, or too few legs are left.
        """
        found = self.gait if gait is None else self._find(gait)
        period = self._period if period is None else period
        if period is None:
            period = (SWAYING_SWING if found.sway else SWING_TIME) / found.swing_fraction
        shift, nominal, offsets = np.zeros(2), self._nominal, np.array(found.offsets)
        used = np.ones(len(offsets), dtype=np.int64)
        if lost:
            limp = self._without(found, lost, nominal)
            if limp.gait.sway:
                nominal = self._feet_without(lost)
                limp = self._without(found, lost, nominal)
            # Swings take as long as with all legs.
            period *= found.swing_fraction / limp.gait.swing_fraction
            found, shift = limp.gait, np.array(limp.shift)
            used[:] = 0
            used[limp.indices] = 1
            offsets[limp.indices] = found.offsets
        reference.lift_phase[:], reference.used[:], reference.walks = offsets, used, 1
        reference.duty_factor, reference.period = found.duty_factor, period
        reference.sway = found.sway
        return shift, nominal

    def write_stance(self, reference: Reference, present: Reference, lost: frozenset[int]) -> None:
        """Write that the remaining legs stand and do not step.

        Args:
            reference: Its gait, used legs and `walks` are written.
            present: The present reference, whose times stay.
            lost: Numbers of legs that are not used.
        """
        reference.lift_phase[:] = present.lift_phase
        reference.duty_factor, reference.period = present.duty_factor, present.period
        reference.sway, reference.walks = 0.0, 0
        reference.used[:] = ~_is_lost(lost, len(reference.used))

    def _find(self, gait: str | Gait | None) -> Gait:
        legs = len(self._robot.legs)
        if gait is None:
            return default_gait(legs)
        if isinstance(gait, str):
            return load_gait(gait, legs)
        if len(gait.offsets) != legs:
            raise InvalidInput(
                f"gait {gait.name} has {len(gait.offsets)} offsets; the robot has {legs} legs."
            )
        return gait

    def _feet_without(self, lost: frozenset[int]) -> Float[np.ndarray, "legs 3"]:
        """Return neutral feet in the body frame without lost legs [m]: nearer to the gaps."""
        feet, hips, count = self._nominal.copy(), self._model.p_body_hip, len(self._nominal)
        limits = np.array(self._robot.arrays.joint_limits)[:, 0]
        around = np.arctan2(feet[:, 1], feet[:, 0]).argsort()
        for place, leg in enumerate(around):
            # Gaps to the left, counter-clockwise, less those to the right.
            left, right = (around[(place + side) % count] + 1 in lost for side in (1, -1))
            turn = (int(left) - int(right)) * TURN
            low, high = (limits[leg] - self._home[leg, 0]) / 2
            turn = min(max(turn, low), high)
            x, y = NEARER * (feet[leg, :2] - hips[leg, :2])
            c, s = math.cos(turn), math.sin(turn)
            feet[leg, :2] = hips[leg, :2] + (c * x - s * y, s * x + c * y)
        return feet

    def _without(
        self, gait: Gait, lost: frozenset[int], nominal: Float[np.ndarray, "legs 3"]
    ) -> Limp:
        held = _is_lost(lost, len(nominal))[:, None]
        com = centre_of_mass(self._robot, np.where(held, self._model.folded, self._home))
        # The nearest shift: legs under a body farther from its neutral place have less reach.
        return without_legs(gait, lost, nominal, com[:2], nearest=True)


def _is_lost(lost: frozenset[int], count: int) -> Bool[np.ndarray, " legs"]:
    """Return which of the legs are lost, shape (L,)."""
    return np.isin(np.arange(1, count + 1), list(lost))
