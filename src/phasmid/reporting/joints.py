"""Torque, speed and energy of the joints, and the model's torque beside the simulated one."""

from __future__ import annotations

from typing import Any

import numpy as np

from phasmid.recording import Recording
from phasmid.reporting.source import Source, channel
from phasmid.reporting.steps import away_from_switches, durations, middle_halves, rms

SHORTEST_DISTANCE = 1e-3
"""Shortest distance with a cost of transport [m]."""


def torque(recording: Recording, source: Source, name: str) -> dict[str, Any]:
    """Return the torques of one channel.

    Args:
        recording: The recording.
        source: Its robot and experiment.
        name: ``joint_torque`` or ``joint_torque_model``.

    Returns:
        ``peak`` and ``rms`` of each joint [N·m], shape (L, 3), ``peak_over_stall`` and
        ``share_above_continuous``, the part of all samples above the servo's continuous torque;
        empty without the channel.
    """
    tau = channel(recording, name)
    if tau is None:
        return {}
    size, stall = np.abs(tau), source.stall_torque
    peak = size.max(axis=0)
    return {
        "peak": peak.tolist(),
        "rms": rms(tau, np.ones(tau.shape, dtype=bool)).tolist(),
        "peak_over_stall": (peak / stall).tolist(),
        "largest": float(peak.max()),
        "largest_over_stall": float(peak.max() / stall),
        "share_above_continuous": float((size > source.continuous_torque).mean()),
    }


def torque_difference(recording: Recording) -> dict[str, Any]:
    """Return the rms difference of torques, model less simulation, of each joint [N·m].

    Returns:
        ``rms`` away from all legs' switches and ``rms_mid_stance`` over the middle half of each
        whole stance, shape (L, 3); empty unless both are recorded.
    """
    seen, model = channel(recording, "joint_torque"), channel(recording, "joint_torque_model")
    stance = channel(recording, "stance")
    if seen is None or model is None or stance is None:
        return {}
    time = np.asarray(recording["time"].values)
    calm = np.all(away_from_switches(time, stance), axis=1, keepdims=True)[..., None]
    middle = middle_halves(stance)[..., None]
    difference = model - seen
    return {
        "rms": rms(difference, np.broadcast_to(calm, seen.shape)).tolist(),
        "rms_mid_stance": rms(difference, np.broadcast_to(middle, seen.shape)).tolist(),
    }


def speed(recording: Recording, source: Source) -> dict[str, Any]:
    """Return the peak speed of the joints [rad/s], and its share of the no-load speed."""
    for name in ("joint_velocity", "joint_velocity_target"):
        qd = channel(recording, name)
        if qd is not None:
            peak = np.abs(qd).max(axis=0)
            return {
                "channel": name,
                "peak": peak.tolist(),
                "largest": float(peak.max()),
                "largest_over_no_load": float(peak.max() / source.no_load_speed),
            }
    return {}


def energy(recording: Recording, source: Source, distance: float | None) -> dict[str, Any]:
    """Return the mechanical work of the joints and the cost of transport.

    Args:
        recording: The recording.
        source: Its robot and experiment.
        distance: Distance of the body [m]; None where unknown.

    Returns:
        ``work`` [J]: the integral of the sum over joints of max(torque · speed, 0), as braking
        recovers nothing; ``mean_power`` [W]; ``cost_of_transport``: work over
        weight and distance; ``drawn_power`` [W]: mean power that servos of their own law draw from
        their supply, most of which becomes heat. Empty without torques and speeds.
    """
    time = np.asarray(recording["time"].values)
    for torques, speeds in (
        ("joint_torque", "joint_velocity"),
        ("joint_torque_model", "joint_velocity_target"),
    ):
        tau, qd = channel(recording, torques), channel(recording, speeds)
        if tau is None or qd is None or len(time) < 2:
            continue
        power = np.maximum(tau * qd, 0.0).sum(axis=(1, 2))
        work = float(power @ durations(time))
        found = {
            "channel": torques,
            "work": work,
            "mean_power": work / float(time[-1] - time[0]),
        }
        if distance is not None and distance >= SHORTEST_DISTANCE:
            found["cost_of_transport"] = work / (source.weight * distance)
        drawn = drawn_power(recording, source)
        if drawn is not None:
            found["drawn_power"] = float(drawn.sum(axis=(1, 2)) @ durations(time)) / float(
                time[-1] - time[0]
            )
        return found
    return {}


def drawn_power(recording: Recording, source: Source) -> np.ndarray | None:
    """Return each servo's power from its supply [W], shape (N, L, 3); None where unknown.

    The bridge chops the supply: of the winding's current it draws that share. Nothing is recovered.
    """
    duty, current = channel(recording, "servo_duty"), channel(recording, "servo_current")
    if duty is None or current is None:
        return None
    supply = source.scenario.servo.supply(source.robot.servo)
    return np.maximum(duty * supply * current, 0.0)
