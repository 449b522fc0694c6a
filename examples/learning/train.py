"""Train a walking policy with the PPO of Stable-Baselines3 and write it as ONNX.

python examples/learning/train.py --task walk --steps 10000000 --seed 0 --out policy.onnx
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import onnx
from rich.console import Console

from phasmid.extras import install_hint
from phasmid.learning import Policy, WalkVectorEnv, assess, save_policy

try:
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.vec_env import VecEnv
except ModuleNotFoundError as error:
    raise SystemExit(f"training needs {error.name}; try {install_hint('learn')}") from None


class TrainingEnv(VecEnv):
    """Adapter from a batch of robots to Stable-Baselines3."""

    def __init__(self, env: WalkVectorEnv) -> None:
        self.env, self.render_mode = env, env.render_mode
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    def reset(self) -> np.ndarray:
        return self.env.reset(seed=self._seeds[0])[0]

    def step_async(self, actions: np.ndarray) -> None:
        self._actions = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        observations, rewards, fell, over, information = self.env.step(self._actions)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for n in np.flatnonzero(fell | over):
            final = information["final_info"]
            sums = final["reward_sums"]
            infos[n] = {
                "level": int(final["level"][n]),
                "terminal_observation": information["final_obs"][n],
                "TimeLimit.truncated": bool(over[n]),
                "reward_terms": {name: float(values[n]) for name, values in sums.items()},
            }
        return observations, rewards, fell | over, infos

    def close(self) -> None:
        self.env.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        return [getattr(self.env, attr_name)] * self.num_envs

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        setattr(self.env, attr_name, value)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list:
        return [getattr(self.env, method_name)(*args, **kwargs)] * self.num_envs

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        return [False] * self.num_envs


class Curve(BaseCallback):
    """Prints the mean reward terms of the episodes that ended, ten times per million steps.

    Attributes:
        points: Wall time [s], steps, return, level of difficulty and reward terms.
    """

    def __init__(self) -> None:
        super().__init__()
        self.points: list[dict[str, float]] = []
        self._terms: list[dict[str, float]] = []
        self._levels: list[int] = []
        self._begin = time.perf_counter()

    def _on_step(self) -> bool:
        ended = [info for info in self.locals["infos"] if info]
        self._terms += [info["reward_terms"] for info in ended]
        self._levels += [info["level"] for info in ended]
        if len(self._terms) < 100:
            return True
        terms = {name: float(np.mean([t[name] for t in self._terms])) for name in self._terms[0]}
        level = float(np.mean(self._levels))
        self._terms, self._levels = [], []
        elapsed, total = time.perf_counter() - self._begin, sum(terms.values())
        point = {"time": elapsed, "steps": self.num_timesteps, "return": total, "level": level}
        self.points.append({**point, **terms})
        shown = ", ".join(f"{name} {value:.2f}" for name, value in terms.items() if value)
        print(
            f"{elapsed:4.0f} s, {self.num_timesteps:8d} steps, return {total:6.2f}, "
            f"level {level:.1f}: {shown}",
            flush=True,
        )
        return True


def train(
    env: WalkVectorEnv, *, steps: int, seed: int, start: Path | None = None
) -> tuple[PPO, list[dict[str, float]]]:
    """Train a policy, from a file or from nothing, and return it with its learning curve."""
    # Waiting threads of PyTorch occupy the cores of the physics: 7,400 steps a second, not 8,900.
    torch.set_num_threads(1)
    model = PPO(
        "MlpPolicy",
        TrainingEnv(env),
        n_steps=32,
        batch_size=512,
        n_epochs=4,
        # A trained actor is kept while the critic learns: smaller steps.
        learning_rate=lambda left: (3e-4 if start else 1e-3) * max(left, 0.05),
        gamma=0.98,
        seed=seed,
        device="cpu",
        policy_kwargs={
            "net_arch": {"pi": [128, 64], "vf": [128, 128]},
            "activation_fn": torch.nn.ELU,
            # Joint offsets need a steady hand; corrections of commands change the walk little.
            "log_std_init": -2.0 if env.task.action.kind == "joint-offsets" else -1.0,
        },
    )
    if start:
        load_actor(model, start)
    curve = Curve()
    model.learn(steps, callback=curve)
    return model, curve.points


def load_actor(model: PPO, path: Path) -> None:
    """Begin with the actor of a policy file that `export` wrote for the same observations."""
    weights = {
        w.name: torch.tensor(onnx.numpy_helper.to_array(w))
        for w in onnx.load(path).graph.initializer
    }
    Actor(model).load_state_dict(weights)


class Actor(torch.nn.Module):
    """The part of a policy that acts: the mean action, clipped."""

    def __init__(self, model: PPO) -> None:
        super().__init__()
        self.hidden, self.last = model.policy.mlp_extractor.policy_net, model.policy.action_net

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return self.last(self.hidden(observations)).clamp(-1.0, 1.0)


def export(model: PPO, env: WalkVectorEnv, path: Path) -> None:
    """Write the actor and its task as ONNX."""
    example = torch.zeros(1, env.single_observation_space.shape[0])
    with tempfile.TemporaryDirectory() as folder:
        plain = Path(folder) / "actor.onnx"
        torch.onnx.export(
            Actor(model),
            (example,),
            str(plain),
            input_names=["observations"],
            output_names=["actions"],
            dynamic_axes={"observations": {0: "robots"}, "actions": {0: "robots"}},
            dynamo=False,
        )
        save_policy(plain, env.task, path)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--task", default="walk", help="task that comes with phasmid, or a file")
    parser.add_argument("--steps", type=int, default=10_000_000, help="control periods in all")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--envs", type=int, default=128, help="robots that walk together")
    parser.add_argument("--threads", type=int, default=2, help="of the physics")
    parser.add_argument("--start", type=Path, help="policy file with which to begin")
    parser.add_argument("--out", type=Path, default=Path("policy.onnx"))
    given = parser.parse_args()
    env = WalkVectorEnv(
        given.envs, task=given.task, threads=given.threads, autoreset_mode="SameStep"
    )
    model, curve = train(env, steps=given.steps, seed=given.seed, start=given.start)
    export(model, env, given.out)
    given.out.with_suffix(".json").write_text(json.dumps(curve))
    result = assess(Policy(given.out), env.task, name=given.out.stem)
    Console(width=120).print(result.table())
    print("\n".join(result.failures()) or "All gates are passed.")
