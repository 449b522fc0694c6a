"""Sentences of a page: the run, its claims, and how to repeat it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from phasmid import units
from phasmid.reporting.figure_layout import short
from phasmid.reporting.source import Source
from phasmid.reporting.summary import Summary
from phasmid.reporting.warnings import NOTABLE_SLIP, NOTABLE_SWING_LOAD

ENDED = {
    "COMPLETED": "It came to its end",
    "FELL": "The robot fell",
    "DIVERGED": "The simulation diverged",
    "INCOMPLETE": "It ended before all waypoints were reached",
    "STOPPED": "It was stopped",
    "CUT": "Its recording was cut off",
}


@dataclass(frozen=True)
class Claim:
    """A requirement on a walk, and its verdict.

    Attributes:
        what: The requirement.
        found: The measured value.
        limit: Its limit.
        holds: The verdict.
    """

    what: str
    found: str
    limit: str
    holds: bool


def sentence(summary: Summary, source: Source) -> str:
    """Return the run and its ending in a sentence or two."""
    run, robot, way = summary["run"], summary["robot"], summary.get("travel", {})
    stride, scenario = source.scenario.stride, source.scenario
    verb = {"simulation": "simulated", "model": "computed"}.get(run.get("kind", ""), "recorded")
    words = (
        f"{run['duration']:.4g} s of the scenario “{short(scenario.name)}” {verb}: the robot "
        f"{short(robot['name'])} with {len(robot['legs'])} legs and {robot['mass']:.3g} kg "
    )
    if run.get("follows") == "trajectory":
        words += "follows a trajectory of its joints"
    else:
        step, period = units.text(stride.step_length, "mm"), units.text(stride.period, "s")
        words += (
            f"walks with the {short(source.gait.name)} gait, steps of {step} and {period} a cycle"
        )
    kind = scenario.terrain.kind
    words += ", on level ground" if kind == "flat" else f", on the terrain “{kind}”"
    if run.get("drive"):
        words += f", with {short(run['drive'])} drive"
    words += f". {ENDED.get(run.get('ending', ''), 'It ended')}"
    if run["planned_duration"] - run["duration"] > 1e-9:
        longest = f"{run['planned_duration']:.4g} s"
        words += f" at {run['duration']:.4g} s"
        words += f", at most {longest}" if "waypoints" in run else f" of {longest} planned"
    if "distance" in way:
        words += f", {1000 * way['distance']:.0f} mm from where it began"
        if way.get("commanded_distance", 0.0) > 1e-3:
            words += f" ({1000 * way['commanded_distance']:.0f} mm commanded)"
    return words + "."


def claims(summary: Summary) -> Iterator[Claim]:
    """Yield the claims on a walk; their limits are those of its warnings."""
    run = summary["run"]
    if run.get("ending"):
        reason = str(run.get("ending_reason") or run["ending"].lower())
        yield Claim("The walk comes to its end", reason, "", run["ending"] == "COMPLETED")
    verdict = summary.get("servo_verdict", {})
    if verdict.get("lines"):
        answer, _, reason = verdict["lines"][0].partition(": ")
        yield Claim(
            "The servos hold the robot for long",
            f"{answer.lower()}: {reason}",
            f"{verdict['continuous_torque']:.3g} N·m rms",
            verdict["holding"] == "HOLDS",
        )
    torque: dict[str, Any] = summary.get("torque", {})
    kind = torque.get("simulation") or torque.get("model") or {}
    servo = short(summary["robot"]["servo"])
    if "largest_over_stall" in kind:
        share = kind["largest_over_stall"]
        yield Claim(
            "Simulated torques stay within the servos' stall",
            f"{kind['largest']:.3f} N·m, {100 * share:.0f} % of stall",
            f"{summary['robot']['stall_torque']:.3g} N·m ({servo})",
            share < 1.005,
        )
    if "speed" in summary:
        share = summary["speed"]["largest_over_no_load"]
        yield Claim(
            "Joints turn no faster than the servos can",
            f"{summary['speed']['largest']:.2f} rad/s, {100 * share:.0f} % of no-load speed",
            f"{summary['robot']['no_load_speed']:.3g} rad/s ({servo})",
            share < 1.005,
        )
    margin = summary.get("support", {}).get("least_margin")
    if margin is not None:
        found = f"{1000 * margin:.1f} mm at the least" if math.isfinite(margin) else "none"
        yield Claim(
            "The centre of mass stays over the feet that stand", found, "0 mm", margin >= -5e-5
        )
    if "slip" in summary:
        slip = summary["slip"]["mean"]
        yield Claim(
            "Feet stay where they stand",
            f"{1000 * slip:.2f} mm slip a step on average",
            f"{1000 * NOTABLE_SLIP:g} mm",
            slip <= NOTABLE_SLIP,
        )
    swing = summary.get("normal_force", {}).get("simulation", {}).get("largest_in_swing")
    if swing is not None:
        limit = NOTABLE_SWING_LOAD * summary["robot"]["weight"]
        yield Claim(
            "Swinging legs touch nothing", f"up to {swing:.3g} N", f"{limit:.2g} N", swing <= limit
        )


def repeat(summary: Summary) -> list[tuple[str, str]]:
    """Return purpose and command line of each way to repeat the run, its page or its data."""
    found = []
    if summary["run"].get("kind") in ("simulation", "model"):
        follows = summary["run"].get("follows") == "trajectory"
        more = " --trajectory FILE" if follows else ""
        found.append(("Run it again", f"phasmid walk scenario.toml{more} --out ../again"))
    found += [
        ("Make this page again", "phasmid report recording.nc --out ../again"),
        ("All data at full rate", "phasmid export recording.nc --format csv --out ../data.csv"),
        ("Any figure", "phasmid plot recording.nc --list"),
    ]
    return found


VERSIONS = {
    "phasmid_version": "phasmid",
    "simulator": "Simulator",
    "mujoco_version": "MuJoCo",
    "numpy_version": "NumPy",
    "numba_version": "Numba",
    "machine": "Machine",
    "drive": "Drive",
    "contact_law": "Contact",
    "force_model": "Model's forces",
    "servo": "Servo",
    "time_step": "Time step [s]",
}
"""Attributes of a recording that a page shows, and their labels."""
