"""Tracking of a commanded velocity, and its cost."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.kinematics import quaternion_yaw
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
    part = recording.isel(time=slice(start, None))
    lasts = float(time[-1] - time[start])
    body, feet, force = (
        part[name].values for name in ("body_position", "foot_position", "foot_force")
    )
    yaw = np.unwrap(quaternion_yaw(part["body_orientation"].values))
    c, s = np.cos(yaw[:-1]), np.sin(yaw[:-1])
    x, y = np.diff(body[:, :2], axis=0).T
    way = np.sum(c * x + s * y), np.sum(c * y - s * x), yaw[-1] - yaw[0]
    vx, vy, wz = (float(distance) / lasts for distance in way)
    # Yaw counts by the speed of the feet that it causes.
    reach = feet[0, :, :2] - body[0, :2]
    scale = np.array([1.0, 1.0, np.linalg.norm(reach, axis=-1).mean()])
    commanded = float(np.linalg.norm(scale * velocity))
    if commanded == 0.0:
        raise InvalidInput("velocity is (0, 0, 0); a walk in place has no velocity error.")
    touches, torque = part["contact"].values.astype(bool), part["joint_torque"].values
    stays = touches[1:] & touches[:-1]
    slid = np.linalg.norm(np.diff(feet[..., :2], axis=0), axis=-1) * stays
    steps = max(1, int(np.sum(touches[1:] & ~touches[:-1])))
    error = part["joint_position"].values - part["joint_position_target"].values
    power = np.maximum(torque * part["joint_velocity"].values, 0.0)
    return Tracking(
        (vx, vy, wz),
        float(np.linalg.norm(scale * (np.array([vx, vy, wz]) - velocity))) / commanded,
        float(np.sqrt(np.mean(error**2))),
        float(slid.sum()) / steps,
        float(np.linalg.norm(force[..., :2], axis=-1).sum(axis=-1).mean()),
        float(power.sum(axis=(1, 2)).mean()),
        float(np.abs(torque).max()),
    )
