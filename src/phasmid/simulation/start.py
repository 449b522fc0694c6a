"""Where the robot stands before it walks."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.arguments import numbers
from phasmid.errors import InvalidInput
from phasmid.kinematics import (
    body_from_hip,
    foot_position,
    hip_from_body,
    joint_angles,
    neutral_feet,
    rotation_rpy,
)
from phasmid.motion import (
    JointTrajectory,
    Motion,
    SampledMotion,
    SampledTrajectory,
    TrunkMotion,
)
from phasmid.robot import Robot
from phasmid.scenario import Scenario

DEEPEST_START = 0.002
"""How far a foot may start below the terrain; so far its contact gently pushes it out [m]."""


def raised(scenario: Scenario, start: SampledMotion) -> float:
    """How much higher than planned the robot starts [m].

    Args:
        scenario: Tells the height of the start.
        start: The walk, sampled at its start.
    """
    height = scenario.simulation.start_height
    return 0.0 if height is None else height - float(start.trunk.position[0, 2])


def check_start(scenario: Scenario, walk: Motion) -> None:
    """Refuse a start in which a foot is inside the ground.

    Raises:
        InvalidInput: With the deepest foot, and the height at which none would be.
    """
    start = walk.sample(np.zeros(1))
    x, y, z = np.moveaxis(start.foot_position[0], -1, 0)
    depth = scenario.load_terrain().height(x, y) - z - raised(scenario, start)
    leg = int(np.argmax(depth))
    if depth[leg] > DEEPEST_START:
        height = float(start.trunk.position[0, 2]) + raised(scenario, start) + depth[leg]
        enough = math.ceil(1000 * height - 1e-6)
        raise InvalidInput(
            f"{walk.robot.legs[leg].name} foot starts {1000 * depth[leg]:.0f} mm below the "
            "terrain.",
            where="terrain",
            hint=f"raise start height to {enough / 1000:.3f} m (start_height_mm = {enough})",
        )


@dataclass(frozen=True, eq=False)
class HeldPose(JointTrajectory):
    """Joints that stay where they are, with the trunk where the ground lets it be.

    Attributes:
        trunk: Of the robot at rest, shapes (1, 3).
    """

    trunk: TrunkMotion

    def sample(self, time: Float[np.ndarray, " times"]) -> SampledTrajectory:
        """The pose at some times.

        Args:
            time: [s], shape (M,).
        """
        time = np.asarray(time, dtype=float)
        still = np.zeros((len(time), 3))
        position = still + self.trunk.position
        trunk = TrunkMotion(position, still, still, still + self.trunk.attitude, still, still)
        return SampledTrajectory(self.robot, time, *self.angles(time), trunk)


def standing(
    scenario: Scenario, robot: Robot, q: Float[np.ndarray, "legs 3"] | None = None
) -> HeldPose:
    """The robot at rest where a run begins: at the world's origin, all feet near the ground.

    The trunk lies parallel to the plane through the ground under the feet, as low as the highest
    ground under any of them, and under the trunk itself, allows.

    Args:
        scenario: Tells the ground.
        robot: The robot, L legs.
        q: Joint angles [rad], shape (L, 3); None: those with which its feet are at neutral.

    Raises:
        InvalidInput: The angles are no L x 3 finite numbers.
        InfeasibleWalk: They pass the joints' limits.
    """
    if q is None:
        q = joint_angles(robot.arrays, hip_from_body(robot, neutral_feet(robot)))
    q = numbers(q, "start")
    if q.shape != (len(robot.legs), 3):
        raise InvalidInput(
            f"start has shape {q.shape}; it must be ({len(robot.legs)}, 3) joint angles in rad."
        )
    ground = scenario.load_terrain()
    feet = body_from_hip(robot, foot_position(robot.arrays, q))
    corners = np.array([[x, y, -1.0] for x in (-1.0, 1.0) for y in (-1.0, 1.0)])
    belly = corners * robot.body.size / 2
    attitude = np.zeros(3)
    # The feet's places shift a little with the tilt: the third round moves them by no micrometre.
    for _ in range(0 if ground.is_level else 3):
        x, y, _z = (feet @ _rotation(attitude).T).T
        columns = np.stack([x, y, np.ones_like(x)], axis=-1)
        a, b, _c = np.linalg.lstsq(columns, ground.height(x, y), rcond=None)[0]
        length = math.sqrt(1 + a * a + b * b)
        attitude = np.array([math.asin(b / length), math.atan2(-a, 1.0), 0.0])
    x, y, z = (np.vstack([feet, belly]) @ _rotation(attitude).T).T
    height = float((ground.height(x, y) - z).max())
    still = np.zeros((1, 3))
    position = np.array([[0.0, 0.0, height]])
    trunk = TrunkMotion(position, still, still, attitude[None], still, still)
    return HeldPose(robot, np.array([0.0, 1.0]), np.stack([q, q]), trunk)


def _rotation(attitude: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """``R_world_body`` of roll, pitch and yaw."""
    return rotation_rpy(*np.moveaxis(attitude[None], -1, 0))[0]
