"""Warnings of infeasible or doubtful results."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from phasmid.errors import plain
from phasmid.recording.channels import JOINTS
from phasmid.reporting.run import Source, short
from phasmid.scenario import Scenario, idle_fields
from phasmid.servo.words import servo_quantity
from phasmid.terrain.sliding import Slide

NOTABLE_SLIP = 5e-3
"""Notable mean slip per step of ``phantomx-ax`` [m]; that of other robots follows their leg
length."""

NOTABLE_CREEP = 25e-6
"""Notable creep of a standing ``phantomx-ax`` in a gait period [m]; that of other robots follows
their leg length."""

NOTABLE_SATURATION = 0.01
"""Notable share of the time at full output."""

NOTABLE_SWING_LOAD = 0.01
"""Notable load of a swing leg, as a share of the weight."""

NOTABLE_LAG = 0.1
"""Notable deviation from the commanded distance or turn, as a share."""

LEAST_PROGRESS = 0.8
"""Share of its commanded distance below which a driven robot is warned of."""

WITHIN_STEP = 0.15
"""Part of a step by which a rest-to-rest walk leads or trails the constant pace within it: the
largest difference of 10 s³ - 15 s⁴ + 6 s⁵ from s is 0.147."""

AT_LIMIT = 1.005
"""Share of a servo's limit that counts as beyond it: one at its limit reaches it up to round-off,
and no warning shall say 100 %."""


def warnings(summary: dict[str, Any], source: Source) -> list[str]:
    """Return sentences on infeasible or doubtful results.

    Args:
        summary: The sections of `phasmid.reporting.summarise`, empty ones included.
        source: Robot and experiment; idle fields of its scenario are named.
    """
    found = [
        *_way(summary),
        *_ground(summary, source),
        *_servos(summary),
        *_limits(summary),
        *_feet(summary, source),
    ]
    scenario = source.experiment.source
    assert isinstance(scenario, Scenario)
    return [*found, *idle_fields(scenario, source.robot)]


def _limits(summary: dict[str, Any]) -> Iterator[str]:
    """Warn of torques and speeds beyond the servos, and of a robot that tips."""
    servo = short(summary["robot"]["servo"])
    stall, no_load = (servo_quantity(servo, each) for each in ("stall torque", "no-load speed"))
    unable = "these servos cannot make this walk."
    torque = summary["torque"].get("simulation") or summary["torque"].get("model") or {}
    share = torque.get("largest_over_stall", 0.0)
    if share >= AT_LIMIT:
        yield f"The largest torque is {100 * share:.0f} % of the {stall}: {unable}"
    share = summary["speed"].get("largest_over_no_load", 0.0)
    # Servos with a law of their own may be turned faster by a load.
    if share >= AT_LIMIT and not summary["servos"]:
        yield f"The fastest joint turns at {100 * share:.0f} % of the {no_load}: {unable}"
    margin = summary["support"].get("least_margin")
    if margin is not None and margin < -5e-5:
        sentence = "At times fewer than three feet stand, or all stand in a line"
        if math.isfinite(margin):
            sentence = f"The centre of mass leaves the support polygon by {-1000 * margin:.1f} mm"
        yield f"{sentence}: the robot tips."


def _feet(summary: dict[str, Any], source: Source) -> Iterator[str]:
    """Warn of feet that slip or creep in stance, or touch the ground in swing."""
    slip = summary["slip"].get("mean", 0.0)
    if slip > NOTABLE_SLIP * source.scale.length:
        yield f"Feet slip {1000 * slip:.1f} mm a step on average."
    creep, slide = summary["standing"].get("creep", 0.0), summary["standing"].get("slide")
    if slide:
        found = Slide(**slide)
        yield (
            f"The robot slides at {found.speed:.2g} m/s: {found.cause}. "
            f"Try {found.remedy(source.experiment.world.terrain)}."
        )
    elif creep * source.experiment.course.stride.period > NOTABLE_CREEP * source.scale.length:
        yield (
            f"The standing robot creeps at {1000 * creep:.2g} mm/s: below its limit, friction is a "
            "damper."
        )
    force = summary["normal_force"].get("simulation") or {}
    swing = force.get("largest_in_swing", 0.0)
    if swing > NOTABLE_SWING_LOAD * summary["robot"]["weight"]:
        yield (
            f"Swinging legs touch the ground: up to {swing:.3g} N outside "
            f"{1000 * force['swing_margin_time']:g} ms of the switches."
        )


def _way(summary: dict[str, Any]) -> Iterator[str]:
    """Warn of a completed run that does not follow its command."""
    run, way = summary["run"], summary["travel"]
    if run.get("ending") != "COMPLETED":
        return
    shares = (("walked", "distance", "distance_share"), ("turned", "turn", "turn_share"))
    for verb, noun, name in shares:
        share = way.get(name)
        if share is None:
            continue
        made = f"The robot {verb} {100 * share:z.0f} % of its commanded {noun}"
        # A driven robot reports infeasible commands itself, and may have reason to be slower.
        if run.get("controller"):
            if share < LEAST_PROGRESS:
                yield f"{made}."
            continue
        allowed = NOTABLE_LAG + WITHIN_STEP / max(way["commanded_steps"], 1e-9)
        if abs(share - 1) > allowed:
            yield f"{made}: it does not follow its plan."


def _ground(summary: dict[str, Any], source: Source) -> Iterator[str]:
    """Warn of prescribed joints on ground that the plan takes for level."""
    world = source.experiment.world
    unknown = world.kind != "flat" and not world.is_planned
    if unknown and summary["run"].get("drive") == "prescribed":
        yield (
            "Joints are prescribed on ground that the plan takes for level: feet strike it without "
            "yielding, and contact forces flicker. Try --drive ideal-servo."
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


def _servos(summary: dict[str, Any]) -> Iterator[str]:
    """Warn of shutdowns and saturation of servos of their own law."""
    time, joint = largest_joint(summary, "shutdown_time", least=True)
    if joint:
        more = len(_known_joints(summary, "shutdown_time")) - 1
        others = f", and {more} more after it" if more else ""
        yield f"The servo of the {joint} shut down at {time:.2f} s{others}."
    share, joint = largest_joint(summary, "saturated")
    if share > NOTABLE_SATURATION:
        often = f"{100 * share:.0f} % of the time"
        yield f"The servo of the {joint} gives all it has {often} and cannot follow."
