"""Random commands: no jump, no fall, and no target out of reach."""

from __future__ import annotations

import json
import sys
from collections import Counter
from pathlib import Path

import numpy as np

from phasmid.control import LocomotionEngine
from phasmid.experiment import Command, Ending
from phasmid.robot import load_robot
from phasmid.scenario import Scenario
from phasmid.simulation import drive as simulate

from .study import Case, grouped, markdown

sys.path.append(str(Path(__file__).parents[2] / "tests"))

from kinematic_world import drive, random_commands, worst

ROBOT = "phantomx-ax"
SETTLING = 8.0
"""Time at the end in which a robot comes to rest [s]."""

WORLDS = {
    "forces-free": "kinematic simulation",
    "ideal-servo": "the physics engine, ideal servos",
}


def cases(kinematic: int = 1000, simulated: int = 100, duration: float = 30.0) -> list[Case]:
    """Return the seeds of each world."""
    counts = {"forces-free": kinematic, "ideal-servo": simulated}
    return [
        {"world": world, "seed": seed, "duration": duration}
        for world, count in counts.items()
        for seed in range(count)
    ]


def measure(world: str, seed: int, duration: float) -> Case:
    """Follow one sequence of commands, and stop."""
    robot = load_robot(ROBOT)
    commands = random_commands(robot, np.random.default_rng(seed), duration - SETTLING)
    commands.append((duration - SETTLING, Command(gait=commands[-1][1].gait)))
    if world == "forces-free":
        engine = LocomotionEngine(robot)
        seen = drive(engine, commands, duration)
        numbers = worst(seen)
        found: Case = {
            "fell": False,
            "joint_speed": numbers["speed"],
            "beyond": numbers["beyond"] > 0,
            "margin": numbers["margin"],
            "slip": numbers["slip"],
            "way": numbers["way"],
            "rests": engine.is_standing,
            "unreachable": any("held all" in sentence for _, sentence in seen.events),
        }
    else:
        found = _simulated(robot, commands, duration, world)
    return found | {"commands": len(commands), "wrong": _wrong(found)}


def _simulated(robot, timed, duration: float, world: str) -> Case:
    scenario = Scenario().replace(
        robot=ROBOT, drive=world, duration=duration, record_interval_ms=5, terrain="flat"
    )
    engine = LocomotionEngine(robot)
    rest, now = list(timed), timed[0][1]

    def commands(time, _):
        nonlocal now
        while rest and rest[0][0] <= time + 1e-9:
            now = rest.pop(0)[1]
        return now

    run = simulate(scenario, engine, commands)
    target = run["joint_position_target"].values
    limits = robot.arrays.joint_limits
    beyond = np.maximum(limits[..., 0] - target, target - limits[..., 1]).max()
    speed = np.abs(np.diff(target, axis=0)).max() / float(np.diff(run["time"].values).min())
    place = run["body_position"].values[:, :2]
    events = [sentence for _, sentence in json.loads(str(run.attrs["events"]))]
    return {
        "fell": not Ending[run.attrs["ending"]].is_full_length,
        "reason": run.attrs["ending_reason"],
        "joint_speed": float(speed / robot.servo.no_load_speed),
        "beyond": bool(beyond > 0),
        "margin": float(run["support_margin"].values.min()),
        "way": float(np.linalg.norm(np.diff(place, axis=0), axis=1).sum()),
        "rests": engine.is_standing,
        "unreachable": any("held all" in sentence for sentence in events),
    }


def _wrong(found: Case) -> list[str]:
    judged = {
        "fell": found["fell"],
        "joint faster than its servo": found["joint_speed"] > 1 + 1e-9,
        "joint beyond its limit": found["beyond"],
        "support margin below zero": not found["margin"] >= 0,
        "standing foot moved": found.get("slip", 0.0) > 1e-9,
        "unreachable": found["unreachable"],
        "never came to rest": not found["rests"] and not found["fell"],
    }
    return [name for name, is_so in judged.items() if is_so]


def table(results: list[Case]) -> str:
    """Return the table of the page."""
    rows = []
    for (world,), runs in grouped(results, "world").items():
        failures = Counter(name for run in runs for name in run["wrong"])
        rows.append(
            [
                WORLDS[world],
                len(runs),
                f"{runs[0]['duration']:g} s",
                sum(run["commands"] for run in runs),
                f"{sum(run['way'] for run in runs):.0f} m",
                sum(not run["wrong"] for run in runs),
                f"{1000 * min(run['margin'] for run in runs):.1f} mm",
                f"{100 * max(run['joint_speed'] for run in runs):.1f} %",
                ", ".join(f"{name}: {count}" for name, count in failures.items()) or "none",
            ]
        )
    head = ["world", "sequences", "duration", "commands", "distance", "passed"]
    return markdown(
        [*head, "least support margin", "fastest joint, of its servo's", "failures"], rows
    )
