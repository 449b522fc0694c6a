"""Recorded channels and attributes of a run."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from phasmid.experiment import Experiment
from phasmid.recording import Recording
from phasmid.simulation.faults import Faults
from phasmid.simulation.loop import Samples
from phasmid.simulation.sensors import sense
from phasmid.simulation.sensors.models import rotated_vector

if TYPE_CHECKING:
    from phasmid.simulation.run import Run


def sample_channels(run: Run, samples: Samples) -> dict[str, np.ndarray]:
    """Return the simulated channels of N samples of a run by the names of the recording."""
    count, legs = len(samples), len(run.robot.legs)
    qpos, qvel, sensors = samples["qpos"], samples["qvel"], samples["sensors"]
    # Of every foot: number of touching points, and force in world axes.
    contact = sensors[:, : 4 * legs].reshape(count, legs, 4)
    foot = sensors[:, 4 * legs :].reshape(count, legs, 3)
    force = contact[..., 1:]
    normal_force = force[..., 2]
    if not run.ground.is_level:
        normal = run.ground.normal(foot[..., 0], foot[..., 1])
        normal_force = np.einsum("tlk,tlk->tl", force, normal)
    return {
        "joint_position": qpos[:, 7:].reshape(count, legs, 3),
        "joint_velocity": qvel[:, 6:].reshape(count, legs, 3),
        "joint_torque": samples["torque"].reshape(count, legs, 3),
        "foot_force": force,
        # The riser of a step can push a foot away from the ground below it.
        "foot_normal_force": np.maximum(normal_force, 0.0),
        "foot_position": foot,
        "contact": contact[..., 0] > 0,
        "body_position": qpos[:, :3],
        "body_velocity": qvel[:, :3],
        "body_orientation": qpos[:, 3:7],
        # MuJoCo keeps a free body's angular velocity in body axes.
        "body_angular_velocity": rotated_vector(qpos[:, 3:7], qvel[:, 3:6]),
        **run.drive.channels(samples["drive"]),
    }


def with_sensors(experiment: Experiment, recording: Recording) -> Recording:
    """Add the measured channels, with the recorded faults, where the scenario measures.

    A log does not hold these channels, since they follow from the others.
    """
    if experiment.sensors.measured != "everything":
        return recording
    sensed = sense(experiment, recording)
    texts = json.loads(str(sensed.attrs.get("faults", "[]")))
    robot = experiment.robot
    faults = Faults(robot, texts, experiment.sensors.touching_force(experiment.scale))
    added = sensed.data_vars.keys() - recording.data_vars.keys()
    channels = {str(name): sensed[name].values for name in added}
    faulty = faults.apply_to_recording(sensed["time"].values, channels)
    return sensed.assign(
        {name: (sensed[name].dims, values, sensed[name].attrs) for name, values in faulty.items()}
    )
