"""The loop around `mj_step`, for planned walks, closed-loop runs, the studio and replays."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from jaxtyping import Float

from phasmid.simulation.contact import FootGround
from phasmid.simulation.drives import Drive, LostConstraints

if TYPE_CHECKING:
    import mujoco


Samples: TypeAlias = np.ndarray
"""States and measurements at N samples, in MuJoCo's order; fields of `empty_samples`."""

Keep = Callable[[Samples], None]
"""Receives recorded samples in their order; the memory is reused afterwards."""


def empty_samples(model: mujoco.MjModel, drive: Drive, count: int) -> Samples:
    """Allocate N samples.

    Returns:
        Records with the fields ``qpos``: trunk position [m], quaternion and joint angles [rad]
        (7 + 3 L); ``qvel``: velocity of the trunk (world axes) [m/s], its angular velocity (body
        axes) and joint velocities [rad/s] (6 + 3 L); ``sensors``: as of `build_model` (7 L);
        ``torque`` of the joints [N·m] (3 L); ``drive``: state of the drive.
    """
    widths = {
        "qpos": model.nq,
        "qvel": model.nv,
        "sensors": model.nsensordata,
        "torque": model.nv - 6,
        "drive": len(drive.state),
    }
    kind = np.dtype([(name, np.float64, (width,)) for name, width in widths.items()])
    return np.empty(count, kind)


def present_sample(model: mujoco.MjModel, data: mujoco.MjData, drive: Drive) -> Samples:
    """Return the present state as one sample."""
    sample = empty_samples(model, drive, 1)
    values = data.qpos, data.qvel, data.sensordata, drive.torque(), drive.state
    for name, value in zip(sample.dtype.names or (), values, strict=True):
        sample[name][0] = value
    return sample


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
        names = "qpos", "qvel", "sensors", "drive"
        self._rows = [[row.data for row in buffer[name]] for name in names]
        self._rows.append(list(buffer["torque"]))
        self.error = ""

    def advance(
        self,
        targets: Float[np.ndarray, "samples joints"],
        *,
        at: int = 0,
        last: bool = False,
        interrupted: Sequence[int] = (),
    ) -> int:
        """Make one step per row of targets.

        Args:
            targets: Commands of the drive.
            at: First row of the buffer to write.
            last: Whether the last row is the end of the run, which is measured and not stepped.
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
        made, end = 0, len(targets) - last
        try:
            for target, to_qpos, to_qvel, to_sensors, to_state, to_torque in zip(
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
                to_state[:] = state
                made += 1
        except mujoco.FatalError as error:
            self.error = f"the engine reports: {' '.join(str(error).split())}"
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
