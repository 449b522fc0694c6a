"""Gait selection: writes the gait of a command into a reference, with all legs or without some."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.control.settings import EngineSettings
from phasmid.control.types import Model, Reference
from phasmid.errors import InvalidInput
from phasmid.gait import Gait, Limp, gaits_of, load_gait, without_legs
from phasmid.kinematics import centre_of_mass, joint_angles
from phasmid.robot import Robot

SWAYING_SWING, SWING_TIME = 2 / 3, 0.5
"""Duration of a swing with the default period: of gaits that sway, and of others [s]."""


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
        self._home = joint_angles(robot.arrays, np.array(robot.arrays.neutral_foot))
        self.gait = self._find(settings.gait)

    def write(
        self,
        reference: Reference,
        gait: str | Gait | None,
        period: float | None,
        lost: frozenset[int],
    ) -> Float[np.ndarray, "2"]:
        """Write a gait, and return the shift of the body that it needs [m], shape (2,).

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
        shift, offsets = np.zeros(2), np.array(found.offsets)
        used = np.ones(len(offsets), dtype=np.int64)
        if lost:
            limp = self._without(found, lost)
            # Swings take as long as with all legs.
            period *= found.swing_fraction / limp.gait.swing_fraction
            found, shift = limp.gait, np.array(limp.shift)
            used[:] = 0
            used[limp.indices] = 1
            offsets[limp.indices] = found.offsets
        reference.lift_phase[:], reference.used[:] = offsets, used
        reference.duty_factor, reference.period = found.duty_factor, period
        reference.sway = found.sway
        return shift

    def _find(self, gait: str | Gait | None) -> Gait:
        legs = len(self._robot.legs)
        if gait is None:
            return next(iter(gaits_of(legs).values()))
        if isinstance(gait, str):
            return load_gait(gait, legs)
        if len(gait.offsets) != legs:
            raise InvalidInput(
                f"gait {gait.name} has {len(gait.offsets)} offsets; the robot has {legs} legs."
            )
        return gait

    def _without(self, gait: Gait, lost: frozenset[int]) -> Limp:
        model = self._model
        held = np.isin(np.arange(1, len(model.neutral) + 1), list(lost))[:, None]
        com = centre_of_mass(self._robot, np.where(held, model.folded, self._home))
        # The nearest shift: legs under a body farther from its neutral place have less reach.
        return without_legs(gait, lost, model.neutral, com[:2], nearest=True)
