"""Policies: ONNX files, the controller that runs one, and the gates."""

from itertools import cycle

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper
from rich.console import Console

from phasmid.errors import InvalidInput
from phasmid.experiment import Command, Observation
from phasmid.learning import (
    Policy,
    PolicyController,
    WalkVectorEnv,
    assess,
    load_task,
    policy_names,
    save_policy,
)
from phasmid.learning.control_period import reference_leg
from phasmid.robot import load_robot, with_values
from phasmid.scenario import Scenario
from phasmid.simulation.drive import drive

TASK = load_task("walk")


def linear_policy(folder, task, seed=0, size=0.02, observations=None):
    """A policy whose actions are a random matrix times the observations."""
    width = observations or WalkVectorEnv(1, task=task).single_observation_space.shape[0]
    W = np.random.default_rng(seed).normal(0, size, (width, 18)).astype(np.float32)
    graph = helper.make_graph(
        [helper.make_node("MatMul", ["observations", "W"], ["actions"])],
        "linear",
        [helper.make_tensor_value_info("observations", TensorProto.FLOAT, ["robots", width])],
        [helper.make_tensor_value_info("actions", TensorProto.FLOAT, ["robots", 18])],
        [numpy_helper.from_array(W, "W")],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)])
    model.ir_version = 10
    return save_policy(model, task, folder / "linear.onnx"), W


def test_a_policy_keeps_its_task_and_computes_its_network(tmp_path):
    task = load_task("walk").replace(rate=40.0)
    path, W = linear_policy(tmp_path, task)
    policy = Policy(path)
    assert policy.task == task
    x = np.random.default_rng(1).normal(size=(4, len(W))).astype(np.float32)
    np.testing.assert_allclose(policy(x), x @ W, atol=1e-6)


def test_a_policy_of_a_changed_robot_keeps_it_and_not_its_name_alone(tmp_path):
    """The changed robot has the name of a preset, on which the policy was not trained."""
    robot = with_values(load_robot("phantomx-ax"), {"legs.*.tibia": 0.16})
    task = load_task("walk").replace(robot=robot)
    kept = Policy(linear_policy(tmp_path, task)[0]).task
    (length,) = {leg.lengths[2] for leg in kept.scenario().load_robot().legs}
    assert length == 0.16
    assert kept.model_dump() == task.model_dump()


@pytest.mark.parametrize("history", [1, 3])
def test_the_controller_gives_the_targets_of_the_environment(tmp_path, history):
    """Both see the same robot for 60 periods; the network's floats have seven digits."""
    # The controller's clock begins at zero, the environment's anywhere.
    table = {"history": history, "contacts": True, "clock": False}
    task = load_task("walk").replace(observation=table)
    policy = Policy(linear_policy(tmp_path, task)[0])
    env = WalkVectorEnv(1, task=task, autoreset_mode="Disabled")
    command = np.array([[0.08, -0.03, 0.2]])
    seen, _ = env.reset(seed=0, options={"command": command})
    p, controller = env.physics, PolicyController(policy)

    def observation(time):
        return Observation(
            time,
            p.qpos[0, 7:].reshape(6, 3).copy(),
            p.qvel[0, 6:].reshape(6, 3).copy(),
            orientation=p.qpos[0, 3:7].copy(),
            angular_velocity=p.qvel[0, 3:6].copy(),
            contact=p.episodes.contact[0] > 0,
        )

    controller.reset(observation(0.0))
    for step in range(60):
        targets = controller.update(observation(0.02 * step), Command(tuple(command[0])))
        seen = env.step(policy(seen))[0]
        np.testing.assert_allclose(targets.position.ravel(), p.episodes.target[0], atol=1e-5)


def test_targets_hold_between_actions(tmp_path):
    """At 200 updates per second a policy of 50 Hz acts at every fourth."""
    controller = PolicyController(linear_policy(tmp_path, load_task("walk"))[0])
    rng, neutral = np.random.default_rng(0), WalkVectorEnv(1, task=TASK).physics.constants.neutral
    seen = [
        Observation(
            0.005 * k,
            neutral.reshape(6, 3) + rng.normal(0, 0.05, (6, 3)),
            orientation=np.array([1.0, 0.0, 0.0, 0.0]),
            angular_velocity=rng.normal(size=3),
        )
        for k in range(12)
    ]
    controller.reset(seen[0])
    targets = [controller.update(o, Command((0.1, 0.0, 0.0))).position for o in seen]
    changes = [k for k in range(1, 12) if not np.array_equal(targets[k], targets[k - 1])]
    assert changes == [4, 8]


