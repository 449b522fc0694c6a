"""Which legs lift when, as the engine's references tell it, with all legs or without lost ones."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.control.settings import EngineSettings
from phasmid.control.types import Model, Reference
from phasmid.errors import InvalidInput
from phasmid.gait import GAITS, Gait, Limp, load_gait, without_legs
from phasmid.kinematics import centre_of_mass, joint_angles
from phasmid.robot import Robot

SWAYING_SWING, SWING_TIME = 2 / 3, 0.5
"""Time of a swing where nobody tells a period: of gaits that sway, and of others [s]."""


class Pattern:
    """The gait of an engine, and those that commands ask for instead.

    Args:
        robot: The robot, L legs.
        settings: Which gait it has, and its period.
        model: The robot's numbers; how its lost legs are held counts as it stands.

    Attributes:
        gait: The engine's own.

    Raises:
        InvalidInput: There is no such gait for the robot.
        InvalidGait: The gait does not fit the robot.
    """

    def __init__(self, robot: Robot, settings: EngineSettings, model: Model) -> None:
        self._robot, self._model, self._period = robot, model, settings.period
        self._home = joint_angles(robot.arrays, np.array(robot.arrays.neutral_foot))
        self.gait = self._chosen(settings.gait)

    def write(
        self,
        reference: Reference,
        gait: str | Gait | None,
        period: float | None,
        lost: frozenset[int],
    ) -> Float[np.ndarray, "2"]:
        """Write which legs lift when; how far the body stands aside for that [m], shape (2,).

        Args:
            reference: Its gait, phases and used legs are written.
            gait: Its name, or the gait; None: the engine's own.
            period: Time of a cycle [s]; None: as the engine is set.
            lost: Numbers of legs that are not walked on.

        Raises:
            InvalidInput: There is no such gait.
            InvalidGait: The gait does not fit the robot, or too few legs are left.
        """
        chosen = self.gait if gait is None else self._chosen(gait)
        if period is None:
            period = self._period
        if period is None:
            swing = SWAYING_SWING if chosen.sway else SWING_TIME
            period = swing / chosen.swing_fraction
        shift = np.zeros(2)
        offsets = np.array(chosen.offsets)
        used = np.ones(len(offsets), dtype=np.int64)
        if lost:
            limp = self._without(chosen, lost)
            # Swings take as long as they did with all legs.
            period *= chosen.swing_fraction / limp.gait.swing_fraction
            chosen, shift = limp.gait, np.array(limp.shift)
            used[:] = 0
            used[limp.indices] = 1
            offsets[limp.indices] = chosen.offsets
        reference.lift_phase[:], reference.used[:] = offsets, used
        reference.duty_factor, reference.period, reference.sway = (
            chosen.duty_factor,
            period,
            chosen.sway,
        )
        return shift

    def _chosen(self, gait: str | Gait | None) -> Gait:
        legs = len(self._robot.legs)
        if gait is None:
            known = GAITS.get(legs, {})
            if not known:
                raise InvalidInput(
                    f"the library has no gait for {legs} legs.",
                    hint="LocomotionEngine(robot, gait=Gait(...))",
                )
            return next(iter(known.values()))
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
        q = np.where(held, model.folded, self._home)
        com = centre_of_mass(self._robot, q)
        # Legs whose body stands farther aside than it must reach less far and lift more slowly.
        return without_legs(gait, lost, model.neutral, com[:2], nearest=True)
