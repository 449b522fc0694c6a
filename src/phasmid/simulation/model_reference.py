"""The model's figures beside a run: what the walk needs at the samples that are recorded."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from phasmid.forces.analysis import model_channels
from phasmid.motion import Walk
from phasmid.scenario import Scenario

BLOCK_SAMPLES = 1024
"""Samples that are computed together at most; their number fills the memory."""

CYCLE_SAMPLES = 16 * BLOCK_SAMPLES
"""Most samples of a cycle that are kept for all cycles."""

CHANNELS = (
    "joint_position_target",
    "joint_velocity_target",
    "joint_acceleration_target",
    "joint_torque_model",
    "foot_force_model",
    "foot_normal_force_model",
    "stance",
)
"""What of the model's channels stands in a run's recording; the others are the engine's there."""

Channels = dict[str, np.ndarray]


class ModelReference:
    """The model's channels at a walk's recorded instants, each computed once where it can be.

    Where all cycles are alike in the world's axes, and each has the same whole number of samples,
    one cycle's figures serve all. Elsewhere those that `check` has computed are handed on. Each
    sample's bits are the same, whichever others are computed with it.

    Args:
        scenario: Tells the model and the recorded instants.
        walk: The plan.
        kept: How many figures may wait between `check` and `at`, where no cycle serves all.
    """

    def __init__(self, scenario: Scenario, walk: Walk, *, kept: int) -> None:
        self._scenario, self._walk = scenario, walk
        self._interval = scenario.simulation.dt * scenario.record_steps
        self._samples = _cycle_samples(scenario, walk, self._interval)
        self._kept = kept // BLOCK_SAMPLES
        self._cycle: Channels = {}
        self._blocks: dict[int, Channels] = {}

    def check(self, until: float, interrupted: Sequence[int] = ()) -> None:
        """Look at the load; where all cycles are alike, seen from the body, at one of them.

        Args:
            until: The last instant that is looked at [s].
            interrupted: Nothing more is looked at as soon as this is not empty.

        Raises:
            InvalidInput: The load transfer takes longer than the gait allows.
            InfeasibleLoad: The feet cannot give what the motion needs within the model's limits.
        """
        if self._walk.is_periodic:
            until = min(until, self._scenario.stride.period)
        count = min(math.floor(until / self._interval + 1e-9) + 1, self._samples or math.inf)
        parts = []
        for first in range(0, int(count), BLOCK_SAMPLES):
            if interrupted:
                return
            part = self._computed(np.arange(first, min(first + BLOCK_SAMPLES, count)))
            if self._samples:
                parts.append(part)
            elif len(self._blocks) < self._kept:
                self._blocks[first // BLOCK_SAMPLES] = part
        if count == self._samples:
            self._cycle = _joined(parts)
        elif self._samples and parts:
            # Less than a cycle is walked: its samples come but once.
            self._blocks = dict(enumerate(parts))

    def at(self, time: Float[np.ndarray, " time"]) -> Channels:
        """The figures at consecutive samples; those before them are let go.

        Args:
            time: Of the samples [s], shape (N,).

        Returns:
            The `CHANNELS`, shapes as in a recording.
        """
        sample = np.rint(time / self._interval).astype(int)
        if self._cycle:
            at = sample % self._samples
            return {name: values[at] for name, values in self._cycle.items()}
        block = sample // BLOCK_SAMPLES
        parts = [self._part(int(number), sample[block == number]) for number in np.unique(block)]
        for number in [number for number in self._blocks if len(block) and number < block[-1]]:
            del self._blocks[number]
        return _joined(parts or [self._computed(sample)])

    def _part(self, block: int, sample: np.ndarray) -> Channels:
        """Some samples of one block."""
        found, row = self._blocks.get(block), sample - block * BLOCK_SAMPLES
        waiting = row < (len(found["stance"]) if found else 0)
        parts = []
        if found and waiting.any():
            parts.append({name: values[row[waiting]] for name, values in found.items()})
        if not waiting.all():
            parts.append(self._computed(sample[~waiting]))
        return _joined(parts)

    def _computed(self, sample: np.ndarray) -> Channels:
        """The figures at some samples, computed now."""
        if self._samples:
            sample = sample % self._samples
        channels = model_channels(self._scenario, self._walk.sample(sample * self._interval))
        return {name: channels[name] for name in CHANNELS}


def _joined(parts: Sequence[Channels]) -> Channels:
    """Parts of all channels as one."""
    if len(parts) == 1:
        return parts[0]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _cycle_samples(scenario: Scenario, walk: Walk, interval: float) -> int:
    """Number of samples in a cycle that serves all; 0 where there is none."""
    cycle = scenario.stride.period / interval
    samples = round(cycle)
    if not (walk.keeps_heading and 0 < samples <= CYCLE_SAMPLES):
        return 0
    return samples if abs(cycle - samples) <= 1e-9 * cycle else 0
