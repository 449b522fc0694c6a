"""When a sensor reads, and when its reading is there."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True)
class Sampling:
    """A sensor that reads at a fixed rate and whose readings arrive late.

    Between two arrivals the last reading stands. Before the first arrives, the first is there
    already: the robot has stood still until the beginning.

    Attributes:
        rate: Readings a second [1/s], the first at the beginning of the recording.
        delay: Time from a reading to its arrival [s].
    """

    rate: float
    delay: float

    def reading_at(self, time: Float[np.ndarray, " time"]) -> Int[np.ndarray, " time"]:
        """Number of the latest reading that has arrived at each time, from 0, shape (N,)."""
        # Half a nanosecond: a reading that is due at a sample has arrived there, whatever the
        # last digit of either time says.
        passed = time - time[0] - self.delay + 5e-10
        number: np.ndarray = np.maximum(np.floor(passed * self.rate), 0.0).astype(np.int64)
        return number

    def latest(self, passed: float) -> int:
        """Number of the latest reading that has arrived a time after the beginning [s], from 0."""
        return max(math.floor((passed - self.delay + 5e-10) * self.rate), 0)

    def row_of(
        self, time: Float[np.ndarray, " time"], reading: Int[np.ndarray, " readings"]
    ) -> Int[np.ndarray, " readings"]:
        """Index of the last sample that is not later than each reading, shape (M,)."""
        when = time[0] + reading / self.rate + 5e-10
        row: np.ndarray = np.searchsorted(time, when, side="right") - 1
        return row


def quantised(values: Float[np.ndarray, "*shape"], step: float) -> Float[np.ndarray, "*shape"]:
    """Values rounded to whole steps; as they are where the step is 0."""
    return np.round(values / step) * step if step > 0 else values


def random_stream(seed: int, sensor: int) -> np.random.Generator:
    """Random numbers of one sensor, independent of those of the others.

    Args:
        seed: Of the scenario.
        sensor: A number of the sensor's own.
    """
    return np.random.default_rng([seed, sensor])
