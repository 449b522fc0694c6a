"""Exported tasks: MJCF that MuJoCo reads, with the robot of the environment."""

import json

import mujoco
import numpy as np
import pytest

from phasmid.learning import WalkVectorEnv, export_task, load_task
from support.exported_walks import walk


@pytest.mark.parametrize("name", ["walk", "rough"])
def test_an_exported_robot_moves_as_that_of_the_environment(tmp_path, name):
    """Position actuators give the motor's torque but for its friction, left out of the file.

    The environment's motors get no friction either; the file keeps seven digits, and a foot's touch
    may fall into another step: 0.01 rad after 0.2 s.
    """
    task = load_task(name).replace(randomisation={"friction": (0.7, 0.7)})
    path, numbers = export_task(task, tmp_path / name)
    model = mujoco.MjModel.from_xml_path(str(path))
    constants = json.loads(numbers.read_text())
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("neutral").id)
    env = WalkVectorEnv(1, task=task, autoreset_mode="Disabled")
    env.reset(seed=0, options={"level": [0], "kind": [0]})
    p = env.physics
    p.motor = p.motor._replace(friction=0.0, load_loss=0.0, delay=0.0)
    data.qpos[:] = p.qpos[0]
    assert model.opt.timestep == 0.004
    for step in range(10):
        env.step(0.2 * np.sin(0.3 * step + np.arange(18))[None])
        for _ in range(5):
            data.ctrl[:] = p.episodes.target[0]
            mujoco.mj_step(model, data)
    np.testing.assert_allclose(data.qpos[7:], p.qpos[0, 7:], atol=0.01)
    assert constants["joints"] == [model.joint(i).name for i in range(1, 19)]
    np.testing.assert_allclose(constants["neutral_rad"], p.constants.neutral)
    latest = constants["latest_observations"]
    assert env.observation_names[: len(latest)] == latest
    assert constants["task"] == json.loads(task.model_dump_json())


def test_the_policy_walks_on_the_exported_robot(tmp_path):
    """With the constants' delay and friction: 80 to 110 % of the command, after one cycle."""
    export_task(load_task("walk"), tmp_path)
    # MuJoCo before 4 knows this attribute for other actuators only, and refuses the file.
    assert "input=" not in (tmp_path / "robot.xml").read_text()
    positions, _ = walk(tmp_path, "walk", (0.08, 0.0, 0.0), 4.8)
    speed = (positions[-1] - positions[39]) / 4.0
    assert 0.064 < speed[0] < 0.088
    assert abs(speed[1]) < 0.01
    assert np.all(np.abs(positions[:, 2] - 0.1) < 0.02)
