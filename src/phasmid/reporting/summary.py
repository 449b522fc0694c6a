"""A recording in numbers."""

from __future__ import annotations

import json
import math
from typing import Any, TypeAlias

import numpy as np

from phasmid.recording import Recording
from phasmid.reporting.checks import warnings
from phasmid.reporting.numbers import (
    energy,
    least_support,
    load,
    model_difference,
    servo_verdict,
    servos,
    slip,
    speed,
    state_estimate,
    torque,
    travel,
    velocity,
)
from phasmid.reporting.run import events, read_run

Summary: TypeAlias = dict[str, Any]
"""Numbers in SI by name, as JSON holds them."""


def summarise(recording: Recording) -> Summary:
    """Return the numbers of a walk.

    Args:
        recording: A simulation, an analysis or a robot's log; it carries its robot and scenario.

    Returns:
        A dictionary that JSON can hold, in SI: the sections ``run``, ``robot``, ``travel``,
        ``velocity``, ``state_estimate``, ``slip``, ``normal_force``, ``torque``, ``speed``,
        ``servo_verdict``, ``servos``, ``support``, ``energy`` and ``model_against_simulation``,
        and ``warnings``, sentences on doubtful results.
        What is not recorded is absent.

    Raises:
        InvalidInput: The recording does not carry the robot and the scenario.
    """
    part = read_run(recording)
    robot, scenario, time = part.robot, part.scenario, part.time
    attributes = part.recording.attrs
    way = travel(part)
    texts = [
        *("kind", "ending", "ending_reason", "force_model", "drive", "servo", "contact_law"),
        *("simulator", "phasmid_version", "mujoco_version", "controller"),
    ]
    run: dict[str, Any] = {name: part.attribute(name) for name in texts} | {
        "time_step": attributes.get("time_step"),
        "title": part.title,
        "scenario": scenario.name,
        "gait": part.gait.name,
        "duration": float(time[-1] - time[0]),
        "samples": recording.sizes["time"],
        "samples_not_finite": recording.sizes["time"] - len(time) or None,
        "planned_duration": scenario.duration,
        "follows": "trajectory" if "trajectory" in attributes else None,
        "waypoints": json.loads(str(attributes.get("waypoints", "[]"))),
        "faults": json.loads(str(attributes.get("faults", "[]"))),
        "events": events(part.recording),
    }
    summary: Summary = {
        "run": run,
        "robot": {
            "name": robot.name,
            "legs": list(robot.leg_names),
            "mass": robot.mass,
            "gravity": scenario.model.gravity,
            "weight": part.weight,
            "servo": robot.servo.name,
            "stall_torque": part.stall_torque,
            "no_load_speed": part.no_load_speed,
            "supply": part.supply,
            "continuous_torque": part.continuous_torque,
        },
        "travel": way,
        "velocity": velocity(part),
        "state_estimate": state_estimate(part, way.get("distance")),
        "slip": slip(part),
        "normal_force": {
            "simulation": load(part, "foot_normal_force"),
            "model": load(part, "foot_normal_force_model"),
        },
        "torque": {
            "simulation": torque(part, "joint_torque"),
            "model": torque(part, "joint_torque_model"),
        },
        "speed": speed(part),
        "servo_verdict": servo_verdict(part),
        "servos": servos(part),
        "support": {"least_margin": least_support(part)},
        "energy": energy(part, way.get("distance")),
        "model_against_simulation": model_difference(part),
    }
    compact: Summary = _known(summary)
    compact["warnings"] = warnings(summary, part)
    return compact


def _known(value: Any) -> Any:
    """Return a copy without unknown values; in rows, which keep their length, they become None."""
    if isinstance(value, dict):
        kept = {key: _known(inner) for key, inner in value.items()}
        return {key: inner for key, inner in kept.items() if inner not in (None, {}, [], "")}
    if isinstance(value, list):
        row = [_known(inner) for inner in value]
        return None if all(inner is None for inner in row) else row
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
