"""Samples of a run as the engine tells them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from phasmid.simulation.drives import Drive

if TYPE_CHECKING:
    import mujoco


@dataclass(frozen=True, eq=False)
class Samples:
    """What the engine says at each sample, in its own order."""

    qpos: Float[np.ndarray, "samples q"]
    qvel: Float[np.ndarray, "samples v"]
    sensors: Float[np.ndarray, "samples sensors"]
    torque: Float[np.ndarray, "samples joints"]
    drive: Float[np.ndarray, "samples state"]

    @classmethod
    def empty(cls, model: mujoco.MjModel, drive: Drive, samples: int) -> Samples:
        """Room for a number of samples."""
        widths = (model.nq, model.nv, model.nsensordata, model.nv - 6, len(drive.state))
        return cls(*(np.empty((samples, width)) for width in widths))

    def part(self, which: slice) -> Samples:
        """Some of the samples, in the same memory."""
        return Samples(*(getattr(self, field.name)[which] for field in fields(self)))

    def put(self, at: int, samples: Samples) -> None:
        """Copy samples to a place in these."""
        for field in fields(self):
            rows = getattr(samples, field.name)
            getattr(self, field.name)[at : at + len(rows)] = rows

    def rows(self) -> list[list[Any]]:
        """Memory of each sample, field by field; that of the torques as arrays."""
        return [
            [array[k] if field.name == "torque" else array[k].data for k in range(len(array))]
            for field, array in ((field, getattr(self, field.name)) for field in fields(self))
        ]

    def write(self, row: int, data: mujoco.MjData, drive: Drive) -> None:
        """Write one sample as the engine stands."""
        self.qpos[row], self.qvel[row] = data.qpos, data.qvel
        self.sensors[row], self.torque[row] = data.sensordata, drive.torque()
        self.drive[row] = drive.state


Keep = Callable[[Samples], None]
"""Takes samples that are recorded, in their order; their memory is used again afterwards."""
