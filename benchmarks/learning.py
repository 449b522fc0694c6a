"""Compare how fast batches of learning robots advance: control periods per second, in one run.

    python benchmarks/learning.py [--robots 64] [--seconds 3] [--random-steps 1000000]

A step is a whole one: action, physics, reward, observation, and the reset of robots that fell.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable

import gymnasium
import mujoco
import numpy as np
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv, VectorEnv

from phasmid.learning import WalkVectorEnv, load_task
from phasmid.learning.export import exported_specification


class PlainEnv(gymnasium.Env):
    """The same robot and time steps as one would write it: MjData, NumPy, position actuators."""

    def __init__(self) -> None:
        self.model = exported_specification(load_task("walk")).compile()
        self.data = mujoco.MjData(self.model)
        self.neutral = WalkVectorEnv(1).physics.constants.neutral
        joints = len(self.neutral)
        self.action_space = gymnasium.spaces.Box(-1, 1, (joints,), np.float32)
        self.observation_space = gymnasium.spaces.Box(
            -np.inf, np.inf, (9 + 3 * joints,), np.float32
        )
        self.action = np.zeros(joints)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[2], self.data.qpos[7:] = 0.11, self.neutral
        self.command = self.np_random.uniform(-0.1, 0.1, 3)
        return self._observation(), {}

    def step(self, action):
        previous, self.action = self.action, action
        self.data.ctrl[:] = self.neutral + 0.6 * action
        mujoco.mj_step(self.model, self.data, 5)
        R = self.data.body("trunk").xmat.reshape(3, 3)
        velocity = R.T @ self.data.qvel[:3]
        error = np.sum((velocity[:2] - self.command[:2]) ** 2)
        reward = np.exp(-error / 0.0025) - 0.01 * np.sum((action - previous) ** 2)
        return self._observation(), float(reward), bool(R[2, 2] < 0.5), False, {}

    def _observation(self):
        data = self.data
        R = data.body("trunk").xmat.reshape(3, 3)
        parts = data.qvel[3:6], -R[2], data.qpos[7:] - self.neutral, data.qvel[6:], self.action
        return np.concatenate([*parts, self.command]).astype(np.float32)


def rate(env: VectorEnv, seconds: float, after: Callable[[], None] = lambda: None) -> float:
    """Return the control periods per second of a batch."""
    env.reset(seed=0)
    actions = 0.3 * np.random.default_rng(0).standard_normal((50, *env.action_space.shape))
    actions = actions.astype(env.single_action_space.dtype)
    for action in actions[:10]:
        env.step(action)
    after()
    begin, count = time.perf_counter(), 0
    while time.perf_counter() - begin < seconds:
        env.step(actions[count % len(actions)])
        count += 1
    return count * env.num_envs / (time.perf_counter() - begin)


def own(robots: int, seconds: float, **options: object) -> tuple[float, float]:
    """Return the rate of our batch, and that of the calls of MuJoCo in it alone."""
    env = WalkVectorEnv(robots, **options)
    step, spent = env.physics.batch.step, [0.0, 0.0]

    def timed(*arguments: object, **more: object) -> None:
        begin = time.perf_counter()
        step(*arguments, **more)
        spent[0] += time.perf_counter() - begin

    def start() -> None:
        spent[:] = 0.0, time.perf_counter()

    object.__setattr__(env.physics.batch, "step", timed)
    found = rate(env, seconds, start)
    return found, found * (time.perf_counter() - spent[1]) / spent[0]


def random_steps(robots: int, steps: int) -> None:
    """Make random steps of randomised robots, and refuse a number that is not finite."""
    ranges = {"friction": (0.3, 1.5), "mass": 0.2, "payload": 0.5, "strength": 0.2, "gain": 0.3}
    env = WalkVectorEnv(robots, task="rough", randomisation={**ranges, "push": 0.5})
    env.reset(seed=0)
    rng, falls = np.random.default_rng(0), 0
    for _ in range(steps // robots):
        actions = rng.uniform(-1, 1, env.action_space.shape).astype(np.float32)
        observations, rewards, fell, _, _ = env.step(actions)
        assert np.isfinite(observations).all()
        assert np.isfinite(rewards).all()
        falls += int(fell.sum())
    print(f"{steps} random steps of task rough: all numbers finite, {falls} falls")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", type=int, default=64)
    parser.add_argument("--seconds", type=float, default=3.0)
    parser.add_argument("--random-steps", type=int, default=0, help="only make these")
    given = parser.parse_args()
    if given.random_steps:
        random_steps(given.robots, given.random_steps)
        return
    print(f"{given.robots} robots, {os.cpu_count()} cores; control periods of 20 ms per second")
    for task, fidelity in (("walk", "fast"), ("rough", "fast"), ("walk", "full")):
        one, alone = own(given.robots, given.seconds, task=task, fidelity=fidelity)
        two, _ = own(given.robots, given.seconds, task=task, fidelity=fidelity, threads=2)
        print(
            f"phasmid, {task}, {fidelity}: {one:7.0f} on one core, {one / alone:.2f} of mj_step "
            f"alone ({alone:.0f}); {two:7.0f} on two, {two / one:.2f} times"
        )
    makers = [PlainEnv] * given.robots
    sync = rate(SyncVectorEnv(makers), given.seconds)
    print(f"SyncVectorEnv of a plain MuJoCo environment: {sync:7.0f}")
    env = AsyncVectorEnv(makers)
    print(f"AsyncVectorEnv of the same, on all cores:    {rate(env, given.seconds):7.0f}")
    env.close()
    try:
        import envpool
    except ImportError:
        print("EnvPool is not installed.")
        return
    for threads in (1, 2):
        pool = envpool.make("Ant-v4", env_type="gymnasium", num_envs=64, num_threads=threads)
        pool.reset()
        actions = np.zeros((64, *pool.action_space.shape))
        begin, count = time.perf_counter(), 0
        while time.perf_counter() - begin < given.seconds:
            pool.step(actions)
            count += 64
        print(
            f"EnvPool's Ant-v4, 8 joints, 5 steps of 10 ms, {threads} threads: "
            f"{count / (time.perf_counter() - begin):7.0f}"
        )


if __name__ == "__main__":
    main()
