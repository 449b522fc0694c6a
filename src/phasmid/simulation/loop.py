"""The loop around `mj_step`, for planned walks, closed-loop runs, the studio and replays."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from phasmid.simulation.contact import FootGround
from phasmid.simulation.drives import Drive, LostConstraints

if TYPE_CHECKING:
    import mujoco


@dataclass(frozen=True, eq=False)
class Samples:
    """States and measurements at N samples, in MuJoCo's order.

    Attributes:
        qpos: Trunk position [m] and quaternion, joint angles [rad], shape (N, 7 + 3 L).
        qvel: Trunk velocity (world) and angular velocity (body axes), joints, (N, 6 + 3 L).
        sensors: As of `build_model`, shape (N, 7 L).
        torque: Of the joints [N·m], shape (N, 3 L).
        drive: States of the drive.
    """

    qpos: Float[np.ndarray, "samples q"]
    qvel: Float[np.ndarray, "samples v"]
    sensors: Float[np.ndarray, "samples sensors"]
    torque: Float[np.ndarray, "samples joints"]
    drive: Float[np.ndarray, "samples state"]

    @classmethod
    def empty(cls, model: mujoco.MjModel, drive: Drive, samples: int) -> Samples:
        """Allocate a number of samples."""
        widths = (model.nq, model.nv, model.nsensordata, model.nv - 6, len(drive.state))
        return cls(*(np.empty((samples, width)) for width in widths))

    def arrays(self) -> list[np.ndarray]:
        """Return the arrays in the order of the attributes."""
        return [getattr(self, field.name) for field in fields(self)]

    def part(self, which: slice) -> Samples:
        """Return a view of some samples."""
        return Samples(*(array[which] for array in self.arrays()))

    def put(self, at: int, samples: Samples) -> None:
        """Copy samples to a place in these."""
        for array, rows in zip(self.arrays(), samples.arrays(), strict=True):
            array[at : at + len(rows)] = rows

    def write(self, row: int, data: mujoco.MjData, drive: Drive) -> None:
        """Copy the present state to a row."""
        values = data.qpos, data.qvel, data.sensordata, drive.torque(), drive.state
        for array, value in zip(self.arrays(), values, strict=True):
            array[row] = value


Keep = Callable[[Samples], None]
"""Receives recorded samples in their order; the memory is reused afterwards."""


class StepLoop:
    """Advances a simulation step by step, and writes a sample of each step into a buffer.

    Attributes:
        error: Why the loop ended early; empty where it did not.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        drive: Drive,
        ground: FootGround,
        buffer: Samples,
    ) -> None:
        self._engine, self._drive, self._ground = (model, data), drive, ground
        # Memory views are copied faster than arrays.
        self._views = [each.data for each in (data.qpos, data.qvel, data.sensordata, drive.state)]
        rows: list[list[Any]] = [[row.data for row in array] for array in buffer.arrays()]
        rows[3] = list(buffer.torque)
        self._rows, self.error = rows, ""

    def advance(
        self,
        targets: Float[np.ndarray, "samples joints"],
        end: int,
        at: int = 0,
        interrupted: Sequence[int] = (),
    ) -> int:
        """Make one step per row of targets.

        Args:
            targets: Commands of the drive.
            end: Row that is measured and not stepped, if there is such a one.
            at: First row of the buffer to write.
            interrupted: No further step begins once this is not empty.

        Returns:
            Number of steps made; fewer than targets after an interruption or an `error`.
        """
        import mujoco

        (model, data), step = self._engine, mujoco.mj_step
        command, torque = self._drive.command, self._drive.torque
        update_ground = self._ground.update if self._ground.varies else None
        qpos, qvel, sensors, state = self._views
        rows = [row[at : at + len(targets)] for row in self._rows]
        made = 0
        try:
            # A state that is not finite is found by `check_termination`.
            with np.errstate(invalid="ignore", over="ignore"):
                for target, to_qpos, to_qvel, to_sensors, to_torque, to_state in zip(
                    targets, *rows, strict=False
                ):
                    if interrupted:
                        break
                    to_qpos[:] = qpos
                    to_qvel[:] = qvel
                    command(target)
                    if update_ground:
                        update_ground()
                    if made == end:
                        step = mujoco.mj_forward
                    step(model, data)
                    to_sensors[:] = sensors
                    to_torque[:] = torque()
                    if state:
                        to_state[:] = state
                    made += 1
        except mujoco.FatalError as error:
            self.error = f"the engine says: {' '.join(str(error).split())}"
        except LostConstraints as error:
            self.error = error.what.rstrip(".")
        return made


_LOCK = threading.Lock()
_COLLECTORS: dict[int, list[str]] = {}
_PREVIOUS: list[Callable[[str], Any] | None] = []


@contextmanager
def collect_engine_warnings(messages: list[str]) -> Iterator[None]:
    """Collect MuJoCo's warnings in this thread, which it would print and write to a file.

    MuJoCo has one handler for all threads and calls it in the thread that steps.
    """
    import mujoco

    thread = threading.get_ident()
    with _LOCK:
        if not _COLLECTORS:
            _PREVIOUS.append(mujoco.get_mju_user_warning())
            mujoco.set_mju_user_warning(_collect)
        outer = _COLLECTORS.get(thread)
        _COLLECTORS[thread] = messages
    try:
        yield
    finally:
        with _LOCK:
            del _COLLECTORS[thread]
            if outer is not None:
                _COLLECTORS[thread] = outer
            if not _COLLECTORS:
                mujoco.set_mju_user_warning(_PREVIOUS.pop())


def _collect(message: str) -> None:
    messages = _COLLECTORS.get(threading.get_ident())
    if messages is not None:
        messages.append(message)
    elif _PREVIOUS and _PREVIOUS[0]:
        _PREVIOUS[0](message)
