"""What a servo tells of its joint: angle and load."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.scenario.sensors import SensorsTable
from phasmid.sensors.sampling import Sampling, quantised


def joint_channels(
    table: SensorsTable,
    time: Float[np.ndarray, " time"],
    angle: Float[np.ndarray, "time legs 3"],
    load: Float[np.ndarray, "time legs 3"] | None,
) -> dict[str, np.ndarray]:
    """What the servos tell.

    Args:
        table: Rate, delay and steps.
        time: [s], shape (N,).
        angle: Of the joints [rad], shape (N, L, 3).
        load: Output of the servos as a share of the largest, with its sign, (N, L, 3); None where
            nothing is known of it.

    Returns:
        ``joint_position_measured`` [rad] and ``joint_load_measured``, shapes (N, L, 3).
    """
    sampling = Sampling(table.joint_rate, table.joint_delay)
    row = sampling.row_of(time, sampling.reading_at(time))
    told = joint_readings(table, angle, load)
    return {name: values[row] for name, values in told.items()}


def joint_readings(
    table: SensorsTable,
    angle: Float[np.ndarray, "readings legs 3"],
    load: Float[np.ndarray, "readings legs 3"] | None,
) -> dict[str, np.ndarray]:
    """Readings of the servos by channel name; arguments as in `joint_channels`."""
    told = {"joint_position_measured": quantised(angle, table.encoder_step)}
    if load is not None:
        told["joint_load_measured"] = quantised(np.clip(load, -1.0, 1.0), table.load_step)
    return told
