"""A recording in numbers."""

from __future__ import annotations

import json
import math
from typing import Any, TypeAlias

import numpy as np

from phasmid.recording import Recording
from phasmid.reporting.feet import least_support, load, load_difference, slip
from phasmid.reporting.joints import energy, speed, torque, torque_difference
from phasmid.reporting.servos import servo_verdict, servos
from phasmid.reporting.source import attribute, events, finite_part, read_source, run_title
from phasmid.reporting.steps import SETTLING
from phasmid.reporting.travel import travel, velocity
from phasmid.reporting.warnings import warnings

Summary: TypeAlias = dict[str, Any]
"""Numbers in SI by name, as JSON holds them."""

REFINEMENT = ("time_step", "duration", "normal_force", "joint_torque", "way")
"""Attributes of a comparison with half the time step: relative rms differences of forces and
torques, and the largest distance between the trunks [m]."""


def summarise(recording: Recording) -> Summary:
    """Return the numbers of a walk.

    Args:
        recording: A simulation, an analysis or a robot's log; it carries its robot and scenario.

    Returns:
        A dictionary that JSON can hold, in SI: the sections ``run``, ``robot``, ``travel``,
        ``velocity``, ``slip``, ``normal_force``, ``torque``, ``speed``, ``servo_verdict``,
        ``servos``, ``support``, ``energy``, ``time_step_refinement`` and
        ``model_against_simulation``, and ``warnings``, sentences on doubtful results.
        What is not recorded is absent.

    Raises:
        InvalidInput: The recording does not carry the robot and the scenario.
    """
    source = read_source(recording)
    recorded, recording = recording.sizes["time"], finite_part(recording)
    robot, scenario = source.robot, source.scenario
    time = np.asarray(recording["time"].values)
    way = travel(recording, source)
    margin = least_support(recording, source)
    normal_difference = load_difference(recording)
    run: dict[str, Any] = {
        name: attribute(recording, name)
        for name in ("kind", "ending", "ending_reason", "force_model", "drive", "servo")
    }
    run |= {name: attribute(recording, name) for name in ("contact_law", "simulator")}
    run |= {name: recording.attrs.get(name) for name in ("time_step",)}
    run |= {name: attribute(recording, name) for name in ("phasmid_version", "mujoco_version")}
    run |= {
        "title": run_title(source),
        "scenario": scenario.name,
        "gait": source.gait.name,
        "duration": float(time[-1] - time[0]),
        "samples": recorded,
        "samples_not_finite": recorded - len(time) or None,
        "planned_duration": scenario.duration,
        "follows": "trajectory" if "trajectory" in recording.attrs else None,
        "controller": attribute(recording, "controller"),
        "waypoints": json.loads(str(recording.attrs.get("waypoints", "[]"))),
        "faults": json.loads(str(recording.attrs.get("faults", "[]"))),
        "events": events(recording),
    }
    summary = {
        "run": run,
        "robot": {
            "name": robot.name,
            "legs": list(robot.leg_names),
            "mass": robot.mass,
            "gravity": scenario.model.gravity,
            "weight": source.weight,
            "servo": robot.servo.name,
            "stall_torque": source.stall_torque,
            "no_load_speed": source.no_load_speed,
            "supply": source.supply,
            "continuous_torque": source.continuous_torque,
        },
        "travel": way,
        "velocity": velocity(recording),
        "slip": slip(recording, source),
        "normal_force": {
            "simulation": load(recording, source, "foot_normal_force"),
            "model": load(recording, source, "foot_normal_force_model"),
        },
        "torque": {
            "simulation": torque(recording, source, "joint_torque"),
            "model": torque(recording, source, "joint_torque_model"),
        },
        "speed": speed(recording, source),
        "servo_verdict": servo_verdict(recording),
        "servos": servos(recording, source),
        "support": {"least_margin": margin},
        "energy": energy(recording, source, way.get("distance")),
        "time_step_refinement": {
            name: recording.attrs.get(f"refinement_{name}") for name in REFINEMENT
        },
        "model_against_simulation": {
            "left_out_about_switches": SETTLING if normal_difference else None,
            "torque": torque_difference(recording),
            "normal_force": {"rms": normal_difference},
        },
    }
    compact: Summary = _known(summary)
    compact["warnings"] = warnings(summary, source)
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
