"""Walks of an exported robot in plain MuJoCo: the policy, and the servos' delay and friction."""

import json

import mujoco
import numpy as np

from phasmid.experiment import Command, Observation
from phasmid.learning import PolicyController


def walk(folder, policy, command, seconds):
    """Positions of the trunk and targets, one row per control period, of an exported task."""
    model = mujoco.MjModel.from_xml_path(str(folder / "robot.xml"))
    constants = json.loads((folder / "task.json").read_text())
    data, controller, motor = mujoco.MjData(model), PolicyController(policy), constants["motor"]
    mujoco.mj_resetDataKeyframe(model, data, model.key("neutral").id)
    controller.reset(observed(data))
    previous, rows = np.array(constants["neutral_rad"]), []
    for _ in range(round(seconds / constants["control_period_s"])):
        targets = controller.update(observed(data), Command(velocity=command)).position.ravel()
        for step in range(round(constants["control_period_s"] / model.opt.timestep)):
            is_late = step * model.opt.timestep < motor["delay"]
            data.ctrl[:] = previous if is_late else targets
            error = data.ctrl - data.qpos[7:]
            torque = np.clip(motor["gain"] * error, -motor["stall"], motor["stall"])
            hold = motor["friction"] + motor["load_loss"] * np.abs(torque)
            data.qfrc_applied[6:] = -hold * np.clip(data.qvel[6:], -1, 1)
            mujoco.mj_step(model, data)
        previous = targets
        rows.append((data.qpos[:3].copy(), targets))
    positions, targets = zip(*rows, strict=True)
    return np.array(positions), np.array(targets)


def observed(data):
    return Observation(
        time=data.time,
        joint_position=data.qpos[7:].reshape(-1, 3).copy(),
        joint_velocity=data.qvel[6:].reshape(-1, 3).copy(),
        orientation=data.qpos[3:7].copy(),
        angular_velocity=data.qvel[3:6].copy(),
    )
