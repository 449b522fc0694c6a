"""Motion of the trunk."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from phasmid.experiment import Stride
from phasmid.gait import Gait, Sway
from phasmid.kinematics import (
    angular_motion,
    rotation_rpy,
    rpy_quaternion,
    step_pose,
    step_twist,
)
from phasmid.motion.curves import Path, blend, composed, cos_and_sin, vector


def progress(gait: Gait, stride: Stride, time: Float[np.ndarray, "*batch"]) -> Path:
    """Return the number of steps of the body; one step lasts for the stance of a foot.

    Args:
        gait: The times of lift-off and touchdown.
        stride: Its timing and curve; ``rest-to-rest`` stops the body at each of these events.
        time: Time [s].

    Returns:
        Steps, steps/s and steps/s².
    """
    cycles = np.asarray(time, dtype=float) / stride.period
    if stride.stance_timing == "constant-speed":
        rate = 1 / (gait.duty_factor * stride.period)
        return Path(cycles / gait.duty_factor, np.full(cycles.shape, rate), np.zeros(cycles.shape))
    whole, index, s = between_events(gait, stride, cycles)
    events = np.append(gait.events, 1.0)
    start, length = events[index], np.diff(events)[index]
    share = length / gait.duty_factor
    return s.over(length * stride.period) * share + (whole + start) / gait.duty_factor


def between_events(
    gait: Gait, stride: Stride, cycles: Float[np.ndarray, "*batch"]
) -> tuple[Float[np.ndarray, "*batch"], Int[np.ndarray, "*batch"], Path]:
    """Return the progress from the gait's last event, 0, to its next one, 1.

    Args:
        gait: The times of lift-off and touchdown.
        stride: Its curve.
        cycles: Time in cycles, shape (...).

    Returns:
        Number of the cycle, which of its events was the last, and the fraction of the way with
        its derivatives by the fraction of the time between the two events.
    """
    events = np.append(gait.events, 1.0)
    whole = np.floor(cycles + 1e-12)
    part = np.maximum(cycles - whole, 0.0)
    index = np.clip(np.searchsorted(events, part, side="right") - 1, 0, len(events) - 2)
    start, length = events[index], np.diff(events)[index]
    return whole, index, blend(stride.curve, np.clip((part - start) / length, 0.0, 1.0))


@dataclass(frozen=True, eq=False)
class TrunkMotion:
    """Planned motion of the body frame; leading axes are those of time.

    Attributes:
        position: Origin in world axes [m], shape (..., 3).
        velocity: [m/s], shape (..., 3).
        acceleration: [m/s²], shape (..., 3).
        attitude: Roll, pitch and yaw as in `phasmid.kinematics.rotation_rpy` [rad], the yaw
            counting full turns, shape (..., 3).
        attitude_rate: Their first derivatives [rad/s], shape (..., 3).
        attitude_acceleration: Their second derivatives [rad/s²], shape (..., 3).
    """

    position: Float[np.ndarray, "*batch 3"]
    velocity: Float[np.ndarray, "*batch 3"]
    acceleration: Float[np.ndarray, "*batch 3"]
    attitude: Float[np.ndarray, "*batch 3"]
    attitude_rate: Float[np.ndarray, "*batch 3"]
    attitude_acceleration: Float[np.ndarray, "*batch 3"]

    @property
    def yaw(self) -> Float[np.ndarray, "*batch"]:
        """Heading about the vertical [rad], shape (...)."""
        return np.asarray(self.attitude[..., 2])

    @property
    def rotation(self) -> Float[np.ndarray, "*batch 3 3"]:
        """``R_world_body``, shape (..., 3, 3)."""
        return rotation_rpy(*np.moveaxis(self.attitude, -1, 0))

    @property
    def quaternion(self) -> Float[np.ndarray, "*batch 4"]:
        """The same rotation as a quaternion (w, x, y, z), shape (..., 4)."""
        return rpy_quaternion(*np.moveaxis(self.attitude, -1, 0))

    @property
    def angular_velocity(self) -> Float[np.ndarray, "*batch 3"]:
        """Angular velocity in world axes [rad/s], shape (..., 3)."""
        return self._angular_motion[0]

    @property
    def angular_acceleration(self) -> Float[np.ndarray, "*batch 3"]:
        """Angular acceleration in world axes [rad/s²], shape (..., 3)."""
        return self._angular_motion[1]

    @cached_property
    def _angular_motion(
        self,
    ) -> tuple[Float[np.ndarray, "*batch 3"], Float[np.ndarray, "*batch 3"]]:
        return angular_motion(self.attitude, self.attitude_rate, self.attitude_acceleration)


def trunk_motion(step: Float[np.ndarray, "3"], height: float, steps: Path) -> TrunkMotion:
    """Return the motion of the level trunk along an arc of equal steps.

    Args:
        step: Displacement of one step: forward [m], left [m], turn [rad].
        height: Height of the body frame in the world [m].
        steps: Steps made, and their first two derivatives by time.
    """
    pose, twist = step_pose(step, steps.position), step_twist(step)
    c, s = np.cos(pose[..., 2]), np.sin(pose[..., 2])
    # Velocity and its change per unit of progress, in world axes.
    vx, vy = c * twist[0] - s * twist[1], s * twist[0] + c * twist[1]
    x = composed(pose[..., 0], vx, -twist[2] * vy, steps)
    y = composed(pose[..., 1], vy, twist[2] * vx, steps)
    yaw = composed(pose[..., 2], np.full_like(c, twist[2]), 0 * c, steps)
    none = steps * 0.0
    return TrunkMotion(*vector(x, y, none + height), *vector(none, none, yaw))


def swayed(trunk: TrunkMotion, aside: Sway) -> TrunkMotion:
    """Return the motion of a level trunk with its sway.

    Args:
        trunk: The motion along the path, without pitch and roll.
        aside: The sway, in the body's axes.
    """
    yaw = Path(trunk.yaw, trunk.attitude_rate[:, 2], trunk.attitude_acceleration[:, 2])
    c, s = cos_and_sin(yaw)
    x, y = (Path(*(order[:, axis] for order in aside)) for axis in (0, 1))
    p, v, a = vector(c * x - s * y, s * x + c * y, x * 0.0)
    return replace(
        trunk,
        position=trunk.position + p,
        velocity=trunk.velocity + v,
        acceleration=trunk.acceleration + a,
    )
