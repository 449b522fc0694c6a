"""The model's channels beside a simulated walk: targets, torques and foot forces of the plan."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float, Int

from phasmid.experiment import Experiment, ScenarioLike, built
from phasmid.forces.analysis import model_channels
from phasmid.motion import Walk

BLOCK = 1024
"""Samples that are computed together before the run."""

LONGEST_CYCLE = 64 * BLOCK
"""Samples of the longest cycle that is kept."""

CHANNELS = (
    "joint_position_target",
    "joint_velocity_target",
    "joint_acceleration_target",
    "joint_torque_model",
    "foot_force_model",
    "foot_normal_force_model",
    "stance",
)
"""Model channels in the recording of a run; the others are simulated there."""


class ModelReference:
    """The model's channels at a walk's recorded instants.

    Where all cycles are alike in the world's axes, and each has the same whole number of samples,
    one cycle serves all.

    Args:
        experiment: Its force model and recording interval are used.
        walk: The plan.
        until: The last recorded instant [s].

    Raises:
        InvalidInput: The load transfer takes longer than the gait allows.
        InfeasibleLoad: The feet cannot give what the motion needs within the model's limits.
    """

    def __init__(self, experiment: Experiment, walk: Walk, until: float) -> None:
        self._experiment, self._walk = experiment, walk
        self._interval = experiment.solver.time_step * experiment.solver.record_steps
        count = math.floor(until / self._interval + 1e-9) + 1
        cycle = experiment.course.stride.period / self._interval
        self._cycle: dict[str, np.ndarray] | None = None
        is_whole = abs(cycle - round(cycle)) <= 1e-9 * cycle
        if walk.keeps_heading and is_whole and 0 < round(cycle) <= LONGEST_CYCLE:
            self._cycle = self._compute(np.arange(min(count, round(cycle))))
            return
        if walk.is_periodic:
            count = min(count, math.floor(cycle + 1e-9) + 1)
        for first in range(0, count, BLOCK):
            self._compute(np.arange(first, min(first + BLOCK, count)))

    def at(self, time: Float[np.ndarray, " time"]) -> dict[str, np.ndarray]:
        """Return the `CHANNELS` at N recorded instants [s]."""
        sample = np.rint(time / self._interval).astype(int)
        if self._cycle is None:
            return self._compute(sample)
        length = len(self._cycle["stance"])
        return {name: values[sample % length] for name, values in self._cycle.items()}

    def _compute(self, sample: Int[np.ndarray, " samples"]) -> dict[str, np.ndarray]:
        channels = model_channels(self._experiment, self._walk.sample(sample * self._interval))
        return {name: channels[name] for name in CHANNELS}


def check_load(scenario: ScenarioLike | Experiment, walk: Walk) -> None:
    """Refuse a walk whose load the scenario's force model cannot share.

    Raises:
        InvalidInput: The load transfer takes longer than the gait allows.
        InfeasibleLoad: The feet cannot give what the motion needs within the model's limits.
    """
    experiment = built(scenario)
    ModelReference(experiment, walk, experiment.duration)
