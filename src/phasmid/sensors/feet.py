"""What a foot's sensor tells: its normal force, and whether it touches."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.scenario.sensors import SensorsTable
from phasmid.sensors.sampling import Sampling, random_stream

FOOT = 4
"""Number of the sensors' random stream."""


class FootSensor:
    """The sensors of all feet, reading by reading.

    Args:
        table: Noise and threshold.
        legs: Number of feet.
    """

    def __init__(self, table: SensorsTable, legs: int) -> None:
        self._table, self._legs = table, legs
        self._rng = random_stream(table.sensor_seed, FOOT)

    def noise(self, count: int) -> Float[np.ndarray, "readings legs"]:
        """That of the next readings [N]."""
        return self._table.foot_force_noise * self._rng.standard_normal((count, self._legs))

    def read(
        self, force: Float[np.ndarray, "readings legs"], noise: Float[np.ndarray, "readings legs"]
    ) -> dict[str, np.ndarray]:
        """Readings of normal forces [N]."""
        told = force + noise
        return {
            "foot_normal_force_measured": told,
            "contact_measured": told >= self._table.contact_threshold,
        }


def foot_channels(
    table: SensorsTable,
    time: Float[np.ndarray, " time"],
    normal_force: Float[np.ndarray, "time legs"],
) -> dict[str, np.ndarray]:
    """What the feet's sensors tell.

    Args:
        table: Rate, delay, noise and threshold.
        time: [s], shape (N,).
        normal_force: Of the ground on the feet [N], shape (N, L).

    Returns:
        ``foot_normal_force_measured`` [N] and ``contact_measured``, shapes (N, L).
    """
    sampling = Sampling(table.foot_rate, table.foot_delay)
    reading = sampling.reading_at(time)
    true = normal_force[sampling.row_of(time, np.arange(reading[-1] + 1))]
    sensor = FootSensor(table, true.shape[1])
    told = sensor.read(true, sensor.noise(len(true)))
    return {name: values[reading] for name, values in told.items()}
