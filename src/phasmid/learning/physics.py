"""Physics of a batch of robots: MuJoCo's batch, and the servos of every robot."""

from __future__ import annotations

import math
from typing import NamedTuple

import mujoco
import numpy as np
from jaxtyping import Int
from mujoco.batch import Batch

from phasmid.compiled import compiled
from phasmid.kinematics import yaw_quaternion
from phasmid.learning.episodes import Episodes, States, empty_episodes, task_constants
from phasmid.learning.model import (
    FAST_STEP,
    LEAST_PAYLOAD,
    PAYLOAD_SIDE,
    Motor,
    learning_model,
    longest_full_step,
    robot_motor,
)
from phasmid.learning.observation import action_names
from phasmid.learning.task import Task
from phasmid.servo.law import SERVO_STATE, servo_parameters
from phasmid.servo.law_kernels import Shutdown, servo_step
from phasmid.simulation.loop import collect_engine_warnings

SLOW = 1.0
"""Speed from which on a motor's whole friction acts [rad/s]; below it, a part of it, so that time
steps of 4 ms resolve it."""


class Servos(NamedTuple):
    """Servos of N robots with J joints at full fidelity; the columns of `servo_step`.

    Attributes:
        parameters: Records of `servo_parameters`, shape (N, 1).
        state: Records of `SERVO_STATE`, shape (N, J).
        delayed: Goals on their way [rad], shape (N, J, D).
    """

    parameters: np.ndarray
    state: np.ndarray
    delayed: np.ndarray


class Physics:
    """N robots, advanced together.

    Args:
        task: Robot and fidelity.
        count: Number of robots, N.
        threads: Number of threads; the results do not depend on it.

    Attributes:
        robot: The robot, L legs.
        constants: Constants of the task.
        episodes: The robots' episodes.
        batch: MuJoCo's batch.
        states: States of the robots, views of MuJoCo's memory.
        steps: Time steps of a control period.
        motor: The robot's motor at fast fidelity.
    """

    def __init__(self, task: Task, count: int, threads: int = 1) -> None:
        experiment = task.scenario().build()
        self.robot = robot = experiment.robot
        self.constants = task_constants(task, robot)
        self.episodes = empty_episodes(count, len(robot.legs), len(action_names(task, robot)))
        self.is_full = task.fidelity == "full"
        dt = self.constants.dt
        longest = longest_full_step(experiment) if self.is_full else FAST_STEP
        self.steps = math.ceil(dt / longest - 1e-9)
        dt /= self.steps
        self.model = model = learning_model(
            experiment, self.constants.terrain, full=self.is_full, dt=dt
        )
        self.batch = batch = Batch(model, count, threads)
        self.states = States(*map(batch.bind, ("qpos", "qvel", "sensordata", "qfrc_applied")))
        self.qpos, self.qvel = self.states.qpos, self.states.qvel
        self._friction = batch.expand("geom_friction")
        self._masses = [batch.expand(name) for name in ("body_mass", "body_inertia", "body_ipos")]
        self._feet = np.flatnonzero(model.geom_priority > 0)
        self.motor = robot_motor(robot)
        self._servos: Servos | None = None
        if self.is_full:
            servo, joints = robot.servo, 3 * len(robot.legs)
            parameters = servo_parameters(servo, dt)
            self._own = parameters[0].copy()
            self._servos = Servos(
                np.tile(parameters, (count, 1)),
                np.zeros((count, joints), SERVO_STATE),
                np.zeros((count, joints, round(servo.delay / dt))),
            )

    def place(self, ids: Int[np.ndarray, " some"]) -> None:
        """Place robots at rest on their feet, with the properties that their episodes drew."""
        e, c, model, batch = self.episodes, self.constants, self.model, self.batch
        batch.reset(ids, stage=mujoco.mjtStage.mjSTAGE_NONE.value)
        self.qpos[ids, :2] = c.terrain.origins[e.level[ids], e.kind[ids]]
        self.qpos[ids, 2] = c.height
        e.position[ids] = self.qpos[ids, :3]
        self.qpos[ids, 3:7] = yaw_quaternion(e.heading[ids])
        self.qpos[ids, 7:] = c.neutral
        self._friction[ids[:, None], self._feet, 0] = e.friction[ids, None]
        mass, inertia, com = self._masses
        mass[ids] = model.body_mass * e.mass[ids, None]
        inertia[ids] = model.body_inertia * e.mass[ids, None, None]
        trunk, payload = model.body("trunk").id, model.body("payload").id
        com[ids, trunk] = model.body_ipos[trunk] + e.centre_of_mass[ids]
        mass[ids, payload] = e.payload[ids] + LEAST_PAYLOAD
        inertia[ids, payload] = mass[ids, payload, None] * PAYLOAD_SIDE**2 / 6
        batch.set_const(ids)
        if self._servos is not None:
            parameters, state, delayed = self._servos
            parameters[ids, 0] = self._own
            parameters["voltage"][ids, 0] = self._own["voltage"] * e.strength[ids]
            for name in ("gain", "change_gain"):
                parameters[name][ids, 0] = self._own[name] * e.gain[ids]
            parameters["slope"][ids, 0] = self._own["slope"] / e.gain[ids, None]
            state[ids] = np.zeros((), SERVO_STATE)
            state["angle"][ids], state["temperature"][ids] = c.neutral, self._own["ambient"]
            delayed[ids] = c.neutral[:, None]
        batch.forward(ids)

    def advance(self, ids: Int[np.ndarray, " some"], steps: int | None = None) -> None:
        """Advance robots by time steps with their present targets.

        Args:
            ids: The robots. One whose state is no longer finite is left as it is.
            steps: Number of time steps; None: a control period.
        """
        e, c, batch = self.episodes, self.constants, self.batch
        period = c.dt / self.steps
        # MuJoCo prints and logs warnings of robots that diverge; their episodes end.
        with collect_engine_warnings([]):
            for step in range(steps or self.steps):
                if self._servos is None:
                    apply_motors(self.motor, e, self.states, step, period, ids)
                else:
                    apply_servos(c.limits, self._servos, e, self.states, step, period, ids)
                batch.step(ids)


