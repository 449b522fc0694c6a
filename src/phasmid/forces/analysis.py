"""Model torques and foot forces of a planned walk, and of a robot at rest."""

from __future__ import annotations

import json
from importlib.metadata import version
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from phasmid.arguments import checked
from phasmid.dynamics import BodyMotion, inverse_dynamics
from phasmid.errors import InvalidInput
from phasmid.experiment import Experiment, ScenarioLike, built
from phasmid.forces.contacts import Contacts, JointLoad, contact_jacobian, contact_points
from phasmid.forces.models import ForceModel, Limited, WeightedMinimumNorm, force_model
from phasmid.forces.sharing import share_load
from phasmid.forces.transfer import load_share
from phasmid.motion import Motion, Walk, progress
from phasmid.recording import Recording, new_recording
from phasmid.robot import robot_to_toml
from phasmid.terrain import Ground


class ModelLoad(NamedTuple):
    """Model torques and foot forces, with any leading axes.

    Attributes:
        torque: Joint torques [N·m], shape (..., L, 3).
        force: Ground reaction forces, world axes [N], shape (..., L, 3).
        normal_force: Their components along the ground's normals [N], shape (..., L).
    """

    torque: Float[np.ndarray, "*batch legs 3"]
    force: Float[np.ndarray, "*batch legs 3"]
    normal_force: Float[np.ndarray, "*batch legs"]


@checked
def analyse(scenario: ScenarioLike | Experiment, walk: Walk) -> Recording:
    """Return the model torques and foot forces of a walk, without simulation.

    Inverse dynamics of the whole robot gives the wrench of the ground. The experiment's force model
    distributes it among the standing feet, and the joints carry the rest.

    Args:
        scenario: The scenario, or its experiment.
        walk: The plan.

    Raises:
        InvalidInput: The walk was planned for another robot, gait or stride, the load transfer
            takes longer than the gait allows, or torque limits are counted by a force model
            without limits.
        InfeasibleLoad: The standing feet cannot give the wrench within the limits of the force
            model.

    Returns:
        The planned motion with ``joint_torque_model``, ``foot_force_model`` and
        ``foot_normal_force_model`` at the walk's samples.
    """
    experiment = built(scenario)
    walk = walk.for_experiment(experiment)
    ending = {"ending": "COMPLETED", "ending_reason": "The walk was analysed."}
    attributes = recording_attributes(experiment, walk) | {"kind": "model"} | ending
    return new_recording(walk.time, model_channels(experiment, walk), attributes)


def model_channels(experiment: Experiment, walk: Walk) -> dict[str, np.ndarray]:
    """Return the channels of a recording that follow from the plan."""
    load = planned_load(experiment, walk)
    return {
        "joint_position_target": walk.q,
        "joint_velocity_target": walk.qd,
        "joint_acceleration_target": walk.qdd,
        "joint_torque_model": load.torque,
        "foot_force_model": load.force,
        "foot_normal_force_model": load.normal_force,
        "foot_position": walk.foot_position,
        "stance": walk.stance,
        "body_position": walk.trunk.position,
        "body_velocity": walk.trunk.velocity,
        "body_orientation": walk.trunk.quaternion,
    }


def planned_load(experiment: Experiment, walk: Walk) -> ModelLoad:
    """Return model torques and foot forces of a walk on the planned ground; see `analyse`."""
    body, motion = planned_body(walk), (walk.q, walk.qd, walk.qdd)
    if experiment.analysis.body_acceleration != "included":
        still = np.zeros_like(walk.q)
        body, motion = BodyMotion.at_rest(body.position, body.rotation), (walk.q, still, still)
    window = experiment.analysis.load_transfer
    share = load_share(walk.gait, walk.time, period=experiment.course.stride.period, window=window)
    ground = experiment.world.planned_terrain
    return _load(experiment, body, motion, walk.foot_position, share, ground, time=walk.time)


def planned_body(walk: Walk) -> BodyMotion:
    """Return the planned motion of the trunk."""
    trunk = walk.trunk
    return BodyMotion(
        trunk.position,
        trunk.rotation,
        trunk.velocity,
        trunk.angular_velocity,
        trunk.acceleration,
        trunk.angular_acceleration,
    )


