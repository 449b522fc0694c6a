"""Conditions that end a run early."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.experiment.ending import Ending, Failure
from phasmid.kinematics import quaternion_rotation
from phasmid.robot import Robot
from phasmid.terrain import Ground

FASTEST_BODY = 20.0
"""Trunk velocity above which the simulation has diverged [m/s]."""

FASTEST_JOINT = 200.0
"""Angular velocity of joint or trunk above which the simulation has diverged [rad/s]."""

UNDERSIDE = np.array([[x, y, -1.0] for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0)])
"""Points of the trunk's underside, in halves of its size from its centre."""

STEEPEST_TILT = math.radians(60)
"""Tilt of the trunk beyond which the robot has fallen [rad]."""


SMALLER_STEP = "a smaller time step (--dt)"


def check_termination(
    robot: Robot,
    qpos: Float[np.ndarray, "samples q"],
    qvel: Float[np.ndarray, "samples v"],
    ground: Ground,
    *,
    lies: bool = False,
) -> Failure | None:
    """Return the first failure in consecutive states, or None.

    Args:
        robot: The robot.
        qpos: Trunk position, quaternion and joint angles, shape (N, 7 + 3 L).
        qvel: Velocities of trunk and joints, shape (N, 6 + 3 L).
        ground: The ground.
        lies: Whether the trunk may touch the ground.
    """
    _, x, y, _ = qpos[:, 3:7].T
    with np.errstate(invalid="ignore", over="ignore"):
        upright = 1 - 2 * (x * x + y * y)
        clearance = np.zeros(len(qpos)) if lies else trunk_clearance(robot, qpos, ground)
        fast_body = np.linalg.norm(qvel[:, :3], axis=1) > FASTEST_BODY
        fast = fast_body | (np.abs(qvel[:, 3:]).max(axis=1) > FASTEST_JOINT)
        finite = np.isfinite(qpos).all(axis=1) & np.isfinite(qvel).all(axis=1)
    checks = (
        (~finite, Ending.DIVERGED, "a state is not a finite number", SMALLER_STEP),
        (
            fast,
            Ending.DIVERGED,
            f"the trunk is faster than {FASTEST_BODY:g} m/s or a joint than {FASTEST_JOINT:g} "
            "rad/s",
            SMALLER_STEP,
        ),
        (
            upright < math.cos(STEEPEST_TILT),
            Ending.FELL,
            f"the trunk tilted past {math.degrees(STEEPEST_TILT):.0f}°",
            "a gait with a larger duty factor, or a shorter step",
        ),
        (clearance < 0, Ending.FELL, "the trunk touched the ground", "a higher stance"),
    )
    failures = [
        Failure(ending, int(np.argmax(failed)), reason, remedy)
        for failed, ending, reason, remedy in checks
        if failed.any()
    ]
    return min(failures, key=lambda failure: failure.sample, default=None)


def trunk_clearance(
    robot: Robot, qpos: Float[np.ndarray, "samples q"], ground: Ground
) -> Float[np.ndarray, " samples"]:
    """Return the least height over the ground of the trunk's underside [m], (N,)."""
    R = quaternion_rotation(qpos[:, 3:7])
    position = qpos[:, None, :3] + robot.body.box_points(UNDERSIDE) @ np.swapaxes(R, 1, 2)
    x, y, z = np.moveaxis(position, -1, 0)
    return (z - ground.height(x, y)).min(axis=1)
