"""Warnings on a walk, in sentences."""

from __future__ import annotations

import math
from typing import Any

from phasmid.errors import plain
from phasmid.recording.channels import JOINTS
from phasmid.reporting.joints import SHORTEST_DISTANCE
from phasmid.reporting.source import Source
from phasmid.scenario import idle_fields

NOTABLE_SLIP = 5e-3
"""Notable mean slip per step [m]."""

NOTABLE_SATURATION = 0.01
"""Notable share of the time at full output."""

NOTABLE_SWING_LOAD = 0.01
"""Notable load of a swing leg, as a share of the weight."""

NOTABLE_LAG = 0.1
"""Notable deviation from the commanded distance or turn, as a share."""

WITHIN_STEP = 0.15
"""Part of a step by which a rest-to-rest walk leads or trails the constant pace within it: the
largest difference of 10 s³ - 15 s⁴ + 6 s⁵ from s is 0.147."""

NOTABLE_REFINEMENT = 0.05
"""Notable rms difference of forces or torques from those at half the time step, over their rms.
The paper's walk has 0.4 %; the assumed contact law changes the forces by some per cent."""

MOST_HALVES = 4
"""Most halvings of the proposed time step."""


def warnings(summary: dict[str, Any], source: Source) -> list[str]:
    """Return sentences on infeasible or doubtful results.

    Args:
        summary: The sections of `phasmid.reporting.summarise`. Torques are the simulated ones, or
            else the model's.
        source: Robot and experiment; idle fields of its scenario are named.
    """
    # Servos with a law of their own may be turned faster by a load.
    limited = bool(summary["servos"])
    found = [
        *_way(summary),
        _unknown_ground(summary, source),
        _stall(summary),
        "" if limited else _speed(summary),
        _armature(source),
        _shutdown(summary),
        _saturation(summary),
        _heat(summary),
        _support(summary),
        _swing(summary),
        _slip(summary),
        _time_step(summary),
    ]
    sentences = [sentence for sentence in found if sentence]
    return sentences + idle_fields(source.scenario, source.robot)


def _unknown_ground(summary: dict[str, Any], source: Source) -> str:
    """Warn of prescribed joints on ground that the plan takes for level."""
    terrain = source.scenario.terrain
    if summary["run"].get("drive") != "prescribed" or terrain.kind == "flat":
        return ""
    if terrain.planned_on == "terrain":
        return ""
    return (
        "Joints are prescribed on ground that the plan takes for level: feet strike it without "
        "yielding, and contact forces flicker. Try --drive ideal-servo."
    )


def _way(summary: dict[str, Any]) -> list[str]:
    """Warn of a completed walk that missed its commanded distance or turn."""
    run, way = summary["run"], summary["travel"]
    # A trajectory commands joints only.
    if run.get("ending") != "COMPLETED" or run.get("follows") == "trajectory":
        return []
    # A driven robot reports infeasible commands itself.
    if run.get("controller"):
        return []
    found = []
    if "distance" in way:
        ahead = math.hypot(way["commanded_forward"], way["commanded_sideways"])
        made, planned = way["distance"], way["commanded_distance"]
        # A way that is not nearly a circle has a direction, and what lies across it is no part.
        if ahead > planned / 2:
            along = way["commanded_forward"] * way["forward"]
            along += way["commanded_sideways"] * way["sideways"]
            made, planned = along / ahead, ahead
        found.append(("walked", "way", made, planned))
    if "heading_change" in way:
        found.append(("turned", "turn", way["heading_change"], way["commanded_turn"]))
    allowed = NOTABLE_LAG + WITHIN_STEP / max(way["commanded_steps"], 1e-9)
    return [
        f"The robot {verb} {100 * made / planned:.0f} % of its {noun}: it does not follow its plan."
        for verb, noun, made, planned in found
        if abs(planned) > SHORTEST_DISTANCE and abs(made / planned - 1) > allowed
    ]


def _stall(summary: dict[str, Any]) -> str:
    torque = summary["torque"].get("simulation") or summary["torque"].get("model") or {}
    percent = 100 * torque.get("largest_over_stall", 0.0)
    # A servo at its limit reaches stall up to round-off, and no warning shall say 100 %.
    if percent < 100.5:
        return ""
    return (
        f"The largest torque is {percent:.0f} % of the {plain(summary['robot']['servo'])}'s stall: "
        "these servos cannot make this walk."
    )


