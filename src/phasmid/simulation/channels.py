"""Recorded channels and attributes of a run."""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from importlib.metadata import version
from typing import TYPE_CHECKING

import numpy as np

from phasmid.forces.analysis import recording_attributes
from phasmid.motion import JointTrajectory
from phasmid.recording.recording import Attributes
from phasmid.sensors.models import rotated_vector
from phasmid.simulation.loop import Samples
from phasmid.simulation.termination import Ending, Failure

if TYPE_CHECKING:
    from phasmid.simulation.run import Run


class SampleChannels(Mapping[str, np.ndarray]):
    """Simulated channels of N samples of a run by the names of the recording, computed when read.

    Args:
        run: The run.
        samples: The samples.
        acceleration: Mean acceleration of the body since the sample before [m/s²], shape (N, 3),
            which becomes the channel ``body_acceleration`` of sensor models.
    """

    def __init__(self, run: Run, samples: Samples, acceleration: np.ndarray | None = None) -> None:
        self._run, self._samples = run, samples
        self._own = run.drive.channels(samples["drive"])
        if acceleration is not None:
            self._own["body_acceleration"] = acceleration

    def __getitem__(self, name: str) -> np.ndarray:
        if name in self._own:
            return self._own[name]
        return _CHANNELS[name](self._run, self._samples)

    def __iter__(self) -> Iterator[str]:
        yield from (*_CHANNELS, *self._own)

    def __len__(self) -> int:
        return len(_CHANNELS) + len(self._own)


def _contact(run: Run, samples: Samples) -> np.ndarray:
    """Return number of touching points and force in world axes of every foot, (N, L, 4)."""
    legs = len(run.robot.legs)
    contact: np.ndarray = samples["sensors"][:, : 4 * legs].reshape(-1, legs, 4)
    return contact


def _foot_position(run: Run, samples: Samples) -> np.ndarray:
    legs = len(run.robot.legs)
    position: np.ndarray = samples["sensors"][:, 4 * legs :].reshape(-1, legs, 3)
    return position


def _normal_force(run: Run, samples: Samples) -> np.ndarray:
    force = _contact(run, samples)[..., 1:]
    normal_force = force[..., 2]
    if not run.ground.is_level:
        position = _foot_position(run, samples)
        normal = run.ground.normal(position[..., 0], position[..., 1])
        normal_force = np.einsum("tlk,tlk->tl", force, normal)
    # The riser of a step can push a foot away from the ground below it.
    return np.maximum(normal_force, 0.0)


_CHANNELS: dict[str, Callable[[Run, Samples], np.ndarray]] = {
    "joint_position": lambda _, samples: samples["qpos"][:, 7:].reshape(len(samples), -1, 3),
    "joint_velocity": lambda _, samples: samples["qvel"][:, 6:].reshape(len(samples), -1, 3),
    "joint_torque": lambda _, samples: samples["torque"].reshape(len(samples), -1, 3),
    "foot_force": lambda run, samples: _contact(run, samples)[..., 1:],
    "foot_normal_force": _normal_force,
    "foot_position": _foot_position,
    "contact": lambda run, samples: _contact(run, samples)[..., 0] > 0,
    "body_position": lambda _, samples: samples["qpos"][:, :3],
    "body_velocity": lambda _, samples: samples["qvel"][:, :3],
    "body_orientation": lambda _, samples: samples["qpos"][:, 3:7],
    # MuJoCo keeps a free body's angular velocity in body axes.
    "body_angular_velocity": lambda _, samples: rotated_vector(
        samples["qpos"][:, 3:7], samples["qvel"][:, 3:6]
    ),
}


@cache
def versions() -> dict[str, str]:
    """Return the versions and machine that a run's bits depend on, by attribute."""
    import mujoco

    return {
        "phasmid_version": version("phasmid"),
        "mujoco_version": mujoco.__version__,
        "numpy_version": np.__version__,
        "numba_version": version("numba"),
        "machine": f"{platform.system()} {platform.machine()}",
    }


def run_attributes(run: Run) -> Attributes:
    """Return the attributes of a run's recording, except for how it ended."""
    scenario, walk = run.scenario, run.walk
    return {
        **recording_attributes(scenario, walk),
        "kind": "simulation",
        "drive": scenario.simulation.planned_drive,
        "contact_law": scenario.contact.contact_law,
        "simulator": run.simulator,
        "time_step": scenario.simulation.dt,
        **versions(),
        **({"trajectory": walk.to_text()} if isinstance(walk, JointTrajectory) else {}),
        **run.start_attribute(),
    }


def ending_attributes(failure: Failure | None) -> dict[str, str | int | float]:
    """Return how a run ended, as attributes of its recording."""
    ending = failure.ending if failure else Ending.COMPLETED
    return {
        "ending": ending.name,
        "ending_reason": failure.sentence if failure else ending.value,
    }
