"""Servos within their limits, in every sample of a walk."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np

from phasmid.recording import Recording
from phasmid.scenario import Scenario
from phasmid.scenario.simulation import SimulationTable
from phasmid.verification.laboratory import Laboratory
from phasmid.verification.row import Reading

Excesses = dict[str, tuple[float, str]]
"""The largest excess over each limit, and its unit."""


def servo_limits(laboratory: Laboratory) -> list[Reading]:
    """Excess of torque, speed and angle over the servo's limits, four seconds of walk."""
    drives = get_args(SimulationTable.model_fields["drive"].annotation)
    readings = []
    for drive in drives:
        if drive == "prescribed":
            # It takes whatever torque it needs, and says so.
            continue
        changes: dict[str, Any] = {"drive": drive, "duration": 4.0}
        if laboratory.scenario.record_steps > 1:
            # From one step to the next the rotor's motion is followed.
            changes["record_interval"] = laboratory.scenario.simulation.dt
        scenario, recording = laboratory.scenario.replace(**changes), laboratory.walk(**changes)
        own = "servo_current" in recording
        found = _motor(scenario, recording) if own else _ideal(scenario, recording)
        for what, (excess, unit) in (found | _range(scenario, recording)).items():
            readings.append(
                Reading(
                    max(excess, 0.0),
                    1e-9,
                    "Limits are limits: they are clamped, to round-off.",
                    unit=unit,
                    case=f"{what}, {drive}",
                )
            )
    return readings


def _ideal(scenario: Scenario, recording: Recording) -> Excesses:
    """From stall at rest to none at the no-load speed, where the servo drives the joint."""
    servo = scenario.load_robot().servo
    torque, speed = (recording[f"joint_{name}"].values for name in ("torque", "velocity"))
    driving = np.maximum(torque * np.sign(speed), 0.0)
    line = servo.stall_torque * np.maximum(1 - np.abs(speed) / servo.no_load_speed, 0.0)
    return {
        "torque": (float(np.abs(torque).max() - servo.stall_torque), "N·m"),
        "torque at speed": (float((driving - line).max()), "N·m"),
        "speed": (float(np.abs(speed).max() - servo.no_load_speed), "rad/s"),
    }


def _motor(scenario: Scenario, recording: Recording) -> Excesses:
    """Of a motor under its supply, and of the gears behind it.

    A step begins with the rotor's speed of the sample before and ends with that of its own: with
    i = (duty V - k w')/R its inertia takes J (w - w')/dt = k i - b w' - torque - friction, and the
    friction is no more than c0 + c1 |k i|.
    """
    table: Any = scenario.servo
    servo: Any = table.set_up(scenario.load_robot().servo)
    motor = servo.motor
    duty, current = (recording[f"servo_{name}"].values[1:] for name in ("duty", "current"))
    torque, speed = recording["joint_torque"].values[1:], recording["servo_speed"].values
    running = ~recording["servo_shutdown"].values[:-1]
    before, change = speed[:-1], np.diff(speed, axis=0) / scenario.simulation.dt
    law = running * (duty * table.supply(servo) - motor.constant * before) / motor.resistance
    push = motor.constant * current
    friction = push - motor.viscous * before - servo.armature * change - torque
    most = motor.coulomb + motor.load_loss * np.abs(push)
    return {
        "share of the supply": (float(np.abs(duty).max() - servo.torque_limit), "1"),
        "current, off the motor's law": (float(np.abs(current - law).max()), "A"),
        "torque, beyond what friction explains": (float((np.abs(friction) - most).max()), "N·m"),
    }


def _range(scenario: Scenario, recording: Recording) -> Excesses:
    angle = recording["joint_position"].values
    lower, upper = np.moveaxis(scenario.load_robot().arrays.joint_limits, -1, 0)
    return {"range": (float(np.maximum(lower - angle, angle - upper).max()), "rad")}
