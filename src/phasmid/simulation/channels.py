"""What a recording tells of a run: channels and attributes."""

from __future__ import annotations

import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version

import numpy as np
from jaxtyping import Float

from phasmid.forces.analysis import recording_attributes
from phasmid.kinematics import quaternion_rotation
from phasmid.motion import JointTrajectory, Motion
from phasmid.scenario import Scenario
from phasmid.simulation.run import Run
from phasmid.simulation.samples import Samples
from phasmid.simulation.termination import Ending, Failure
from phasmid.terrain import Ground


def run_channels(run: Run, log: Samples, model: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The engine's samples and the model's figures under the names of the house.

    Args:
        run: Whose samples they are.
        log: The samples.
        model: The model's channels at these samples.
    """
    legs, n = len(run.robot.legs), len(log.qpos)
    contact = log.sensors[:, : 4 * legs].reshape(n, legs, 4)
    force = contact[..., 1:]
    position = log.sensors[:, 4 * legs :].reshape(n, legs, 3)
    channels = model | {
        "joint_position": log.qpos[:, 7:].reshape(n, legs, 3),
        "joint_velocity": log.qvel[:, 6:].reshape(n, legs, 3),
        "joint_torque": log.torque.reshape(n, legs, 3),
        "foot_force": force,
        "foot_normal_force": _normal_part(force, position, run.ground),
        "foot_position": position,
        "contact": contact[..., 0] > 0,
        "body_position": log.qpos[:, :3],
        "body_velocity": log.qvel[:, :3],
        "body_orientation": log.qpos[:, 3:7],
        # The engine keeps a free body's angular velocity in its own axes.
        "body_angular_velocity": np.einsum(
            "tij,tj->ti", quaternion_rotation(log.qpos[:, 3:7]), log.qvel[:, 3:6]
        ),
    }
    return channels | run.drive.channels(log.drive)


@cache
def versions() -> dict[str, str]:
    """What a run's bits depend on besides its scenario and its robot, by attribute."""
    import mujoco

    try:
        numba = version("numba")
    except PackageNotFoundError:
        numba = "none"
    return {
        "phasmid_version": version("phasmid"),
        "mujoco_version": mujoco.__version__,
        "numpy_version": np.__version__,
        "numba_version": numba,
        "machine": f"{platform.system()} {platform.machine()}",
    }


def run_attributes(scenario: Scenario, walk: Motion, run: Run) -> dict[str, str | int | float]:
    """What a recording says of its run, but for how it ended."""
    return (
        recording_attributes(scenario, walk)
        | {
            "kind": "simulation",
            "drive": scenario.simulation.planned_drive,
            "contact_law": scenario.contact.contact_law,
            "simulator": run.simulator,
            "time_step": scenario.simulation.dt,
        }
        | versions()
        | ({"trajectory": walk.to_text()} if isinstance(walk, JointTrajectory) else {})
        | run.start_attribute()
    )


def ending_attributes(trouble: Failure | None) -> dict[str, str | int | float]:
    """How a run ended, in a recording's attributes."""
    ending = trouble.ending if trouble else Ending.COMPLETED
    reason = trouble.sentence if trouble else ending.value
    return {"ending": ending.name, "ending_reason": reason}


def _normal_part(
    force: Float[np.ndarray, "time legs 3"],
    position: Float[np.ndarray, "time legs 3"],
    ground: Ground,
) -> Float[np.ndarray, "time legs"]:
    """Return the part of the forces along the ground's normal at the feet, not below zero [N].

    The side of a step can push a foot away from the ground beneath it; that is no normal force.
    """
    if ground.is_level:
        return np.maximum(force[..., 2], 0.0)
    normal = ground.normal(position[..., 0], position[..., 1])
    return np.maximum(np.einsum("tlk,tlk->tl", force, normal), 0.0)