def holding_forces(
    experiment: Experiment,
    position: Float[np.ndarray, "3"],
    rotation: Float[np.ndarray, "3 3"],
    q: Float[np.ndarray, "legs 3"],
    feet: Float[np.ndarray, "legs 3"],
    stance: Bool[np.ndarray, " legs"],
    ground: Ground,
) -> ModelLoad:
    """Return joint torques and foot forces of a robot at rest.

    Args:
        experiment: Its gravity, force model and the options of that are used.
        position: Trunk in the world [m], shape (3,).
        rotation: ``R_world_body``, shape (3, 3).
        q: Joint angles [rad], shape (L, 3).
        feet: Feet in the world [m], shape (L, 3).
        stance: Feet that stand, shape (L,).
        ground: The ground.

    Raises:
        InvalidInput: Torque limits are counted by a force model without limits.
        InfeasibleLoad: The standing feet cannot hold the robot within the model's limits.
    """
    body, still = BodyMotion.at_rest(position, rotation), np.zeros_like(q)
    return _load(experiment, body, (q, still, still), feet, stance, ground)


def _load(
    experiment: Experiment,
    body: BodyMotion,
    motion: tuple[np.ndarray, np.ndarray, np.ndarray],
    feet: np.ndarray,
    share: np.ndarray,
    ground: Ground,
    time: np.ndarray | None = None,
) -> ModelLoad:
    """Return the load of a body motion and joint motion (q, qd, qdd), with any leading axes."""
    robot = experiment.robot
    needed = inverse_dynamics(robot, body, *motion, gravity=experiment.world.gravity)
    counted = experiment.analysis.torque_limits == "counted"
    normals = ground.normal(feet[..., 0], feet[..., 1])
    joints = JointLoad(
        jacobian=contact_jacobian(robot, motion[0], body.rotation, normals),
        torque=needed.joint_torque,
        limit=robot.arrays.stall_torque if counted else np.inf,
    )
    contacts = Contacts(
        feet=contact_points(robot, feet, normals) - body.position[..., None, :],
        share=share,
        normals=normals,
        friction=ground.friction(feet[..., 0], feet[..., 1]),
        leg_names=robot.leg_names,
    )
    force = share_load(contacts, needed.wrench, chosen_model(experiment), joints=joints, time=time)
    return ModelLoad(joints.with_ground(force), force, np.sum(force * contacts.normals, axis=-1))


def chosen_model(experiment: Experiment) -> ForceModel:
    """Return the experiment's force model with its options.

    Raises:
        InvalidInput: Torque limits are counted, and the model has none.
    """
    model = experiment.analysis
    chosen = force_model(model.force_model)
    if model.torque_limits == "counted" and not isinstance(chosen, Limited):
        raise InvalidInput(
            f'torque_limits is "counted" and {chosen.name} has no limits; it must be "ignored", '
            "or the force model one with limits.",
            where="model.torque_limits",
            hint='force_model = "friction-cone"',
        )
    if isinstance(chosen, WeightedMinimumNorm):
        return WeightedMinimumNorm(model.tangential_weight)
    return chosen


def force_model_words(experiment: Experiment) -> str:
    """Return the force model and its effective options: ``friction-cone (friction 0.7)``."""
    model, options = experiment.analysis, []
    if model.force_model == WeightedMinimumNorm.name:
        options.append(f"tangential weight {model.tangential_weight:g}")
    if isinstance(force_model(model.force_model), Limited):
        options.append(f"friction {experiment.world.terrain.coefficient:g}")
        if model.torque_limits == "counted":
            options.append("torque limits")
    if model.load_transfer > 0:
        options.append(f"transfer {model.load_transfer:g} s")
    return f"{model.force_model} ({', '.join(options)})" if options else model.force_model


def recording_attributes(experiment: Experiment, walk: Motion) -> dict[str, str | int | float]:
    """Return the attributes with which a recording's motion can be repeated.

    The robot is that of its file: the scenario's variants apply when it is read.
    """
    planned: dict[str, str | int | float] = {}
    if isinstance(walk, Walk):
        steps = progress(walk.gait, walk.experiment.course.stride, np.array(experiment.duration))
        planned = {"planned_steps": float(steps.position)}
    return {
        **planned,
        "scenario": experiment.source.text(),
        "robot": robot_to_toml(experiment.file_robot),
        "force_model": force_model_words(experiment),
        "leg_names": json.dumps(walk.robot.leg_names),
        "servo": walk.robot.servo.name,
        "phasmid_version": version("phasmid"),
    }
