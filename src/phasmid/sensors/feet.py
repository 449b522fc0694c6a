"""What a foot's sensor tells: its normal force, and whether it touches."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.scenario.sensors import SensorsTable
from phasmid.sensors.sampling import Sampling, random_stream

FOOT = 4
"""Number of the sensors' random stream."""


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
    noise = random_stream(table.sensor_seed, FOOT).standard_normal(true.shape)
    force = (true + table.foot_force_noise * noise)[reading]
    return {
        "foot_normal_force_measured": force,
        "contact_measured": force >= table.contact_threshold,
    }
