"""What a walk needs: model torques and foot forces over the whole trajectory."""

from __future__ import annotations

from importlib.metadata import version

import numpy as np

from phasmid.dynamics import BodyMotion, inverse_dynamics
from phasmid.forces.minimum_norm import minimum_norm
from phasmid.kinematics import rotation_rpy, yaw_quaternion
from phasmid.motion import Walk
from phasmid.recording import Recording, new_recording
from phasmid.robot import robot_to_toml
from phasmid.scenario import Scenario, scenario_to_toml


def analyse(scenario: Scenario, walk: Walk) -> Recording:
    """Torques and foot forces that the model asks of a walk, without simulating it.

    Inverse dynamics of the whole robot with its moving trunk gives the force and moment that the
    ground must exert; they are shared among the standing feet by the scenario's force model; the
    joints then carry what is left.

    Args:
        scenario: Tells whether the motion counts or only gravity, and how the load is shared.
        walk: The plan.

    Raises:
        InvalidInput: The walk was planned for another robot, gait or stride.

    Returns:
        The planned motion with ``joint_torque_model``, ``foot_force_model`` and
        ``foot_normal_force_model`` at the walk's samples.
    """
    walk.check_planned_for(scenario)
    attributes = recording_attributes(scenario, walk) | {
        "kind": "model",
        "ending": "COMPLETED",
        "ending_reason": "The walk was analysed.",
    }
    return new_recording(walk.time, model_channels(scenario, walk), attributes)


def model_channels(scenario: Scenario, walk: Walk) -> dict[str, np.ndarray]:
    """The channels of a recording that follow from the plan alone, shapes as in a recording."""
    torque, force = _torque_and_force(scenario, walk)
    return {
        "joint_position_target": walk.q,
        "joint_velocity_target": walk.qd,
        "joint_acceleration_target": walk.qdd,
        "joint_torque_model": torque,
        "foot_force_model": force,
        "foot_normal_force_model": force[..., 2],
        "foot_position": walk.foot_position,
        "stance": walk.stance,
        "body_position": walk.trunk.position,
        "body_velocity": walk.trunk.velocity,
        "body_orientation": yaw_quaternion(walk.trunk.yaw),
    }


def _torque_and_force(scenario: Scenario, walk: Walk) -> tuple[np.ndarray, np.ndarray]:
    """Joint torques [N·m] and forces of the ground on the feet in world axes [N], (N, L, 3)."""
    model = scenario.model
    moving = 1.0 if model.body_acceleration == "included" else 0.0
    trunk, zero = walk.trunk, np.zeros(len(walk.time))
    body = BodyMotion(
        position=trunk.position,
        rotation=rotation_rpy(zero, zero, trunk.yaw),
        velocity=moving * trunk.velocity,
        angular_velocity=np.stack([zero, zero, moving * trunk.yaw_rate], axis=-1),
        acceleration=moving * trunk.acceleration,
        angular_acceleration=np.stack([zero, zero, moving * trunk.yaw_acceleration], axis=-1),
    )
    motion = (walk.q, moving * walk.qd, moving * walk.qdd)
    g = model.gravity
    _, wrench = inverse_dynamics(walk.robot, body, *motion, gravity=g)
    feet = walk.foot_position - trunk.position[:, None]
    force = minimum_norm(feet, walk.stance, wrench)
    torque, _ = inverse_dynamics(walk.robot, body, *motion, foot_force=force, gravity=g)
    return torque, force


def recording_attributes(scenario: Scenario, walk: Walk) -> dict[str, str | int | float]:
    """Attributes that tell what was walked, enough to do it again.

    The robot stands there as its file gives it: the scenario's variants apply to it on reading.
    """
    return {
        "scenario": scenario_to_toml(scenario, "robot.toml"),
        "robot": robot_to_toml(scenario.base_robot()),
        "force_model": scenario.model.force_model,
        "servo": walk.robot.servo.name,
        "phasmid_version": version("phasmid"),
    }
