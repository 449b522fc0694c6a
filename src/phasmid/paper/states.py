"""The states on which the cost of a misprint is measured."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Bool, Float

from phasmid.forces import analyse
from phasmid.kinematics import foot_position
from phasmid.motion import plan
from phasmid.robot import Robot
from phasmid.scenario import load_scenario

RANDOM_STATES = 2000
"""Random states of each leg."""

FARTHEST_ROLL = math.radians(30)
"""Random rolls and pitches of the body are at most this [rad]."""

FASTEST = 6.0
"""Largest random joint speed, about that of an unloaded AX-12 [rad/s]."""

STRONGEST = 60.0
"""Random joint accelerations are at most this [rad/s²]."""

LARGEST_FORCE = 10.0
"""Random foot forces have components of at most this [N]."""


@dataclass(frozen=True, eq=False)
class States:
    """Motions and loads of all legs of a robot, many at once.

    Attributes:
        robot: L legs; their masses lie as Eq. 10 assumes.
        q: Joint angles [rad], shape (N, L, 3).
        qd: Joint speeds [rad/s], shape (N, L, 3).
        qdd: Joint accelerations [rad/s²], shape (N, L, 3).
        foot_force: Force of the ground on each foot in hip axes [N], shape (N, L, 3).
        stance: Which feet stand, shape (N, L).
        attitude: Roll, pitch and yaw of the body [rad], shape (N, 3).
    """

    robot: Robot
    q: Float[np.ndarray, "time legs 3"]
    qd: Float[np.ndarray, "time legs 3"]
    qdd: Float[np.ndarray, "time legs 3"]
    foot_force: Float[np.ndarray, "time legs 3"]
    stance: Bool[np.ndarray, "time legs"]
    attitude: Float[np.ndarray, "time 3"]


@cache
def walk_states() -> States:
    """Return the samples of the paper's walk, with foot forces of minimum norm.

    The centres of mass are where Eq. 10 assumes them, so that differences come from misprints.
    """
    scenario = load_scenario("paper").replace(mass_model="mid-length")
    walk = plan(scenario)
    force = analyse(scenario, walk).foot_force_model.values
    R_body_hip, R_world_body = walk.robot.arrays.R_body_hip, walk.trunk.rotation
    return States(
        robot=walk.robot,
        q=walk.q,
        qd=walk.qd,
        qdd=walk.qdd,
        foot_force=np.einsum("lji,tkj,tlk->tli", R_body_hip, R_world_body, force),
        stance=walk.stance,
        attitude=walk.trunk.attitude,
    )


@cache
def random_states() -> States:
    """States drawn evenly from their ranges, always the same ones.

    The coxa turns all around; femur and tibia stay within the robot's joint limits, and every foot
    outside its coxa axis.
    """
    robot = walk_states().robot
    rng = np.random.default_rng(3)
    leg = robot.legs[0]
    lower, upper = leg.joint_limits.T.copy()
    lower[0], upper[0] = -math.pi, math.pi
    shape = (RANDOM_STATES, len(robot.legs), 3)
    q = rng.uniform(lower, upper, size=(4 * RANDOM_STATES * len(robot.legs), 3))
    ahead = foot_position(leg, q * [0.0, 1.0, 1.0])[:, 0]
    q = q[ahead > 1e-3][: shape[0] * shape[1]].reshape(shape)

    def evenly(largest: float) -> np.ndarray:
        return rng.uniform(-largest, largest, size=shape)

    attitude = rng.uniform(-1.0, 1.0, size=(RANDOM_STATES, 3))
    return States(
        robot,
        q,
        evenly(FASTEST),
        evenly(STRONGEST),
        evenly(LARGEST_FORCE),
        np.ones(shape[:2], dtype=bool),
        attitude * [FARTHEST_ROLL, FARTHEST_ROLL, math.pi],
    )
