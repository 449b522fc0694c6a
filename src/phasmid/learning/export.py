"""Tasks for training on a GPU: the robot as MJCF, and the task's constants as JSON."""

from __future__ import annotations

import json
from pathlib import Path

import mujoco

from phasmid.errors import InvalidInput, OutputError
from phasmid.learning.episodes import task_constants
from phasmid.learning.model import FAST_STEP, fast_specification, robot_motor
from phasmid.learning.observation import joint_names, observation_names
from phasmid.learning.task import TERMS, Task


def exported_specification(task: Task) -> mujoco.MjSpec:
    """Describe a task's robot and ground at fast fidelity, with a position actuator per joint.

    The actuators have gain and stall torque of the motor. Its counter voltage and viscous friction
    are the joints' damping. Delay, Coulomb friction and the friction that grows with the load are
    left out: they are in the task's constants.
    """
    experiment = task.scenario().build()
    robot = experiment.robot
    constants = task_constants(task, robot)
    spec = fast_specification(experiment.replace(dt=FAST_STEP), constants.terrain)
    motor = robot_motor(robot)
    for name in joint_names(robot):
        actuator = spec.add_actuator(name=name, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=name)
        actuator.set_to_position(kp=motor.gain)
        actuator.forcelimited, actuator.forcerange = True, [-motor.stall, motor.stall]
    spec.add_key(
        name="neutral",
        qpos=[0.0, 0.0, constants.height, 1.0, 0.0, 0.0, 0.0, *constants.neutral],
        ctrl=constants.neutral,
    )
    return spec


def export_task(task: Task, folder: str | Path) -> tuple[Path, Path]:
    """Write a task for mjlab, MuJoCo Warp or another trainer on a GPU.

    Args:
        task: The task.
        folder: Folder of the files; made where it is absent.

    Returns:
        ``robot.xml``, the robot at fast fidelity with a keyframe ``neutral``; and ``task.json``:
        the task's file, and the numbers that follow from it: rate, neutral stance, scale and
        largest change of the targets, names of the observations, and weights of the rewards.

    Raises:
        InvalidInput: The task corrects commands, for which each robot needs the controller.
        OutputError: The folder cannot be written.
    """
    if task.action.kind != "joint-offsets":
        raise InvalidInput(
            f'action.kind is "{task.action.kind}"; only tasks with joint offsets are exported.',
            hint='"joint-offsets"',
        )
    experiment = task.scenario().build()
    robot = experiment.robot
    c, motor = task_constants(task, robot), robot_motor(robot)
    constants = {
        "task": task.model_dump(),
        "control_period_s": c.dt,
        "joints": joint_names(robot),
        "feet": [f"{leg}.foot" for leg in robot.leg_names],
        "neutral_rad": c.neutral.tolist(),
        "joint_limits_rad": c.limits.tolist(),
        "action_scale_rad": task.action.scale,
        "largest_target_change_rad": c.change,
        "neutral_height_m": c.height,
        "motor": motor._asdict(),
        "gait": {
            "lifts": c.lifts.tolist(),
            "swing_fraction": c.swing,
            "period_s": task.gait.period,
        },
        "latest_observations": observation_names(task, robot),
        "reward_weights": {name: getattr(task.rewards, name) for name in TERMS},
    }
    folder = Path(folder)
    spec = exported_specification(task)
    spec.compile()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        model, numbers = folder / "robot.xml", folder / "task.json"
        # MuJoCo before 4 refuses this attribute, and position actuators do not need it.
        xml = spec.to_xml().replace(' input="pos"', "")
        model.write_text(xml, encoding="utf-8")
        numbers.write_text(json.dumps(constants, indent=1), encoding="utf-8")
    except OSError as error:
        raise OutputError(f"{folder} cannot be written: {error.strerror}.") from error
    return model, numbers
