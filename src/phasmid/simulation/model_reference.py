"""The model's channels beside a simulated walk: targets, torques and foot forces of the plan."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from phasmid.forces.analysis import model_channels
from phasmid.motion import Walk
from phasmid.scenario import Scenario

BLOCK = 1024
"""Samples that are computed together."""

KEPT_BLOCKS = 64
"""Blocks that are kept between `check` and `at`."""

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
        scenario: Its force model and recording interval are used.
        walk: The plan.
        until: The last recorded instant [s].
    """

    def __init__(self, scenario: Scenario, walk: Walk, until: float) -> None:
        self._scenario, self._walk = scenario, walk
        self._interval = scenario.simulation.dt * scenario.record_steps
        self._count = math.floor(until / self._interval + 1e-9) + 1
        cycle = scenario.stride.period / self._interval
        is_whole = abs(cycle - round(cycle)) <= 1e-9 * cycle
        if walk.keeps_heading and is_whole and 0 < round(cycle) <= KEPT_BLOCKS * BLOCK:
            self._count = min(self._count, round(cycle))
        self._block = lru_cache(KEPT_BLOCKS)(self._compute)

    def check(self, interrupted: Sequence[int] = ()) -> None:
        """Compute the load until `interrupted` is not empty; of one cycle where all are alike.

        Raises:
            InvalidInput: The load transfer takes longer than the gait allows.
            InfeasibleLoad: The feet cannot give what the motion needs within the model's limits.
        """
        count = self._count
        if self._walk.is_periodic:
            cycle = math.floor(self._scenario.stride.period / self._interval + 1e-9) + 1
            count = min(count, cycle)
        for number in range(math.ceil(count / BLOCK)):
            if interrupted:
                return
            self._block(number)

    def at(self, time: Float[np.ndarray, " time"]) -> dict[str, np.ndarray]:
        """Return the `CHANNELS` at N recorded instants [s]."""
        sample = np.rint(time / self._interval).astype(int) % self._count
        block, row = np.divmod(sample, BLOCK)
        channels: dict[str, np.ndarray] = {}
        for number in np.unique(block):
            which = block == number
            for name, values in self._block(int(number)).items():
                shape = (len(sample), *values.shape[1:])
                rows = channels.setdefault(name, np.empty(shape, values.dtype))
                rows[which] = values[row[which]]
        return channels

    def _compute(self, number: int) -> dict[str, np.ndarray]:
        sample = np.arange(number * BLOCK, min((number + 1) * BLOCK, self._count))
        channels = model_channels(self._scenario, self._walk.sample(sample * self._interval))
        return {name: channels[name] for name in CHANNELS}
