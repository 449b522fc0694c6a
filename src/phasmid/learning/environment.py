"""Gymnasium environments: a batch of walking robots, and one of them alone."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from jaxtyping import Float
from mujoco.batch import SimulationError

from phasmid.arguments import checked, described, numbers
from phasmid.errors import InvalidInput
from phasmid.learning.control_period import begin_period, end_period
from phasmid.learning.corrections import Controllers
from phasmid.learning.episodes import draw_episodes, random_states
from phasmid.learning.observation import Observer
from phasmid.learning.physics import Physics
from phasmid.learning.task import TERMS, Task, load_task

CHOSEN = "command", "level", "kind"
"""What an option of a reset chooses in place of a random draw."""


class WalkVectorEnv(VectorEnv[np.ndarray, np.ndarray, np.ndarray]):
    """N robots that learn to walk as commanded.

    A robot's episode depends on its own seed and actions alone, not on the other robots and not on
    the number of threads. Robot i of a batch with the seed s has the seed s + i.

    Args:
        num_envs: Number of robots, N.
        task: A task, the name of a task that comes with phasmid, or the path of a task file.
        threads: Number of threads of the physics.
        autoreset_mode: When an ended episode is followed by the next one.
        changes: Fields of the task to replace, such as ``fidelity="full"``.

    Attributes:
        task: The task.
        physics: The robots.
        observation_names: Meaning of each number of an observation.
        privileged_names: Meaning of each number of a privileged observation.
        privileged_observation_space: Of the critic's observations, which ``info`` holds under
            ``privileged_observation``, shape (N, P).
    """

    metadata: dict[str, Any] = {"render_modes": []}

    @checked
    def __init__(
        self,
        num_envs: int = 1,
        *,
        task: str | Path | Task = "walk",
        threads: int = 1,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        **changes: Any,
    ) -> None:
        task = task if isinstance(task, Task) else load_task(task)
        self.task = task = task.replace(**changes)
        self.num_envs = num_envs
        modes = [mode.value for mode in AutoresetMode]
        if autoreset_mode not in [*AutoresetMode, *modes]:
            raise InvalidInput(
                f"autoreset_mode is {described(autoreset_mode)}; it must be one of "
                f"{', '.join(modes)}."
            )
        self._mode = AutoresetMode(autoreset_mode)
        self.metadata = {**type(self).metadata, "autoreset_mode": self._mode}
        self.physics = physics = Physics(task, num_envs, threads)
        self._controllers: Controllers | None = None
        if task.action.kind == "command-corrections":
            self._controllers = Controllers(task, physics)
        self._observer = Observer(task, physics.robot, physics.constants, num_envs)
        self.observation_names = self._observer.names
        self.privileged_names = self._observer.privileged_names
        self.single_observation_space, self.privileged_observation_space = (
            gymnasium.spaces.Box(-np.inf, np.inf, (len(names),), np.float32)
            for names in (self.observation_names, self.privileged_names)
        )
        actions = physics.episodes.action.shape[1]
        self.single_action_space = gymnasium.spaces.Box(-1.0, 1.0, (actions,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._ended = np.zeros(num_envs, bool)
        self._all = np.arange(num_envs)
        self._is_seeded = False

    def reset(
        self, *, seed: int | list[int] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin episodes.

        Args:
            seed: Seed of robot 0, or of every robot; None: the random numbers go on.
            options: ``reset_mask``: the robots that begin anew, shape (N,); absent: all.
                ``command``: their first commands, forward, left [m/s] and yaw rate [rad/s], (N, 3).
                ``level``: their levels of difficulty, (N,); ``kind``: the kinds of ground, (N,).

        Returns:
            Observations, shape (N, A), and information as of `step`.
        """
        super().reset(seed=seed if isinstance(seed, int) else None)
        if seed is None and not self._is_seeded:
            seed = int(self.np_random.integers(2**31))
        if seed is not None:
            seeds = self._all + seed if isinstance(seed, int) else np.asarray(seed)
            self.physics.episodes.random[:] = random_states(seeds)
            self.physics.episodes.level[:] = -1
            self._is_seeded = True
        options = options or {}
        mask = options.get("reset_mask")
        ids = self._all if mask is None else np.flatnonzero(mask)
        self._ended[ids] = False
        self._begin(ids, {name: options[name] for name in CHOSEN if name in options})
        return self._observations(), self._information()

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Advance all robots by a control period.

        Args:
            actions: Offsets of the joint targets from the neutral stance, or corrections of the
                controller's commands, over the task's scale, clipped to [-1, 1], shape (N, B).

        Returns:
            Observations (N, A), rewards (N,), whether a robot fell (N,), whether its time is over
            (N,), and information: ``command`` (N, 3), ``level`` of difficulty (N,),
            ``privileged_observation`` (N, P), and ``reward_sums``, the sum of each reward term over
            the episode, (N,) each. With automatic reset in the same step also ``final_obs`` and
            ``final_info``.
        """
        e, physics = self.physics.episodes, self.physics
        running, begun = self._all, self._all[:0]
        if self._mode is AutoresetMode.NEXT_STEP:
            running, begun = np.flatnonzero(~self._ended), np.flatnonzero(self._ended)
        actions = _as_actions(actions, self.action_space, "actions")
        try:
            if self._controllers is None:
                begin_period(physics.constants, e, actions, running)
                physics.advance(running)
            else:
                self._controllers.advance(actions, running)
        except SimulationError as error:
            # MuJoCo left the state as it was before the step that failed; the episode ends here.
            physics.qpos[error.ids] = np.nan
        end_period(physics.constants, e, physics.states, running)
        if len(begun):
            self._begin(begun)
        self._observer.observe(e, physics.states, running)
        rewards, terminated = e.reward.copy(), e.fell.copy()
        truncated = (e.step >= physics.constants.steps) & ~terminated
        self._ended = terminated | truncated
        final: dict[str, Any] = {}
        if self._mode is AutoresetMode.SAME_STEP and self._ended.any():
            ended = self._ended.copy()
            final = {"final_obs": self._observations(), "_final_obs": ended}
            final |= {"final_info": self._information(), "_final_info": ended}
            self._begin(np.flatnonzero(self._ended))
        return (
            self._observations(),
            rewards,
            terminated,
            truncated,
            self._information() | final,
        )

    def _begin(self, ids: np.ndarray, chosen: Mapping[str, Any] = MappingProxyType({})) -> None:
        physics = self.physics
        draw_episodes(physics.constants, physics.episodes, ids)
        for name, values in chosen.items():
            getattr(physics.episodes, name)[ids] = np.asarray(values)[ids]
        physics.place(ids)
        if self._controllers is not None:
            self._controllers.begin(ids)
        self._observer.observe(physics.episodes, physics.states, ids, is_first=True)

    def _observations(self) -> np.ndarray:
        # A robot whose state is no longer finite has ended its episode.
        finite = np.nan_to_num(self._observer.observations, posinf=0.0, neginf=0.0)
        return finite.astype(np.float32)

    def _information(self) -> dict[str, Any]:
        e = self.physics.episodes
        return {
            "command": e.command.copy(),
            "privileged_observation": np.nan_to_num(self._observer.privileged).astype(np.float32),
            "level": e.level.copy(),
            "reward_sums": {name: e.sums[:, i].copy() for i, name in enumerate(TERMS)},
        }


class WalkEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """One robot that learns to walk as commanded; arguments as of `WalkVectorEnv`."""

    metadata = WalkVectorEnv.metadata

    def __init__(self, **arguments: Any) -> None:
        self.batch = WalkVectorEnv(1, autoreset_mode=AutoresetMode.DISABLED, **arguments)
        self.observation_space = self.batch.single_observation_space
        self.action_space = self.batch.single_action_space

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode; arguments as of `WalkVectorEnv.reset`, without the axis of robots."""
        super().reset(seed=seed)
        chosen = {name: np.asarray(value)[None] for name, value in (options or {}).items()}
        observations, information = self.batch.reset(seed=seed, options=chosen)
        return observations[0], _first(information)

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Advance the robot by a control period; as of `WalkVectorEnv.step`."""
        observations, rewards, fell, over, information = self.batch.step(
            _as_actions(action, self.action_space, "action")[None]
        )
        return (
            observations[0],
            float(rewards[0]),
            bool(fell[0]),
            bool(over[0]),
            _first(information),
        )


def _as_actions(
    values: object, space: gymnasium.Space[np.ndarray], name: str
) -> Float[np.ndarray, "..."]:
    """Return the actions of a step as an array.

    Raises:
        InvalidInput: They are no numbers, or have another shape than their space.
    """
    array = numbers(values, name)
    if array.shape != space.shape:
        raise InvalidInput(
            f"{name} has shape {array.shape}; it must have shape {space.shape}, as of "
            "env.action_space."
        )
    return array


def _first(information: dict[str, Any]) -> dict[str, Any]:
    """Return the information on the first robot of a batch."""
    return {
        name: _first(value) if isinstance(value, dict) else value[0]
        for name, value in information.items()
    }
