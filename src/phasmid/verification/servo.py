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
        scenario = laboratory.scenario.replace(drive=drive, duration=4.0)
        recording = laboratory.walk(drive=drive, duration=4.0)
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
    """Of a motor under the share of the supply that its servo gives it at the most."""
    table: Any = scenario.servo
    servo: Any = table.set_up(scenario.load_robot().servo)
    motor, supply = servo.motor, table.voltage
    duty, current = recording["servo_duty"].values, recording["servo_current"].values
    # What the voltage leaves over the resistance is the speed's; as a motor it drives, else it
    # is driven.
    speed = (supply * duty - motor.resistance * current) / motor.constant
    drives = current * speed > 0
    most = servo.torque_limit * supply
    lifts = (1 - motor.load_loss) * motor.constant * np.abs(current) - motor.coulomb
    return {
        "share of the supply": (float(np.abs(duty).max() - servo.torque_limit), "1"),
        "torque": (float(lifts[drives].max() - motor.stall_torque(most)), "N·m"),
        "speed": (float(np.abs(speed[drives]).max() - most / motor.constant), "rad/s"),
    }


def _range(scenario: Scenario, recording: Recording) -> Excesses:
    angle = recording["joint_position"].values
    lower, upper = np.moveaxis(scenario.load_robot().arrays.joint_limits, -1, 0)
    return {"range": (float(np.maximum(lower - angle, angle - upper).max()), "rad")}
