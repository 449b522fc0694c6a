"""How a run ends, and the watch that notices."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
from jaxtyping import Float

from phasmid.kinematics import quaternion_rotation
from phasmid.robot import Robot
from phasmid.terrain import Ground

FASTEST_BODY = 20.0
"""A trunk faster than this is not walking but exploding [m/s]."""

FASTEST_JOINT = 200.0
"""A joint or trunk turning faster than this is not walking but exploding [rad/s]."""

STEEPEST_TILT = math.radians(60)
"""A trunk tilted further has fallen [rad]."""


class Ending(Enum):
    """How a run ended; the value is the sentence for it."""

    COMPLETED = "The walk was completed."
    INCOMPLETE = "The drive did not reach all waypoints."
    FELL = "The robot fell."
    DIVERGED = "The simulation diverged."
    FAILED = "The controller failed."
    STOPPED = "The run was stopped by the user."
    CUT = "The run was cut off."


@dataclass(frozen=True)
class Failure:
    """What the watch found.

    Attributes:
        ending: How the run ends by it.
        sample: Index of the first sample concerned.
        reason: What happened and where, and what to try.
    """

    ending: Ending
    sample: int
    reason: str

    @property
    def sentence(self) -> str:
        """How the run ended, where and why."""
        return f"{self.ending.value[:-1]} {self.reason}."


def check_termination(
    robot: Robot,
    qpos: Float[np.ndarray, "samples q"],
    qvel: Float[np.ndarray, "samples v"],
    ground: Ground | None = None,
    *,
    lies: bool = False,
) -> Failure | None:
    """Look through consecutive states for the first that ends a run.

    Args:
        robot: The robot.
        qpos: Engine positions: trunk position, quaternion, joints; shape (N, 7 + 3 L).
        qvel: Engine velocities: trunk, joints; shape (N, 6 + 3 L).
        ground: What it walks on; level at height 0 where none is given.
        lies: Whether the trunk may touch the ground, since it can lie there and is to.

    Returns:
        What was found first; None where all is well.
    """
    speed = np.abs(qvel).max(axis=0)
    x, y, z, w = qpos[:, 4], qpos[:, 5], qpos[:, 6], qpos[:, 3]
    with np.errstate(invalid="ignore", over="ignore"):
        # The vertical in body axes: the rotation's last row.
        up = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
        tilt = up[2] < math.cos(STEEPEST_TILT)
        if lies:
            lowest = np.zeros(len(qpos))
        elif ground is None or ground.is_level:
            lowest = qpos[:, 2] - (robot.body.size / 2) @ np.abs(up)
        else:
            lowest = trunk_clearance(robot, qpos, ground)
        # All is well nearly always; the sum is finite only where every number is.
        well = speed[:3].sum() < FASTEST_BODY and speed[3:].max() < FASTEST_JOINT
        if well and np.isfinite(qpos.sum()) and not tilt.any() and lowest.min() >= 0:
            return None
        body = np.linalg.norm(qvel[:, :3], axis=1) > FASTEST_BODY
        turning = np.abs(qvel[:, 3:]).max(axis=1) > FASTEST_JOINT
    finite = np.isfinite(qpos).all(axis=1) & np.isfinite(qvel).all(axis=1)
    found = [
        _first(
            ~finite,
            Ending.DIVERGED,
            "a state is not a finite number. Try a smaller time step (--dt)",
        )
    ]
    found += [
        _first(
            body | turning,
            Ending.DIVERGED,
            f"the trunk is faster than {FASTEST_BODY:g} m/s or a joint than {FASTEST_JOINT:g} "
            "rad/s. Try a smaller time step (--dt)",
        ),
        _first(
            tilt,
            Ending.FELL,
            f"the trunk tilted past {math.degrees(STEEPEST_TILT):.0f}°. Try a gait with a larger "
            "duty factor, or a shorter stride",
        ),
        _first(
            lowest < 0,
            Ending.FELL,
            "the trunk touched the ground. Try a stronger servo, or a higher stance",
        ),
    ]
    return min((t for t in found if t), key=lambda t: t.sample, default=None)


def trunk_clearance(
    robot: Robot, qpos: Float[np.ndarray, "samples q"], ground: Ground
) -> Float[np.ndarray, " samples"]:
    """Least height over the ground of the trunk's underside, at nine points of it [m].

    Args:
        robot: The robot.
        qpos: Engine positions, as for `watch`.
        ground: What it walks on.

    Returns:
        Heights [m], shape (N,).
    """
    length, width, height = robot.body.size / 2
    sides = np.array([-1.0, 0.0, 1.0])
    places = np.stack(np.meshgrid(length * sides, width * sides, [-height]), axis=-1).reshape(-1, 3)
    R = quaternion_rotation(qpos[:, 3:7])
    x, y, z = np.moveaxis(qpos[:, None, :3] + places @ np.swapaxes(R, 1, 2), -1, 0)
    return (z - ground.height(x, y)).min(axis=1)


def _first(bad: np.ndarray, ending: Ending, reason: str) -> Failure | None:
    return Failure(ending, int(np.argmax(bad)), reason) if bad.any() else None
