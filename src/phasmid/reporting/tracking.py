"""Tracking of a commanded velocity, and its cost."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.kinematics import quaternion_rotation
from phasmid.recording import Recording


class Tracking(NamedTuple):
    """Tracking in the last cycles of a walk at a constant velocity.

    Attributes:
        velocity: Actual velocity in body axes: vx, vy [m/s], wz [rad/s].
        velocity_error: Its deviation, as a share of the commanded velocity.
        joint_error: Rms position error of all joints [rad].
        slip: Displacement of a stance foot per step [m].
        tangential: Mean of the sum of all tangential foot forces [N].
        power: Mean positive power of the joints [W].
        torque: Largest torque of all joints [N·m].
    """

    velocity: tuple[float, float, float]
    velocity_error: float
    joint_error: float
    slip: float
    tangential: float
    power: float
    torque: float


def track(
    recording: Recording, velocity: tuple[float, float, float], *, period: float, cycles: int
) -> Tracking:
    """Return the tracking in a walk's last cycles.

    Args:
        recording: A simulated walk on level ground.
        velocity: Commanded velocity: vx, vy [m/s], wz [rad/s].
        period: Duration of a cycle [s].
        cycles: Number of last cycles.

    Raises:
        InvalidInput: The recording is shorter than that, or no velocity was commanded.
    """
    time = recording.time.values
    start = int(np.searchsorted(time, time[-1] - cycles * period - 1e-9))
    if cycles < 1 or time[-1] - time[0] < cycles * period:
        raise InvalidInput(
            f"the recording lasts {time[-1] - time[0]:g} s; it must last {cycles} cycles of "
            f"{period:g} s or more."
        )
    channel = {
        name: recording[name].values[start:]
        for name in (
            *("body_position", "body_orientation", "foot_position", "foot_force", "contact"),
            *("joint_position", "joint_position_target", "joint_velocity", "joint_torque"),
        )
    }
    lasts = float(time[-1] - time[start])
    R = quaternion_rotation(channel["body_orientation"])
    yaw = np.unwrap(np.arctan2(R[:, 1, 0], R[:, 0, 0]))
    c, s = np.cos(yaw), np.sin(yaw)
    x, y = np.diff(channel["body_position"][:, :2], axis=0).T
    forward = float(np.sum(c[:-1] * x + s[:-1] * y)) / lasts
    lateral = float(np.sum(c[:-1] * y - s[:-1] * x)) / lasts
    actual = (forward, lateral, float(yaw[-1] - yaw[0]) / lasts)

    feet, force = channel["foot_position"], channel["foot_force"]
    # Yaw counts by the speed of the feet that it causes.
    reach = feet[0, :, :2] - channel["body_position"][0, :2]
    scale = np.array([1.0, 1.0, np.linalg.norm(reach, axis=-1).mean()])
    commanded = float(np.linalg.norm(scale * velocity))
    if commanded == 0.0:
        raise InvalidInput("velocity is (0, 0, 0); a walk in place has no velocity error.")
    touches = channel["contact"].astype(bool)
    stays = touches[1:] & touches[:-1]
    slid = np.linalg.norm(np.diff(feet[..., :2], axis=0), axis=-1) * stays
    steps = max(1, int(np.sum(touches[1:] & ~touches[:-1])))
    error = channel["joint_position"] - channel["joint_position_target"]
    power = np.maximum(channel["joint_torque"] * channel["joint_velocity"], 0.0)
    return Tracking(
        actual,
        float(np.linalg.norm(scale * (np.array(actual) - velocity))) / commanded,
        float(np.sqrt(np.mean(error**2))),
        float(slid.sum()) / steps,
        float(np.linalg.norm(force[..., :2], axis=-1).sum(axis=-1).mean()),
        float(power.sum(axis=(1, 2)).mean()),
        float(np.abs(channel["joint_torque"]).max()),
    )
