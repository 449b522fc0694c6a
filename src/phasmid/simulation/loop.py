"""The loop around the engine's step, for planned walks, driven runs, the studio and replay."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.simulation.drives import Drive, LostConstraints
from phasmid.simulation.ground import Footing
from phasmid.simulation.samples import Samples

if TYPE_CHECKING:
    import mujoco


class Made(NamedTuple):
    """What became of a block of steps.

    Attributes:
        steps: Number of steps made.
        error: The engine's error, or nothing.
        lost: Whether it made no constraint for some of the joints that constraints hold.
    """

    steps: int
    error: str
    lost: bool


class Loop:
    """The steps of one run.

    Args:
        model: The engine's model.
        data: The engine's state.
        drive: What moves the joints.
        footing: What the feet stand on.
        buffer: Takes a sample of each step.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        drive: Drive,
        footing: Footing,
        buffer: Samples,
    ) -> None:
        self._engine, self._drive, self._footing = (model, data), drive, footing
        arrays = data.qpos, data.qvel, data.sensordata, drive.state
        self._views, self._rows = [array.data for array in arrays], buffer.rows()

    # A state that is not finite is for the watch to find.
    @np.errstate(invalid="ignore", over="ignore")
    def advance(
        self,
        targets: Float[np.ndarray, "samples joints"],
        end: int,
        at: int = 0,
        interrupted: Sequence[int] = (),
    ) -> Made:
        """Make a step for each target; its sample goes into the buffer.

        Args:
            targets: What the drive is told.
            end: Number of the target that is measured and not stepped, if there is such a one.
            at: Where in the buffer the first sample goes.
            interrupted: No further step is begun once this is not empty.

        Returns:
            What became of it.
        """
        import mujoco

        # All names are local, and views of memory are copied, which is quicker than arrays: the
        # loop below is the simulation's whole cost beside the engine.
        (model, data), step = self._engine, mujoco.mj_step
        command, torque = self._drive.command, self._drive.torque
        follow = self._footing.follow if self._footing.needed else None
        qpos, qvel, sensors, state = self._views
        rows = [row[at : at + len(targets)] for row in self._rows] if at else self._rows
        made = 0
        try:
            for target, to_qpos, to_qvel, to_sensors, to_torque, to_state in zip(
                targets, *rows, strict=False
            ):
                if interrupted:
                    break
                to_qpos[:] = qpos
                to_qvel[:] = qvel
                command(target)
                if follow:
                    follow()
                if made == end:
                    step = mujoco.mj_forward
                step(model, data)
                to_sensors[:] = sensors
                to_torque[:] = torque()
                if state:
                    to_state[:] = state
                made += 1
        except mujoco.FatalError as error:
            return Made(made, str(error), lost=False)
        except LostConstraints:
            return Made(made, "", lost=True)
        return Made(made, "", lost=False)
