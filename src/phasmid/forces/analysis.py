"""What a walk needs: model torques and foot forces over the whole trajectory."""

from __future__ import annotations

import json
from importlib.metadata import version

import numpy as np
from jaxtyping import Float

from phasmid.arguments import check_type
from phasmid.dynamics import BodyMotion, inverse_dynamics
from phasmid.errors import InvalidInput
from phasmid.forces.contacts import Contacts, JointLoad
from phasmid.forces.family import (
    ForceModel,
    Limited,
    WeightedMinimumNorm,
    force_model,
)
from phasmid.forces.servo_verdict import verdict_text
from phasmid.forces.sharing import share_load
from phasmid.forces.transfer import load_share
from phasmid.kinematics import jacobian
from phasmid.motion import Motion, Walk
from phasmid.recording import Recording, new_recording
from phasmid.robot import robot_to_toml
from phasmid.scenario import Scenario, check_scenario, scenario_to_toml


def analyse(scenario: Scenario, walk: Walk) -> Recording:
    """Torques and foot forces that the model asks of a walk, without simulating it.

    Inverse dynamics of the whole robot with its moving trunk gives the force and moment that the
    ground must exert; they are shared among the standing feet by the scenario's force model; the
    joints then carry what is left.

    Args:
        scenario: Tells whether the motion counts or only gravity, and how the load is shared.
        walk: The plan.

    Raises:
        InvalidInput: The walk was planned for another robot, gait or stride, or the load transfer
            takes longer than the gait allows, or torque limits shall count for a force model that
            knows none.
        InfeasibleLoad: The standing feet cannot give what the motion needs within the limits of
            the force model.

    Returns:
        The planned motion with ``joint_torque_model``, ``foot_force_model`` and
        ``foot_normal_force_model`` at the walk's samples.
    """
    check_scenario(scenario)
    check_type("walk", walk, (Walk,), "a plan", "phasmid.plan(scenario)")
    walk.check_planned_for(scenario)
    attributes = recording_attributes(scenario, walk) | {
        "kind": "model",
        "ending": "COMPLETED",
        "ending_reason": "The walk was analysed.",
    }
    return new_recording(walk.time, model_channels(scenario, walk), attributes)


def model_channels(scenario: Scenario, walk: Walk) -> dict[str, np.ndarray]:
    """The channels of a recording that follow from the plan alone, shapes as in a recording."""
    torque, force, normal_force = _torque_and_force(scenario, walk)
    return {
        "joint_position_target": walk.q,
        "joint_velocity_target": walk.qd,
        "joint_acceleration_target": walk.qdd,
        "joint_torque_model": torque,
        "foot_force_model": force,
        "foot_normal_force_model": normal_force,
        "foot_position": walk.foot_position,
        "stance": walk.stance,
        "body_position": walk.trunk.position,
        "body_velocity": walk.trunk.velocity,
        "body_orientation": walk.trunk.quaternion,
    }


def planned_torque(scenario: Scenario, walk: Walk) -> Float[np.ndarray, "samples legs 3"]:
    """Joint torques that the model asks of a walk [N·m], shape (N, L, 3); see `analyse`.

    Args:
        scenario: Tells whether the motion counts or only gravity, and how the load is shared.
        walk: The plan.

    Raises:
        InvalidInput: Torque limits shall count for a force model that knows none.
        InfeasibleLoad: The standing feet cannot give what the motion needs.
    """
    return _torque_and_force(scenario, walk)[0]


def planned_body(walk: Walk) -> BodyMotion:
    """The trunk's planned pose and motion."""
    trunk = walk.trunk
    return BodyMotion(
        position=trunk.position,
        rotation=trunk.rotation,
        velocity=trunk.velocity,
        angular_velocity=trunk.angular_velocity,
        acceleration=trunk.acceleration,
        angular_acceleration=trunk.angular_acceleration,
    )


def _torque_and_force(scenario: Scenario, walk: Walk) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joint torques [N·m], forces of the ground on the feet [N], and their normal parts [N].

    Torques and forces, in world axes, have the shape (N, L, 3). The ground is the planner's, which
    may take it for level.
    """
    model = scenario.model
    moving = 1.0 if model.body_acceleration == "included" else 0.0
    body = planned_body(walk)
    if not moving:
        body = BodyMotion.at_rest(body.position, body.rotation)
    motion = (walk.q, moving * walk.qd, moving * walk.qdd)
    g = model.gravity
    free_torque, wrench = inverse_dynamics(walk.robot, body, *motion, gravity=g)
    share = load_share(
        walk.gait, walk.time, period=scenario.stride.period, window=model.load_transfer
    )
    R_world_hip = body.rotation[:, None] @ walk.robot.arrays.R_body_hip
    counted = model.torque_limits == "counted"
    joints = JointLoad(
        jacobian=R_world_hip @ jacobian(walk.robot.arrays, walk.q),
        torque=free_torque,
        limit=walk.robot.servo.stall_torque if counted else np.inf,
    )
    feet, ground = walk.foot_position, scenario.planned_terrain()
    contacts = Contacts(
        feet=feet - body.position[:, None],
        share=share,
        normals=ground.normal(feet[..., 0], feet[..., 1]),
        friction=ground.friction(feet[..., 0], feet[..., 1]),
        leg_names=walk.robot.leg_names,
    )
    force = share_load(contacts, wrench, chosen_model(scenario), joints=joints, time=walk.time)
    return joints.with_ground(force), force, np.sum(force * contacts.normals, axis=-1)


def chosen_model(scenario: Scenario) -> ForceModel:
    """The scenario's member of the family, with its options.

    Raises:
        InvalidInput: Torque limits shall count, and it knows none.
    """
    model = scenario.model
    chosen = force_model(model.force_model)
    if model.torque_limits == "counted" and not isinstance(chosen, Limited):
        raise InvalidInput(
            f'torque_limits is "counted" and {chosen.name} knows no limits; it must be "ignored", '
            "or the force model one that knows them.",
            where="model.torque_limits",
            hint='force_model = "friction-cone"',
        )
    if isinstance(chosen, WeightedMinimumNorm):
        return WeightedMinimumNorm(model.tangential_weight)
    return chosen


def force_model_words(scenario: Scenario) -> str:
    """The scenario's force model and those of its options that count, such as
    ``friction-cone (friction 0.7)``.
    """
    model, options = scenario.model, []
    if model.force_model == WeightedMinimumNorm.name:
        options.append(f"tangential weight {model.tangential_weight:g}")
    if isinstance(force_model(model.force_model), Limited):
        options.append(f"friction {scenario.terrain.friction:g}")
        if model.torque_limits == "counted":
            options.append("torque limits")
    if model.load_transfer > 0:
        options.append(f"transfer {model.load_transfer:g} s")
    return f"{model.force_model} ({', '.join(options)})" if options else model.force_model


def recording_attributes(scenario: Scenario, walk: Motion) -> dict[str, str | int | float]:
    """Attributes that tell what was walked, enough to do it again.

    The robot stands there as its file gives it: the scenario's variants apply to it on reading. A
    trajectory does not tell which feet stand, so that there is no verdict on its servos.
    """
    return {
        **({"servo_verdict": verdict_text(scenario)} if isinstance(walk, Walk) else {}),
        "scenario": scenario_to_toml(scenario, "robot.toml"),
        "robot": robot_to_toml(scenario.base_robot()),
        "force_model": force_model_words(scenario),
        "leg_names": json.dumps(walk.robot.leg_names),
        "servo": walk.robot.servo.name,
        "phasmid_version": version("phasmid"),
    }