def test_a_driven_robot_stands_on_a_policy_without_action(tmp_path):
    """Zero actions are the neutral stance: the robot stands for a second of full physics."""
    path, _ = linear_policy(tmp_path, load_task("walk"), size=0.0)
    scenario = Scenario().replace(robot="phantomx-ax", drive="servo", duration=1.0)
    recording = drive(scenario, PolicyController(path))
    height = recording["body_position"].values[:, 2]
    assert recording.attrs["ending"] == "COMPLETED"
    assert abs(height[-1] - height[0]) < 0.02


def test_bad_policies_are_refused_in_one_sentence(tmp_path):
    task = load_task("walk")

    (tmp_path / "bad.onnx").write_bytes(b"no network")
    other, _ = linear_policy(tmp_path, task, observations=7)
    for source, words in (
        ("nowhere.onnx", 'there is no policy "nowhere.onnx"'),
        (tmp_path / "bad.onnx", "bad.onnx is not an ONNX file"),
        (other, "the policy takes 7 observations, and a robot of 6 legs has 65"),
    ):
        with pytest.raises(InvalidInput, match=words):
            PolicyController(source)
    path, _ = linear_policy(tmp_path, task)
    model = onnx.load(path)
    del model.metadata_props[:]
    onnx.save(model, path)
    with pytest.raises(InvalidInput, match="names no task"):
        PolicyController(path)
    assert PolicyController(path, task=task).task == task


@pytest.mark.parametrize("name", policy_names())
def test_policies_that_come_with_phasmid_are_small_and_pass_their_gates(name):
    policy = Policy(name)
    assert policy.task is not None
    assert policy.size < 300_000
    if name == "walk":
        assert assess(policy, policy.task).failures() == []


class Reference:
    """Follows the reference motion, as its observations tell it.

    Args:
        change: Returns phase of the clock and size of the command for a leg, by both.
    """

    def __init__(self, change=lambda phase, leg: (phase, 1.0)):
        env = WalkVectorEnv(1, task=TASK)
        self.c, self.change, self.names = env.physics.constants, change, env.observation_names

    def __call__(self, observations):
        c, at = self.c, self.names.index
        q = np.tile(c.neutral, (len(observations), 1))
        first, clock = at("command.forward / largest"), at("clock.sin")
        for n, row in enumerate(observations.astype(float)):
            command = row[first : first + 3] * c.largest
            if not command.any():
                continue
            now = np.arctan2(row[clock], row[clock + 1]) / (2 * np.pi)
            for leg in range(len(c.lifts)):
                phase, size = self.change((now + c.dt / c.task.gait.period) % 1.0, leg)
                q[n, 3 * leg : 3 * leg + 3] = reference_leg(c, size * command, phase, leg)
        return (q - c.neutral) / c.task.action.scale


def test_the_reference_motion_passes_every_gate_and_cheats_fail():
    """Each policy walks in a way that a reward may allow, and fails the gate made for it."""

    def assessed(policy, seconds=4.0):
        return assess(policy, TASK, robots=1, seconds=seconds)

    assert assessed(Reference()).failures() == []
    signs = cycle([1.0, -1.0])
    restless = lambda o: np.full((len(o), 18), 0.3 * next(signs))  # noqa: E731
    cheats = {
        "velocity along the command": assessed(Reference(lambda phase, leg: (phase, 0.5))),
        "largest duty factor of a leg": assessed(
            Reference(lambda phase, leg: (0.75 if leg == 0 else phase, 1.0))
        ),
        "least duty factor of a leg": assessed(lambda o: np.zeros((len(o), 18)), 2.0),
        "speed of the joints while the command is zero": assessed(restless, 2.0),
    }
    for gate, assessment in cheats.items():
        assert gate in " ".join(assessment.failures()), gate
    console = Console(width=160)
    with console.capture() as shown:
        console.print(cheats["least duty factor of a leg"].table())
    assert "least_duty" in shown.get()
    assert "✗" in shown.get()
