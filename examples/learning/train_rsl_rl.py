"""Train a walking policy with the PPO of RSL-RL and write it as ONNX.

python examples/learning/train_rsl_rl.py --task walk --minutes 15 --seed 0 --out policy.onnx
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import torch
from rsl_rl.env import VecEnv
from rsl_rl.runners import OnPolicyRunner
from tensordict import TensorDict

from phasmid.learning import WalkVectorEnv

SETTINGS: dict[str, Any] = {
    "num_steps_per_env": 32,
    "save_interval": 10**9,
    "obs_groups": {"actor": ["actor"], "critic": ["actor", "privileged"]},
    "actor": {
        "class_name": "MLPModel",
        "hidden_dims": [128, 64],
        "activation": "elu",
        "distribution_cfg": {
            "class_name": "GaussianDistribution",
            "init_std": 0.13,
            "std_type": "log",
        },
    },
    "critic": {"class_name": "MLPModel", "hidden_dims": [128, 128], "activation": "elu"},
    "algorithm": {
        "class_name": "PPO",
        "gamma": 0.98,
        "lam": 0.95,
        "learning_rate": 7e-4,
        "schedule": "fixed",
        "use_clipped_value_loss": False,
        "normalize_advantage_per_mini_batch": True,
        "value_loss_coef": 0.5,
        "max_grad_norm": 0.5,
        "entropy_coef": 0.0,
        "num_learning_epochs": 4,
        "num_mini_batches": 8,
    },
}
"""Networks and algorithm, as RSL-RL names them."""


class TrainingEnv(VecEnv):
    """Adapter from a batch of robots to RSL-RL.

    Attributes:
        ended: Sums of the reward terms of the episodes that ended.
    """

    def __init__(self, env: WalkVectorEnv, seed: int) -> None:
        self.env, self.cfg, self.device = env, env.task.model_dump(), "cpu"
        self.num_envs = env.num_envs
        self.num_actions = env.single_action_space.shape[0]
        self.max_episode_length = env.physics.constants.steps
        self.episode_length_buf = torch.zeros(env.num_envs, dtype=torch.long)
        self.ended: list[dict[str, float]] = []
        self._observations = self._group(*env.reset(seed=seed))

    def get_observations(self) -> TensorDict:
        return self._observations

    def step(
        self, actions: torch.Tensor
    ) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict[str, Any]]:
        observations, rewards, fell, over, information = self.env.step(actions.numpy())
        self._observations = self._group(observations, information)
        for n in np.flatnonzero(fell | over):
            sums = information["final_info"]["reward_sums"]
            self.ended.append({name: float(values[n]) for name, values in sums.items()})
        return (
            self._observations,
            torch.as_tensor(rewards, dtype=torch.float32),
            torch.as_tensor(fell | over),
            {"time_outs": torch.as_tensor(over)},
        )

    def _group(self, observations: np.ndarray, information: dict[str, Any]) -> TensorDict:
        groups = {"actor": observations, "privileged": information["privileged_observation"]}
        return TensorDict(
            {name: torch.from_numpy(values) for name, values in groups.items()},
            batch_size=[self.num_envs],
        )


def train(
    task: str, *, minutes: float, seed: int, envs: int, threads: int
) -> tuple[OnPolicyRunner, list[dict[str, float]]]:
    """Train for a wall time, and return the runner with the learning curve."""
    torch.manual_seed(seed)
    torch.set_num_threads(threads)
    env = TrainingEnv(
        WalkVectorEnv(envs, task=task, threads=threads, autoreset_mode="SameStep"), seed
    )
    with contextlib.redirect_stdout(io.StringIO()):
        runner = OnPolicyRunner(env, json.loads(json.dumps(SETTINGS)))
    begin, curve, steps = time.perf_counter(), [], 0
    while time.perf_counter() - begin < 60 * minutes:
        with contextlib.redirect_stdout(io.StringIO()):
            runner.learn(10)
        steps += 10 * envs * SETTINGS["num_steps_per_env"]
        if len(env.ended) < envs:
            continue
        terms = {name: float(np.mean([t[name] for t in env.ended])) for name in env.ended[0]}
        env.ended.clear()
        point = {"time": time.perf_counter() - begin, "steps": steps, "return": sum(terms.values())}
        curve.append({**point, **terms})
        print(
            f"{point['time']:4.0f} s, {steps:8d} steps, return {point['return']:6.2f}:",
            ", ".join(f"{name} {value:.2f}" for name, value in terms.items() if value),
            flush=True,
        )
    return runner, curve


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--task", default="walk", help="task that comes with phasmid, or a file")
    parser.add_argument("--minutes", type=float, default=15.0, help="wall time")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--envs", type=int, default=128, help="robots that walk together")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("policy.onnx"))
    given = parser.parse_args()
    runner, curve = train(
        given.task, minutes=given.minutes, seed=given.seed, envs=given.envs, threads=given.threads
    )
    with contextlib.redirect_stdout(io.StringIO()):
        runner.export_policy_to_onnx(str(given.out.parent), given.out.name)
    given.out.with_suffix(".json").write_text(json.dumps(curve))
