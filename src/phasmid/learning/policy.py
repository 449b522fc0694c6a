"""Learned policies: ONNX files, and the controller that runs one."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from phasmid.control import LocomotionEngine
from phasmid.errors import InvalidInput
from phasmid.experiment import Command, JointTargets, Observation
from phasmid.extras import install_hint
from phasmid.learning.control_period import begin_period
from phasmid.learning.corrections import corrected, new_controller, take_action
from phasmid.learning.episodes import States, empty_episodes, task_constants
from phasmid.learning.observation import Observer, action_names
from phasmid.learning.task import Task
from phasmid.robot import Robot
from phasmid.units import STANDARD_GRAVITY

TASK_KEY = "phasmid_task"
"""Metadata of an ONNX file that holds the task as JSON."""

ONE = np.zeros(1, np.int64)
"""Number of the only robot."""


class Policy:
    """A network that returns actions for observations; a function of `phasmid.learning.assess`.

    Args:
        source: Path of an ONNX file with one input (N, A) and one output (N, 3 L), or the name of
            a policy that comes with phasmid.

    Attributes:
        task: The task for which it was trained; None where the file names none.
        observations: Number of observations; None where the file leaves it open.
        size: Of the file [bytes].

    Raises:
        InvalidInput: There is no such file, or it is no policy.
    """

    def __init__(self, source: str | Path) -> None:
        try:
            import onnxruntime
        except ModuleNotFoundError as error:
            raise InvalidInput(
                "policies need onnxruntime, which is not installed.",
                hint=install_hint("learn"),
            ) from error
        path = _find(source)
        content = path.read_bytes()
        self.size = len(content)
        options = onnxruntime.SessionOptions()
        # A small network on one thread takes less time than waking a second one.
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        try:
            self._session = onnxruntime.InferenceSession(content, options)
        except Exception as error:
            raise InvalidInput(
                f"{path.name} is not an ONNX file that onnxruntime can run.", where=str(path)
            ) from error
        inputs, outputs = self._session.get_inputs(), self._session.get_outputs()
        if len(inputs) != 1 or len(outputs) != 1 or len(inputs[0].shape) != 2:
            raise InvalidInput(
                f"{path.name} has {len(inputs)} inputs and {len(outputs)} outputs; a policy has "
                "one of each, of two axes.",
                where=str(path),
            )
        self._input, width = inputs[0].name, inputs[0].shape[1]
        self.observations = width if isinstance(width, int) else None
        stored = self._session.get_modelmeta().custom_metadata_map.get(TASK_KEY)
        self.task = None if stored is None else Task.model_validate(json.loads(stored))

    def __call__(self, observations: np.ndarray) -> np.ndarray:
        """Return actions (N, 3 L) for observations (N, A)."""
        feed = {self._input: np.asarray(observations, np.float32)}
        actions: np.ndarray = self._session.run(None, feed)[0]
        return actions


def policy_names() -> tuple[str, ...]:
    """Return the names of the policies that come with phasmid."""
    folder = resources.files("phasmid.learning") / "policies"
    return tuple(sorted(p.name[:-5] for p in folder.iterdir() if p.name.endswith(".onnx")))


def _find(source: str | Path) -> Path:
    if str(source) in policy_names():
        return Path(str(resources.files("phasmid.learning") / "policies" / f"{source}.onnx"))
    path = Path(source)
    if not path.is_file():
        raise InvalidInput(
            f'there is no policy "{source}"; it must be an ONNX file or one of: '
            f"{', '.join(policy_names())}."
        )
    return path


class PolicyController:
    """Controller that runs a learned policy, for simulated robots and real ones.

    It computes actions at the rate of the policy's task. A policy of joint offsets holds its
    targets in between, and follows the velocity of a command alone. One of command corrections
    lets the locomotion controller walk. Velocities are followed up to the task's largest.

    Args:
        policy: File or name of a policy, a `Policy`, or a function that returns actions (1, B) for
            observations (1, A).
        robot: Robot that is controlled; None: that of the policy's task.
        task: Task of the policy; None: that of its file.
        update_period: Time between calls of `update`, for command corrections [s].
        gravity: Gravitational acceleration, for command corrections [m/s²].

    Attributes:
        policy: The policy.
        task: Its task.
        events: Times [s] and sentences: when a command first exceeded the task's largest.

    Raises:
        InvalidInput: The file names no task, or the policy does not fit the robot.
    """

    def __init__(
        self,
        policy: Callable[[np.ndarray], np.ndarray] | str | Path,
        robot: Robot | None = None,
        task: Task | None = None,
        *,
        update_period: float = 0.005,
        gravity: float = STANDARD_GRAVITY,
    ) -> None:
        self.policy = policy if callable(policy) else Policy(policy)
        task = task or getattr(self.policy, "task", None)
        if task is None:
            raise InvalidInput("the policy names no task; give the task for which it was trained.")
        self.task = task
        robot = robot or task.scenario().build().robot
        exact = {"joint_noise": 0.0, "gyro_noise": 0.0, "gravity_noise": 0.0}
        self._constants = task_constants(task.replace(randomisation=exact), robot)
        self._shape = len(robot.legs), 3
        self._observer = Observer(task, robot, self._constants, 1)
        width = len(self._observer.names)
        takes = getattr(self.policy, "observations", None)
        if takes not in (width, None):
            raise InvalidInput(
                f"the policy takes {takes} observations, and a robot of "
                f"{len(robot.legs)} legs has {width} in this task."
            )
        joints, none = 3 * len(robot.legs), np.zeros((1, 0))
        self._command: Command | None = None
        self._walker: LocomotionEngine | None = None
        if task.action.kind == "command-corrections":
            self._walker = new_controller(robot, task, update_period, gravity)
        self._actions = len(action_names(task, robot))
        self._states = States(np.zeros((1, 7 + joints)), np.zeros((1, 6 + joints)), none, none)
        self._begin(0.0)

    @property
    def largest_velocity(self) -> tuple[float, float, float]:
        """Largest commanded velocity that is followed: forward, left [m/s], yaw rate [rad/s]."""
        forward, left, yaw = self._constants.largest.tolist()
        return forward, left, yaw

    def reset(self, observation: Observation) -> None:
        """Begin with the robot as it is observed; its joints are the first targets."""
        self._begin(observation.time)
        if self._walker is not None:
            self._walker.reset(observation)
        position = np.ravel(observation.joint_position)
        self._episode.target[0] = self._episode.previous_target[0] = position

    def update(self, observation: Observation, command: Command) -> JointTargets:
        """Return joint targets; a new action is computed once per period of the policy."""
        e, walker = self._episode, self._walker
        is_due = observation.time >= self._due - 1e-9
        if is_due:
            self._due += self._constants.dt
            e.command[0] = self._within_reach(observation.time, command)
            is_first = math.isnan(self._last_time)
            self._read(observation)
            self._observer.observe(e, self._states, ONE, is_first=is_first)
            actions = self.policy(self._observer.observations).astype(float)
            if walker is None:
                begin_period(self._constants, e, actions, ONE)
            else:
                take_action(e, actions, ONE)
        if walker is None:
            return JointTargets(e.target[0].reshape(self._shape).copy(), np.zeros(self._shape))
        if is_due or command is not self._command:
            self._command = command
            vx, vy, wz = self._within_reach(observation.time, command).tolist()
            within = replace(command, velocity=(vx, vy, wz))
            self._corrected = corrected(within, e.action[0], self.task)
        targets = walker.update(observation, self._corrected)
        e.phase[0] = walker.state.clock.phase
        self.events += walker.take_events()
        return targets

    def take_events(self) -> list[tuple[float, str]]:
        """Return the events since the last call, and forget them."""
        events = list(self.events)
        self.events.clear()
        return events

    def telemetry(self) -> dict[str, Any]:
        """Return the phase of the gait's clock, in cycles, or the locomotion controller's."""
        if self._walker is not None:
            return self._walker.telemetry()
        return {"gait_phase": self._episode.phase[0]}

    def _begin(self, time: float) -> None:
        self._episode = empty_episodes(1, self._shape[0], self._actions)
        self._episode.contact[:] = 1.0
        self._due, self._last_time = time, math.nan
        self._command = None
        self._corrected = Command()
        self.events: list[tuple[float, str]] = []
        self._is_clipped = False
        self._last_position = np.zeros(3 * self._shape[0])

    def _within_reach(self, time: float, command: Command) -> np.ndarray:
        """Return the velocity of a command, limited to those of the task."""
        wanted, largest = np.array(command.velocity), self._constants.largest
        if (np.abs(wanted) > largest + 1e-12).any() and not self._is_clipped:
            self._is_clipped = True
            x, y, turn = largest
            self.events.append(
                (
                    time,
                    f"the command exceeds what the policy was trained for: {x:g} m/s forward, "
                    f"{y:g} m/s to the left, {turn:g} rad/s; it follows as far as that",
                )
            )
        return np.clip(wanted, -largest, largest)

    def _read(self, o: Observation) -> None:
        """Observe the robot as the policy's environment does."""
        if o.orientation is None or o.angular_velocity is None:
            raise InvalidInput(
                "the policy observes orientation and angular velocity; the robot measures none."
            )
        position = np.ravel(o.joint_position)
        if o.joint_velocity is not None:
            velocity = np.ravel(o.joint_velocity)
        elif math.isnan(self._last_time) or o.time <= self._last_time:
            velocity = np.zeros(len(position))
        else:
            # Servos measure no speed: the mean since the last action.
            velocity = (position - self._last_position) / (o.time - self._last_time)
        self._last_time, self._last_position = o.time, position.copy()
        qpos, qvel = self._states.qpos[0], self._states.qvel[0]
        qpos[3:7], qpos[7:] = o.orientation, position
        qvel[3:6], qvel[6:] = o.angular_velocity, velocity
        if o.contact is not None:
            self._episode.contact[0] = o.contact


def save_policy(onnx: Any, task: Task, path: str | Path) -> Path:
    """Write a network with its task as an ONNX file.

    Args:
        onnx: Path of an ONNX file, or its model.
        task: Task for which it was trained.
        path: File to write.

    Returns:
        The file.
    """
    import onnx as onnx_package

    model = onnx_package.load(onnx) if isinstance(onnx, str | Path) else onnx
    entry = model.metadata_props.add()
    entry.key, entry.value = TASK_KEY, task.model_dump_json()
    path = Path(path)
    onnx_package.save(model, path)
    return path
