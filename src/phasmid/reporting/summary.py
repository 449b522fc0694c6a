"""A recording in numbers."""

from __future__ import annotations

import json
import math
from typing import Any, TypeAlias

import numpy as np

from phasmid.arguments import checked
from phasmid.errors import InvalidInput, nearest
from phasmid.recording import Recording
from phasmid.reporting.checks import warnings
from phasmid.reporting.numbers import (
    energy,
    least_support,
    load,
    model_difference,
    servos,
    slip,
    speed,
    standing,
    state_estimate,
    torque,
    travel,
    velocity,
    verdict,
)
from phasmid.reporting.run import events, read_run

Summary: TypeAlias = dict[str, Any]
"""Numbers in SI by name, as JSON holds them."""

NUMBERS = {
    "run": "duration planned_duration samples samples_not_finite time_step",
    "robot": "continuous_torque gravity mass no_load_speed stall_torque supply weight",
    "travel": "body_height_change body_height_range commanded_distance commanded_forward "
    "commanded_sideways commanded_steps commanded_turn distance distance_share forward "
    "heading_change largest_tilt mean_speed sideways sideways_drift turn_share",
    "state_estimate": "position_drift position_error velocity_error",
    "slip": "largest mean steps",
    "standing": "creep",
    "standing.slide": "friction slope speed",
    **dict.fromkeys(
        ("normal_force.simulation", "normal_force.model"),
        "cycles largest largest_in_swing mean_sum sum_over_weight swing_margin_time",
    ),
    **dict.fromkeys(
        ("torque.simulation", "torque.model"), "largest largest_over_stall share_above_continuous"
    ),
    "speed": "largest largest_over_no_load",
    "servo_verdict": "ambient_temperature continuous_torque floor_friction highest_voltage "
    "least_friction least_margin speed_share "
    "stall_torque temperature_limit torque voltage",
    "servos": "ambient_temperature temperature_limit torque_limit voltage",
    "support": "least_margin",
    "energy": "cost_of_transport electrical_energy electrical_power friction_work mean_power work",
    "model_against_simulation": "left_out_about_switches",
}
"""Single numbers of a summary by section; a run has those of what it records."""

ABSENT = {
    "plan": (
        *("run.time_step", "robot.supply", "state_estimate", "servos"),
        *("standing", "standing.slide"),
        *("energy.electrical_energy", "energy.electrical_power", "energy.friction_work"),
        *("normal_force.simulation", "torque.simulation", "model_against_simulation"),
    ),
    "simulate": ("state_estimate",),
    "drive": ("normal_force.model", "torque.model", "model_against_simulation"),
}
"""Sections and numbers that each kind of run lacks."""


def check_number(name: str, kind: str) -> None:
    """Refuse the name of a number that no summary of a run has.

    Args:
        name: Its place in the summary, such as ``energy.cost_of_transport``.
        kind: Kind of run: ``plan``, ``simulate`` or ``drive``.

    Raises:
        InvalidInput: With the nearest name.
    """
    known = [
        f"{section}.{number}"
        for section, numbers in NUMBERS.items()
        for number in numbers.split()
        if not {section, f"{section}.{number}"} & set(ABSENT[kind])
    ]
    if name not in known:
        guess = nearest(name, known)
        raise InvalidInput(
            f'the summary of a run of kind "{kind}" has no number "{name}".',
            hint=f'"{guess}"' if guess else "a number of summary.json",
        )


@checked
def summarise(recording: Recording) -> Summary:
    """Return the numbers of a walk.

    Args:
        recording: A simulation, an analysis or a robot's log; it carries its robot and scenario.

    Returns:
        A dictionary that JSON can hold, in SI: the sections ``run``, ``robot``, ``travel``,
        ``velocity``, ``state_estimate``, ``slip``, ``standing``, ``normal_force``, ``torque``,
        ``speed``, ``servo_verdict``, ``servos``, ``support``, ``energy`` and
        ``model_against_simulation``, and ``warnings``, sentences on doubtful results.
        What is not recorded is absent.

    Raises:
        InvalidInput: The recording does not carry the robot and the scenario.
    """
    part = read_run(recording)
    robot, experiment, time = part.robot, part.experiment, part.time
    attributes = part.recording.attrs
    way = travel(part)
    texts = [
        *("kind", "ending", "ending_reason", "force_model", "drive", "servo", "contact_law"),
        *("simulator", "phasmid_version", "mujoco_version", "controller"),
    ]
    run: dict[str, Any] = {name: part.attribute(name) for name in texts} | {
        "time_step": attributes.get("time_step"),
        "title": part.title,
        "scenario": experiment.name,
        "gait": part.gait.name,
        "duration": float(time[-1] - time[0]),
        "samples": recording.sizes["time"],
        "samples_not_finite": recording.sizes["time"] - len(time) or None,
        "planned_duration": experiment.duration,
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
            "gravity": experiment.world.gravity,
            "weight": part.weight,
            "servo": robot.servo.name,
            "stall_torque": robot.servo.stall_torque,
            "no_load_speed": robot.servo.no_load_speed,
            "supply": part.supply,
            "continuous_torque": part.continuous_torque,
        },
        "travel": way,
        "velocity": velocity(part),
        "state_estimate": state_estimate(part, way.get("distance")),
        "slip": slip(part),
        "standing": standing(part),
        "normal_force": {
            "simulation": load(part, "foot_normal_force"),
            "model": load(part, "foot_normal_force_model"),
        },
        "torque": {
            "simulation": torque(part, "joint_torque"),
            "model": torque(part, "joint_torque_model"),
        },
        "speed": speed(part),
        "servo_verdict": verdict(part),
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
