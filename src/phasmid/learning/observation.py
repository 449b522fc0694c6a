"""Observations of a batch of robots: their names, and the functions that compute them."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.learning.control_period import clearance, into_body
from phasmid.learning.episodes import Constants, Episodes, States, uniform
from phasmid.learning.task import CORRECTIONS, Task
from phasmid.robot import JOINTS, Robot


class Observer:
    """Observations of N robots, with earlier ones where the task asks for them.

    Args:
        task: The task.
        robot: The robot, L legs.
        constants: Constants of the task.
        count: Number of robots, N.

    Attributes:
        names: Meaning of each number of an observation, shape (A,).
        privileged_names: Meaning of each number of a privileged observation, shape (P,).
        privileged: Latest privileged observations, shape (N, P).
    """

    def __init__(self, task: Task, robot: Robot, constants: Constants, count: int) -> None:
        latest, history = observation_names(task, robot), task.observation.history
        earlier = [f"{name}, {k} before" for k in range(1, history) for name in latest]
        self.names, self.privileged_names = latest + earlier, privileged_names(robot)
        self.privileged = np.zeros((count, len(self.privileged_names)))
        self._history = np.zeros((count, history, len(latest)))
        self._constants = constants

    @property
    def observations(self) -> Float[np.ndarray, "robots names"]:
        """Observations, the latest first."""
        return self._history.reshape(len(self._history), -1)

    def observe(self, e: Episodes, s: States, ids: np.ndarray, *, is_first: bool = False) -> None:
        """Add the latest observations of some robots; the first one stands for those before it."""
        self._history[ids, 1:] = self._history[ids, :-1]
        observe(self._constants, e, s, self._history[:, 0], self.privileged, ids)
        if is_first:
            self._history[ids, 1:] = self._history[ids, :1]


@compiled
def observe(
    c: Constants,
    e: Episodes,
    s: States,
    actor: np.ndarray,
    privileged: np.ndarray,
    ids: np.ndarray,
) -> None:
    """Write the latest observations.

    Args:
        c: Constants of the task.
        e: Episodes; their random numbers advance.
        s: States.
        actor: Written as of `observation_names`, shape (N, A).
        privileged: Written as of `privileged_names`, shape (N, P).
        ids: The robots.
    """
    joints, legs, r = len(c.neutral), len(c.lifts), c.task.randomisation
    for n in ids:
        quaternion, command = s.qpos[n, 3:7], e.command[n]
        gravity = into_body(quaternion, 0.0, 0.0, -1.0)
        row, k = actor[n], 0
        for i in range(3):
            noise = uniform(e.random, n, -r.gyro_noise, r.gyro_noise)
            row[k + i] = 0.25 * (s.qvel[n, 3 + i] + noise)
        k += 3
        for i in range(3):
            row[k + i] = gravity[i] + uniform(e.random, n, -r.gravity_noise, r.gravity_noise)
        k += 3
        for j in range(joints):
            noise = e.joint_offset[n, j] + uniform(e.random, n, -r.joint_noise, r.joint_noise)
            row[k + j] = s.qpos[n, 7 + j] - c.neutral[j] + noise
            row[k + joints + j] = 0.1 * s.qvel[n, 6 + j]
        k += 2 * joints
        row[k : k + e.action.shape[1]] = e.action[n]
        k += e.action.shape[1]
        for i in range(3):
            row[k + i] = command[i] / c.largest[i] if c.largest[i] > 0.0 else 0.0
        k += 3
        if c.task.observation.clock:
            is_moving = command[0] != 0.0 or command[1] != 0.0 or command[2] != 0.0
            angle = 2 * math.pi * e.phase[n]
            row[k] = math.sin(angle) if is_moving else 0.0
            row[k + 1] = math.cos(angle) if is_moving else 0.0
            k += 2
        if c.task.observation.contacts:
            row[k : k + legs] = e.contact[n]

        row, k = privileged[n], 9
        row[0], row[1], row[2] = into_body(quaternion, s.qvel[n, 0], s.qvel[n, 1], s.qvel[n, 2])
        row[3] = clearance(c, s.qpos[n])[1] - c.height
        row[4], row[5], row[6] = e.friction[n], e.mass[n], e.payload[n]
        row[7], row[8] = e.strength[n], e.gain[n]
        row[k : k + legs] = e.force[n]
        row[k + legs : k + 2 * legs] = e.contact[n]
        is_damaged = e.step[n] >= e.damage_step[n]
        for j in range(joints):
            row[k + 2 * legs + j] = e.dies[n, j] if is_damaged else 0.0


def joint_names(robot: Robot) -> list[str]:
    """Return the names of the joints, leg by leg, shape (3 L,)."""
    return [f"{leg}.{joint}" for leg in robot.leg_names for joint in JOINTS]


def action_names(task: Task, robot: Robot) -> list[str]:
    """Return the names of the actions, shape (B,)."""
    return joint_names(robot) if task.action.kind == "joint-offsets" else list(CORRECTIONS)


def observation_names(task: Task, robot: Robot) -> list[str]:
    """Return the names of the actor's latest observations, shape (A,)."""
    joints = joint_names(robot)
    names = [f"gyro.{axis} / 4" for axis in "xyz"]
    names += [f"gravity.{axis}" for axis in "xyz"]
    names += [f"{joint} position - neutral" for joint in joints]
    names += [f"{joint} velocity / 10" for joint in joints]
    names += [f"{name} last action" for name in action_names(task, robot)]
    names += [f"command.{axis} / largest" for axis in ("forward", "left", "yaw")]
    names += ["clock.sin", "clock.cos"] if task.observation.clock else []
    names += [f"{leg} contact" for leg in robot.leg_names] if task.observation.contacts else []
    return names


def privileged_names(robot: Robot) -> list[str]:
    """Return the names of the critic's privileged observations, shape (P,)."""
    names = [f"velocity.{axis}" for axis in ("forward", "left", "up")]
    names += ["height - neutral", "friction", "mass factor", "payload", "strength", "gain"]
    names += [f"{leg} force" for leg in robot.leg_names]
    names += [f"{leg} contact" for leg in robot.leg_names]
    return names + [f"{joint} dead" for joint in joint_names(robot)]
