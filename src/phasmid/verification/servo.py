"""Servos within their limits, in every sample of a walk."""

from __future__ import annotations

from typing import get_args

import numpy as np

from phasmid.motion import plan
from phasmid.recording import Recording
from phasmid.robot import Robot
from phasmid.scenario.simulation import SimulationTable
from phasmid.verification.laboratory import Laboratory
from phasmid.verification.row import Reading


def servo_limits(laboratory: Laboratory) -> list[Reading]:
    """Excess of torque, speed and angle over the servo's limits, four seconds of walk."""
    drives = get_args(SimulationTable.model_fields["drive"].annotation)
    readings = []
    for drive in drives:
        if drive == "prescribed":
            # It takes whatever torque it needs, and says so.
            continue
        recording = laboratory.walk(drive=drive, duration=4.0)
        robot = plan(laboratory.scenario).robot
        for what, (excess, unit) in _excesses(robot, recording).items():
            readings.append(
                Reading(
                    max(excess, 0.0),
                    1e-9,
                    "Limits are limits: the engine clamps them to round-off.",
                    unit=unit,
                    case=f"{what}, {drive}",
                )
            )
    return readings


def _excesses(robot: Robot, recording: Recording) -> dict[str, tuple[float, str]]:
    """The largest excess over each limit, and its unit."""
    servo = robot.servo
    torque, speed, angle = (
        recording[f"joint_{name}"].values for name in ("torque", "velocity", "position")
    )
    # From stall at rest to none at the no-load speed, where the servo drives the joint.
    driving = np.maximum(torque * np.sign(speed), 0.0)
    line = servo.stall_torque * np.maximum(1 - np.abs(speed) / servo.no_load_speed, 0.0)
    lower, upper = np.moveaxis(robot.arrays.joint_limits, -1, 0)
    return {
        "torque": (float(np.abs(torque).max() - servo.stall_torque), "N·m"),
        "torque at speed": (float((driving - line).max()), "N·m"),
        "speed": (float(np.abs(speed).max() - servo.no_load_speed), "rad/s"),
        "range": (float(np.maximum(lower - angle, angle - upper).max()), "rad"),
    }
