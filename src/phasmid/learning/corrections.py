"""Locomotion controllers whose commands a policy corrects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from phasmid.control import LocomotionEngine
from phasmid.errors import InvalidInput
from phasmid.experiment import Command, JointTargets, Observation
from phasmid.learning.episodes import Episodes
from phasmid.learning.model import Motor
from phasmid.learning.physics import Physics
from phasmid.learning.task import CORRECTIONS, Task
from phasmid.robot import Robot
from phasmid.servo.law import inverse_law
from phasmid.servo.law_kernels import SLOW, goal_memory, goals_for_torque

UPDATE_PERIOD = 0.008
"""Update period of a batch's controllers, a multiple of both time steps of the physics [s]."""

LEAST_STEP_HEIGHT = 0.005
"""Least corrected step height [m]."""


def new_controller(
    robot: Robot, task: Task, update_period: float, gravity: float
) -> LocomotionEngine:
    """Return a locomotion controller with all its stages and a task's gait.

    Args:
        robot: The robot.
        task: Its ``[gait]`` is used.
        update_period: Time from one update to the next [s].
        gravity: Gravitational acceleration [m/s²].
    """
    gait = task.gait
    return LocomotionEngine(
        robot,
        gait=gait.name,
        period=gait.period,
        step_height=gait.step_height,
        update_period=update_period,
        gravity=gravity,
    )


def take_action(e: Episodes, actions: Float[np.ndarray, "robots actions"], ids: np.ndarray) -> None:
    """Write the actions of a control period, clipped to [-1, 1], into episodes."""
    e.previous_action[ids] = e.action[ids]
    e.action[ids] = np.clip(np.nan_to_num(actions[ids]), -1.0, 1.0)


def corrected(command: Command, action: Float[np.ndarray, " actions"], task: Task) -> Command:
    """Return a command with the corrections of an action.

    Args:
        command: The command.
        action: From -1 to 1, by `CORRECTIONS`.
        task: Its ``[corrections]`` scale the action.
    """
    scales = task.corrections
    change = {
        name: float(getattr(scales, name) * x) for name, x in zip(CORRECTIONS, action, strict=True)
    }
    added = change["forward"], 0.0, change["height"], change["roll"], change["pitch"], 0.0
    vx, vy, wz = ((1.0 + change["speed"]) * v for v in command.velocity)
    height = task.gait.step_height if command.step_height is None else command.step_height
    x, y, z, roll, pitch, yaw = (a + b for a, b in zip(command.pose, added, strict=True))
    return replace(
        command,
        velocity=(vx, vy, wz),
        pose=(x, y, z, roll, pitch, yaw),
        step_height=max(height + change["step_height"], LEAST_STEP_HEIGHT),
    )


def motor_goals(targets: JointTargets, motor: Motor) -> Float[np.ndarray, "legs 3"]:
    """Return the goals with which motors at fast fidelity give the torques of targets [rad]."""
    speed, torque = targets.velocity, targets.torque
    if torque is None:
        return targets.position
    push = torque + motor.damping * speed
    direction = np.clip(speed / SLOW, -1.0, 1.0)
    push = push + direction * (motor.friction + motor.load_loss * np.abs(push))
    return targets.position + np.clip(push, -motor.stall, motor.stall) / motor.gain


class Controllers:
    """The controllers of a batch of robots.

    Args:
        task: The task.
        physics: The robots.

    Raises:
        InvalidInput: A control period is no whole number of updates.
    """

    def __init__(self, task: Task, physics: Physics) -> None:
        self._task, self._physics = task, physics
        self._updates = round(physics.constants.dt / UPDATE_PERIOD)
        if abs(self._updates * UPDATE_PERIOD - physics.constants.dt) > 1e-9:
            raise InvalidInput(
                f"rate is {task.rate:g}; with command corrections 1/rate must be a multiple of "
                f"{1000 * UPDATE_PERIOD:g} ms.",
                hint=f"rate = {1 / (max(self._updates, 1) * UPDATE_PERIOD):g}",
            )
        robot, count = physics.robot, len(physics.qpos)
        gravity = task.scenario().model.gravity
        self._controllers = [
            new_controller(robot, task, UPDATE_PERIOD, gravity) for _ in range(count)
        ]
        self._law = None
        if physics.is_full:
            self._law = inverse_law(robot.servo)
        self._time = np.zeros(count)
        self._memory = np.stack([goal_memory(3 * len(robot.legs))] * count)

    def begin(self, ids: np.ndarray) -> None:
        """Begin with robots as they stand.

        Args:
            ids: The robots.
        """
        self._memory[ids], self._time[ids] = np.nan, 0.0
        for n in ids:
            self._controllers[n].reset(self._observe(n))
        self._keep_phases(ids)

    def advance(self, actions: Float[np.ndarray, "robots actions"], ids: np.ndarray) -> None:
        """Advance robots by a control period.

        Args:
            actions: Shape (N, B); clipped to [-1, 1].
            ids: The robots.
        """
        e, physics = self._physics.episodes, self._physics
        take_action(e, actions, ids)
        e.work[ids], e.saturated[ids] = 0.0, 0.0
        commands = {}
        for n in ids:
            vx, vy, wz = e.command[n].tolist()
            commands[n] = corrected(Command((vx, vy, wz)), e.action[n], self._task)
        for _ in range(self._updates):
            e.previous_target[ids] = e.target[ids]
            for n in ids:
                # A robot whose state is no longer finite has fallen.
                if np.isfinite(physics.qpos[n]).all() and np.isfinite(physics.qvel[n]).all():
                    e.target[n] = self._goals(n, commands[n])
            physics.advance(ids, physics.steps // self._updates)
            self._time[ids] += UPDATE_PERIOD
        self._keep_phases(ids)

    def _goals(self, n: int, command: Command) -> np.ndarray:
        """Return the servos' goals after an update of robot n's controller [rad]."""
        targets = self._controllers[n].update(self._observe(n), command)
        if self._law is None or targets.torque is None:
            return motor_goals(targets, self._physics.motor).ravel()
        rows = (x.reshape(1, -1) for x in (targets.position, targets.velocity, targets.torque))
        return goals_for_torque(*rows, self._law, UPDATE_PERIOD, self._memory[n])[0]

    def _observe(self, n: int) -> Observation:
        """Return exact sensor readings of robot n."""
        physics, e = self._physics, self._physics.episodes
        legs = len(physics.robot.legs)
        qpos, qvel = physics.qpos[n].copy(), physics.qvel[n].copy()
        contact = physics.states.sensors[n, : 4 * legs].reshape(legs, 4)
        return Observation(
            time=float(self._time[n]),
            joint_position=qpos[7:].reshape(legs, 3),
            joint_velocity=qvel[6:].reshape(legs, 3),
            joint_load=(e.torque[n] / physics.constants.stall).reshape(legs, 3),
            orientation=qpos[3:7],
            angular_velocity=qvel[3:6],
            contact=contact[:, 0] > 0,
            foot_normal_force=np.maximum(contact[:, 3], 0.0),
        )

    def _keep_phases(self, ids: np.ndarray) -> None:
        for n in ids:
            self._physics.episodes.phase[n] = self._controllers[n].state.clock.phase