@compiled
def apply_motors(
    motor: Motor,
    e: Episodes,
    s: States,
    step: int,
    dt: float,
    ids: np.ndarray,
) -> None:
    """Apply the motors' torques for the next time step, at fast fidelity.

    The output follows the position error in proportion up to the stall torque. MuJoCo adds the
    damping of the motor's counter voltage.

    Args:
        motor: The robot's motor.
        e: Episodes, changed in place.
        s: States; the torques are written.
        step: Time step of the control period.
        dt: Time step [s].
        ids: The robots.
    """
    joints = e.target.shape[1]
    for n in ids:
        strength = e.strength[n]
        is_late = step * dt < motor.delay + e.latency[n] - 1e-9
        gain, stall = motor.gain * e.gain[n] * strength, motor.stall * strength
        is_damaged = e.step[n] >= e.damage_step[n]
        for j in range(joints):
            target = e.previous_target[n, j] if is_late else e.target[n, j]
            speed = s.qvel[n, 6 + j]
            push = gain * (target - e.joint_offset[n, j] - s.qpos[n, 7 + j])
            if is_damaged and e.dies[n, j] > 0.0:
                push = 0.0
            elif abs(push) >= stall:
                push = stall if push > 0.0 else -stall
                e.saturated[n, j] += dt
            hold = motor.friction + motor.load_loss * abs(push)
            torque = push - hold * min(max(speed / SLOW, -1.0), 1.0)
            s.force[n, 6 + j] = torque
            torque -= motor.damping * speed
            e.torque[n, j] = torque
            e.work[n] += max(torque * speed, 0.0) * dt


@compiled
def apply_servos(
    limits: np.ndarray,
    servos: Servos,
    e: Episodes,
    s: States,
    step: int,
    dt: float,
    ids: np.ndarray,
) -> None:
    """Advance the servos by a time step and apply their torques, at full fidelity.

    Args:
        limits: Lowest and highest joint angle [rad], shape (2, 3 L).
        servos: Changed in place.
        e: Episodes, changed in place.
        s: States; the torques are written.
        step: Time step of the control period.
        dt: Time step [s].
        ids: The robots.
    """
    joints = e.target.shape[1]
    goal = np.empty(joints)
    for n in ids:
        is_late = step * dt < e.latency[n] - 1e-9
        for j in range(joints):
            target = e.previous_target[n, j] if is_late else e.target[n, j]
            goal[j] = target - e.joint_offset[n, j]
        parameters, state = servos.parameters[n], servos.state[n]
        if e.step[n] >= e.damage_step[n]:
            for j in range(joints):
                if e.dies[n, j] > 0.0:
                    state[j].shutdown = Shutdown.FAILURE
        servo_step(
            goal,
            s.qpos[n, 7:],
            s.qvel[n, 6:],
            limits,
            parameters,
            state,
            servos.delayed[n],
            s.force[n, 6:],
        )
        for j in range(joints):
            torque = s.force[n, 6 + j]
            e.torque[n, j] = torque
            e.work[n] += max(torque * s.qvel[n, 6 + j], 0.0) * dt
            if abs(state[j].duty) >= parameters[0].most:
                e.saturated[n, j] += dt
