"""Output, load, heat and shutdowns of the servos."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from phasmid.recording import Recording
from phasmid.reporting.source import Source, channel
from phasmid.reporting.steps import durations
from phasmid.robot.servo import HEAT_RANGE


def servo_verdict(recording: Recording) -> dict[str, Any]:
    """Return the verdict on the servos that the recording carries.

    Args:
        recording: Its attribute ``servo_verdict`` is read: `phasmid.forces.ServoVerdict` as JSON.

    Returns:
        Its numbers and ``lines``, its sentences; empty without the attribute.
    """
    try:
        found = json.loads(str(recording.attrs.get("servo_verdict", "{}")))
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def servos(recording: Recording, source: Source) -> dict[str, Any]:
    """Return how close the servos came to their limits.

    Args:
        recording: The recording.
        source: Its robot and experiment.

    Returns:
        Of each joint, shape (L, 3): ``saturated`` and ``above_continuous``, the parts of the time
        at the largest output and above the continuous torque; ``peak_temperature``,
        ``final_temperature`` and ``steady_temperature`` [°C], the last that which the mean loss
        in the winding leads to; ``time_to_limit`` [s] at this load, None where it never
        gets there; ``shutdown_time`` [s]. Besides them the
        supply and the limits. ``peak_range`` and ``steady_range`` are the
        lowest and highest estimates of the warmest joint [°C]: warmings times `HEAT_RANGE`, the
        highest with the current that the torques take without help from friction. Empty without
        the servos' channels.
    """
    duty, current = channel(recording, "servo_duty"), channel(recording, "servo_current")
    warmth, down = channel(recording, "servo_temperature"), channel(recording, "servo_shutdown")
    if duty is None or current is None or warmth is None or down is None:
        return {}
    table = source.scenario.servo
    servo = table.set_up(source.robot.servo)
    time = np.asarray(recording["time"].values)
    share = durations(time) / durations(time).sum()
    found: dict[str, Any] = {
        "voltage": table.supply(servo),
        "torque_limit": servo.torque_limit,
        "ambient_temperature": table.ambient_temperature,
        "temperature_limit": servo.temperature_limit,
        "saturated": _over_time(share, np.abs(duty) >= servo.torque_limit * (1 - 1e-12)).tolist(),
    }
    torque = channel(recording, "joint_torque")
    if torque is not None:
        above = np.abs(torque) > source.continuous_torque
        found["above_continuous"] = _over_time(share, above).tolist()
    resistance, warming = servo.motor.resistance, servo.thermal_resistance
    steady = table.ambient_temperature + warming * resistance * _over_time(share, current**2)
    hot, final = steady > servo.temperature_limit, warmth[-1]
    with np.errstate(invalid="ignore", divide="ignore"):
        # Warming and cooling are exponential: T - steady falls by e in each thermal_resistance
        # times heat_capacity.
        ratio = (steady - final) / (steady - servo.temperature_limit)
        rest = warming * servo.heat_capacity * np.log(np.maximum(ratio, 1.0))
    rise, most = steady - table.ambient_temperature, steady - table.ambient_temperature
    if torque is not None:
        motor = servo.motor
        unaided = (np.abs(torque) + motor.coulomb) / (motor.constant * (1 - motor.load_loss))
        lost = _over_time(share, np.maximum(np.abs(current), unaided) ** 2)
        most = warming * resistance * lost
    peak = warmth.max(axis=0) - table.ambient_temperature
    with np.errstate(invalid="ignore", divide="ignore"):
        hottest_peak = np.where(rise > 0, peak * most / rise, peak)
    low, high = HEAT_RANGE

    def between(least: np.ndarray, largest: np.ndarray) -> list[float]:
        ends = low * float(least.max()), high * float(largest.max())
        return [table.ambient_temperature + end for end in ends]

    first = np.where(down.any(axis=0), time[np.argmax(down, axis=0)], np.nan)
    return found | {
        "peak_temperature": warmth.max(axis=0).tolist(),
        "final_temperature": final.tolist(),
        "steady_temperature": steady.tolist(),
        "peak_range": between(peak, hottest_peak),
        "steady_range": between(rise, most),
        "time_to_limit": np.where(hot, rest, np.nan).tolist(),
        "shutdown_time": first.tolist(),
    }


def _over_time(share: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.einsum("t,tlj->lj", share, values.astype(float))
