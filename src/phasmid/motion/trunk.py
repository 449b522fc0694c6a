"""How the trunk travels over level ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.gait import Gait
from phasmid.kinematics import step_pose, step_twist
from phasmid.motion.curves import Path, blend
from phasmid.scenario.stride import StrideTable


def progress(gait: Gait, stride: StrideTable, time: Float[np.ndarray, "*batch"]) -> Path:
    """How many steps the body has made; one step lasts as long as a foot stands.

    Args:
        gait: Tells when feet lift and land.
        stride: Its timing and curve; ``rest-to-rest`` stops the body at each of these events.
        time: Time [s].

    Returns:
        Steps, steps/s and steps/s².
    """
    cycles = np.asarray(time, dtype=float) / stride.period
    if stride.stance_timing == "constant-speed":
        rate = 1 / (gait.duty_factor * stride.period)
        return Path(cycles / gait.duty_factor, np.full(cycles.shape, rate), np.zeros(cycles.shape))
    events = np.append(gait.events, 1.0)
    whole = np.floor(cycles + 1e-12)
    part = np.maximum(cycles - whole, 0.0)
    index = np.clip(np.searchsorted(events, part, side="right") - 1, 0, len(events) - 2)
    start, length = events[index], np.diff(events)[index]
    s = blend(stride.curve, np.clip((part - start) / length, 0.0, 1.0))
    share, seconds = length / gait.duty_factor, length * stride.period
    return Path(
        (whole + start) / gait.duty_factor + share * s.position,
        share * s.velocity / seconds,
        share * s.acceleration / seconds**2,
    )


@dataclass(frozen=True, eq=False)
class TrunkMotion:
    """Planned motion of the body frame over level ground; leading axes as time.

    Attributes:
        position: Origin in world axes [m], shape (..., 3).
        velocity: [m/s], shape (..., 3).
        acceleration: [m/s²], shape (..., 3).
        yaw: Heading about the vertical [rad], shape (...).
        yaw_rate: [rad/s], shape (...).
        yaw_acceleration: [rad/s²], shape (...).
    """

    position: Float[np.ndarray, "*batch 3"]
    velocity: Float[np.ndarray, "*batch 3"]
    acceleration: Float[np.ndarray, "*batch 3"]
    yaw: Float[np.ndarray, "*batch"]
    yaw_rate: Float[np.ndarray, "*batch"]
    yaw_acceleration: Float[np.ndarray, "*batch"]


def trunk_motion(step: Float[np.ndarray, "3"], height: float, steps: Path) -> TrunkMotion:
    """Motion of the trunk along the arc that equal steps make.

    Args:
        step: Displacement of one step: forward [m], left [m], turn [rad].
        height: Height of the body frame over the ground [m].
        steps: Steps made, and their first two derivatives by time.
    """
    pose, twist = step_pose(step, steps.position), step_twist(step)
    c, s = np.cos(pose[..., 2]), np.sin(pose[..., 2])
    # Velocity and its change per unit of progress, in world axes.
    vx, vy = c * twist[0] - s * twist[1], s * twist[0] + c * twist[1]
    ax, ay = -twist[2] * vy, twist[2] * vx
    zero = np.zeros(c.shape)
    rate, bend = steps.velocity, steps.acceleration
    return TrunkMotion(
        position=np.stack([pose[..., 0], pose[..., 1], zero + height], axis=-1),
        velocity=np.stack([vx * rate, vy * rate, zero], axis=-1),
        acceleration=np.stack([vx * bend + ax * rate**2, vy * bend + ay * rate**2, zero], axis=-1),
        yaw=pose[..., 2],
        yaw_rate=twist[2] * rate,
        yaw_acceleration=twist[2] * bend,
    )
