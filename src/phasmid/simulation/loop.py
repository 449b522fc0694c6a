"""The loop around `mj_step`, for planned walks, closed-loop runs, the studio and replays."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from jaxtyping import Float

from phasmid.simulation.drives import Drive

if TYPE_CHECKING:
    import mujoco

    from phasmid.simulation.run import Run

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
    sample[0] = data.qpos, data.qvel, data.sensordata, drive.torque(), drive.state
    return sample


def make_steps(
    run: Run, targets: Float[np.ndarray, "samples joints"], buffer: Samples, *, last: bool = False
) -> tuple[int, str]:
    """Make one step of a run per row of targets, and write a sample of each.

    Args:
        run: Its model, state, drive and ground under the feet are used.
        targets: Commands of the drive, N rows.
        buffer: Receives the samples, at least N rows.
        last: Whether the last row is the end of the run, which is measured and not stepped.

    Returns:
        Number of steps made, and why there are fewer than targets.
    """
    import mujoco

    model, data, drive, ground = run.model, run.data, run.drive, run.foot_ground
    step, end = mujoco.mj_step, len(targets) - last
    qpos, qvel, sensors, state = data.qpos, data.qvel, data.sensordata, drive.state
    names = "qpos", "qvel", "sensors", "torque", "drive"
    all_qpos, all_qvel, all_sensors, all_torque, all_state = (buffer[name] for name in names)
    for k, target in enumerate(targets):
        all_qpos[k], all_qvel[k] = qpos, qvel
        drive.command(target)
        if ground.varies:
            ground.update()
        if k == end:
            step = mujoco.mj_forward
        try:
            step(model, data)
        except mujoco.FatalError as error:
            return k, f"the engine reports: {' '.join(str(error).split())}"
        all_sensors[k], all_torque[k], all_state[k] = sensors, drive.torque(), state
    return len(targets), ""


_thread_local = threading.local()


@contextmanager
def collect_engine_warnings(messages: list[str]) -> Iterator[None]:
    """Collect MuJoCo's warnings in this thread, which it would print and write to a file.

    MuJoCo has one handler for all threads, which stays set, and calls it in the thread that steps.
    """
    import mujoco

    outer = getattr(_thread_local, "messages", None)
    _thread_local.messages = messages
    mujoco.set_mju_user_warning(_on_warning)
    try:
        yield
    finally:
        _thread_local.messages = outer


def _on_warning(message: str) -> None:
    """Add a warning of MuJoCo to the messages that this thread collects, or issue it."""
    messages = getattr(_thread_local, "messages", None)
    if messages is None:
        warnings.warn(message, RuntimeWarning, stacklevel=2)
    else:
        messages.append(message)
