"""Training raises the return; `make slow SUITE=learning` installs PyTorch and runs this test."""

import sys
from pathlib import Path

import numpy as np
import pytest

from phasmid.learning import Policy, PolicyController, WalkVectorEnv
from phasmid.learning.task import TERMS

sys.path.insert(0, str(Path(__file__).parents[3] / "examples/learning"))

pytestmark = pytest.mark.filterwarnings("ignore")


def returns(policy, task):
    """Sums of rewards of 64 robots over four seconds; the same robots for every policy."""
    env = WalkVectorEnv(64, task=task, duration=4.0, autoreset_mode="Disabled")
    observations, _ = env.reset(seed=1000)
    total = np.zeros(64)
    for _ in range(200):
        observations, rewards, *_ = env.step(policy(observations))
        total += rewards
    return total


def test_training_raises_the_return_and_its_policy_runs(tmp_path):
    """The trained policy earns more than the untrained, by five standard errors of the pairs.

    The only term is the distance from the reference motion, which is learnt first: a robot that
    begins to walk at a commanded velocity earns less than one that stands, at first.
    """
    from train import export, train

    only = dict.fromkeys(TERMS, 0.0) | {"reference": 1.0, "reference_scale": 0.2}
    env = WalkVectorEnv(128, rewards=only, autoreset_mode="SameStep")
    before, _ = train(env, steps=1, seed=0)
    model, curve = train(env, steps=80_000, seed=0)
    assert [point["steps"] for point in curve] == sorted(point["steps"] for point in curve)
    gain = returns(actions_of(model), env.task) - returns(actions_of(before), env.task)
    assert gain.mean() > 5 * gain.std() / np.sqrt(len(gain))
    export(model, env, tmp_path / "policy.onnx")
    policy = Policy(tmp_path / "policy.onnx")
    seen, _ = env.reset(seed=0)
    np.testing.assert_allclose(policy(seen), actions_of(model)(seen), atol=1e-5)
    assert PolicyController(policy).task == env.task


def actions_of(model):
    return lambda o: np.clip(model.predict(o, deterministic=True)[0], -1.0, 1.0)