def _speed(summary: dict[str, Any]) -> str:
    percent = 100 * summary["speed"].get("largest_over_no_load", 0.0)
    if percent < 100.5:
        return ""
    return (
        f"The fastest joint turns at {percent:.0f} % of the {plain(summary['robot']['servo'])}'s "
        "no-load speed: these servos cannot make this walk."
    )


def largest_joint(summary: dict[str, Any], name: str, *, least: bool = False) -> tuple[float, str]:
    """Return the largest, or the least, of the servos' numbers of one name, and its joint.

    Args:
        summary: The sections of `phasmid.reporting.summarise`.
        name: Name of the numbers of all joints, shape (L, 3); unknown ones are left out.
        least: Return the least.
    """
    known = _known_joints(summary, name)
    return (min if least else max)(known, key=lambda item: item[0], default=(math.nan, ""))


def _known_joints(summary: dict[str, Any], name: str) -> list[tuple[float, str]]:
    rows = summary["servos"].get(name) or [None] * len(summary["robot"]["legs"])
    return [
        (value, f"{plain(leg).replace('_', ' ')} {joint}")
        for leg, row in zip(summary["robot"]["legs"], rows, strict=True)
        for value, joint in zip(row or [None] * 3, JOINTS, strict=True)
        if value is not None and not math.isnan(value)
    ]


def _armature(source: Source) -> str:
    servo = source.robot.servo
    if source.scenario.simulation.drive != "servo" or servo.armature:
        return ""
    return (
        f"The armature of the {plain(servo.name)} is not given; {servo.rotor_inertia:.2g} kg m² is "
        "assumed, from its stall torque and no-load speed."
    )


def _shutdown(summary: dict[str, Any]) -> str:
    time, joint = largest_joint(summary, "shutdown_time", least=True)
    if not joint:
        return ""
    more = len(_known_joints(summary, "shutdown_time")) - 1
    others = f", and {more} more after it" if more else ""
    return f"The servo of the {joint} shut down at {time:.2f} s{others}."


def _saturation(summary: dict[str, Any]) -> str:
    share, joint = largest_joint(summary, "saturated")
    if not joint or share <= NOTABLE_SATURATION:
        return ""
    return (
        f"The servo of the {joint} gives all it has {100 * share:.0f} % of the time and cannot "
        "follow."
    )


def _heat(summary: dict[str, Any]) -> str:
    time, joint = largest_joint(summary, "time_to_limit", least=True)
    if not joint:
        return ""
    return (
        f"The servo of the {joint} would be too hot after about {time / 60:.2g} min more of this: "
        f"{summary['servos']['temperature_limit']:g} °C. The heat figures are assumed."
    )


def _support(summary: dict[str, Any]) -> str:
    margin = summary["support"].get("least_margin")
    if margin is None or margin >= -5e-5:
        return ""
    if math.isinf(margin):
        return "At times fewer than three feet stand, or all stand in a line: the robot tips."
    return (
        f"The centre of mass leaves the support polygon by {-1000 * margin:.1f} mm: the robot tips."
    )


def _swing(summary: dict[str, Any]) -> str:
    force = summary["normal_force"].get("simulation") or {}
    largest = force.get("largest_in_swing", 0.0)
    if largest <= NOTABLE_SWING_LOAD * summary["robot"]["weight"]:
        return ""
    return (
        f"Swinging legs touch the ground: up to {largest:.3g} N outside "
        f"{1000 * force['swing_margin_time']:g} ms of the switches."
    )


def _slip(summary: dict[str, Any]) -> str:
    mean = summary["slip"].get("mean", 0.0)
    if mean <= NOTABLE_SLIP:
        return ""
    return f"Feet slip {1000 * mean:.1f} mm a step on average."


def _time_step(summary: dict[str, Any]) -> str:
    found = summary["time_step_refinement"]
    worst = max(found.get("normal_force") or 0.0, found.get("joint_torque") or 0.0)
    if not worst > NOTABLE_REFINEMENT:
        return ""
    # An error of first order falls with the step. Halves of a step fit every interval that it fits.
    halves = min(math.ceil(math.log2(worst / NOTABLE_REFINEMENT)), MOST_HALVES)
    shorter = found["time_step"] / 2**halves
    return (
        f"At half the time step forces or torques differ by {100 * worst:.0f} %: it is too long; "
        f"try --dt {shorter:.4g}."
    )
