"""Made-up recordings whose every number is known, so that reports can be checked against them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

from phasmid import kinematics
from phasmid.recording import new_recording
from phasmid.robot import Robot, load_robot, robot_to_toml
from phasmid.scenario import Scenario, load_scenario, scenario_to_toml


def ease(s: np.ndarray) -> np.ndarray:
    """The quintic from 0 to 1, at rest at both ends."""
    return s**3 * (10 - 15 * s + 6 * s**2)


def synthetic_walk(
    *,
    duration: float = 10.0,
    interval: float = 0.001,
    robot: Robot | None = None,
    scenario: Scenario | None = None,
    drop: Sequence[str] = (),
    slip: float = 0.0,
    **attributes: Any,
) -> Any:
    """A straight walk on level ground with plausible forces; nothing in it is simulated.

    Args:
        duration: Length [s].
        interval: Between samples [s].
        robot: The robot, by default the paper's.
        scenario: The scenario, by default the paper's.
        drop: Channels that are left out.
        slip: Way to the left that each foot slips in each stance, at constant speed [m].
        attributes: Added to the recording's own.
    """
    robot = robot or load_robot("phantomx-paper")
    scenario = (scenario or load_scenario("paper")).replace(duration=duration)
    gait = scenario.load_gait(len(robot.legs))
    stride = scenario.stride
    time = np.arange(round(duration / interval) + 1) * interval
    phase = time / stride.period
    stance = gait.stance(phase)
    own = gait.leg_phase(phase)
    swing = 1 - gait.duty_factor

    # Support, then transfer: the foot goes back under the body and forward over the ground.
    back = ease(np.clip((own - swing) / gait.duty_factor, 0, 1))
    forth = ease(np.clip(own / swing, 0, 1))
    x = stride.step_length * np.where(stance, 0.5 - back, forth - 0.5)
    lift = np.where(
        stance, 0.0, stride.step_height * np.sin(np.pi * np.clip(own / swing, 0, 1)) ** 2
    )
    feet = kinematics.neutral_feet(robot) + np.stack([x, np.zeros_like(x), lift], axis=-1)
    q = kinematics.joint_angles(robot.arrays, kinematics.hip_from_body(robot, feet))
    qd = np.gradient(q, interval, axis=0)

    step_time = gait.duty_factor * stride.period
    whole = np.floor(time / step_time + 1e-9)
    way = stride.step_length * (whole + ease(time / step_time - whole))
    height = -float(robot.arrays.neutral_foot[0, 2])
    body = np.stack([way, np.zeros_like(way), np.full_like(way, height)], axis=-1)
    slipping = slip * np.where(stance, (own - swing) / gait.duty_factor, 0.0)
    feet_world = feet + body[:, None, :]
    feet_world[..., 1] += slipping

    weight = robot.mass * scenario.model.gravity
    share = weight / stance.sum(axis=1)
    normal = np.where(stance, share[:, None], 0.0)
    force = np.zeros_like(feet)
    force[..., 2] = normal
    pull = np.array([0.02, 0.25, 0.10])
    model = np.where(stance[..., None], pull, pull / 5) * np.cos(q)
    channels = {
        "joint_position_target": q,
        "joint_velocity_target": qd,
        "joint_position": q,
        "joint_velocity": qd,
        "joint_torque": model + 0.01,
        "joint_torque_model": model,
        "foot_force": force,
        "foot_force_model": force * 1.02,
        "foot_normal_force": normal,
        "foot_normal_force_model": normal * 1.02,
        "foot_position": feet_world,
        "stance": stance,
        "contact": stance,
        "body_position": body,
        "body_velocity": np.gradient(body, interval, axis=0),
        "body_orientation": kinematics.yaw_quaternion(np.zeros_like(time)),
    }
    return new_recording(
        time,
        {name: array for name, array in channels.items() if name not in drop},
        {
            "scenario": scenario_to_toml(scenario, "robot.toml"),
            "robot": robot_to_toml(robot),
            "kind": "simulation",
            "ending": "COMPLETED",
            "ending_reason": f"the walk of {duration:g} s was completed.",
            "force_model": "minimum-norm",
            "drive": "prescribed",
            "servo": robot.servo.name,
            "phasmid_version": "0.1.0",
            "mujoco_version": "4.0.1",
            "time_step": interval,
        }
        | attributes,
    )


@pytest.fixture(scope="session")
def walk() -> Callable[..., Any]:
    """Makes recordings; arguments as `synthetic_walk`."""
    return synthetic_walk


@pytest.fixture(scope="session")
def paper_walk() -> Any:
    """The paper's ten seconds at one millisecond; not to be changed by a test."""
    return synthetic_walk()


@pytest.fixture(scope="session")
def short_walk() -> Any:
    """Four seconds, one whole cycle and another, at ten milliseconds."""
    return synthetic_walk(duration=4.0, interval=0.01)


@pytest.fixture(scope="session")
def eight_legs() -> tuple[Robot, Scenario]:
    """A robot of eight legs, and a walk for it."""
    gait = {"name": "tetrapod", "duty_factor": 0.5, "offsets": (0, 0.5) * 4}
    return load_robot("octopod"), load_scenario("paper").replace(gait=gait)
