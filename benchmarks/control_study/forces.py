"""Walks with and without feed-forward torque from the whole robot's inverse dynamics."""

from __future__ import annotations

import math

from phasmid.control import EngineSettings, LocomotionEngine
from phasmid.experiment import Command, Ending
from phasmid.robot import load_robot
from phasmid.scenario import Scenario
from phasmid.simulation import drive

from .study import Case, markdown
from .tracking import track

PERIOD, CYCLES, SHARE = 1.0, 3, 0.7
"""Duration of a cycle [s], number of cycles measured, share of the largest forward velocity."""


def cases(
    robots: tuple[str, ...] = ("phantomx-ax", "phantomx-mk4"),
    drives: tuple[str, ...] = ("ideal-servo", "servo", "torque"),
) -> list[Case]:
    """Return robots and drives, with and without dynamics."""
    return [
        {"robot": robot, "joints": joints, "dynamics": dynamics}
        for robot in robots
        for joints in drives
        for dynamics in ("none", "feed-forward")
    ]


def measure(robot: str, joints: str, dynamics: str) -> Case:
    """Walk forward once."""
    scenario = Scenario().replace(
        robot=robot,
        drive=joints,
        duration=2.0 + CYCLES * PERIOD,
        record_interval_ms=5,
        terrain="flat",
    )
    engine = LocomotionEngine(
        load_robot(robot), EngineSettings(period=PERIOD, dynamics=dynamics, ground_sensing=False)
    )
    largest = engine.largest_velocity((1.0, 0.0, 0.0)).velocity
    velocity = tuple(SHARE * part for part in largest)
    run = drive(scenario, engine, Command(velocity=velocity))
    if not Ending[run.attrs["ending"]].is_full_length:
        return {"ending": run.attrs["ending"]}
    found = track(run, velocity, period=PERIOD, cycles=CYCLES)
    return {"ending": "COMPLETED", "speed": velocity[0]} | found._asdict()


def table(results: list[Case]) -> str:
    """Return the table, without and with dynamics in adjacent rows."""
    rows = []
    for run in results:
        name = f"{run['robot']}, {run['joints']}"
        torque = "with" if run["dynamics"] == "feed-forward" else "without"
        if run["ending"] != "COMPLETED":
            rows.append([name, torque, *["fell"] + ["–"] * 5])
            continue
        rows.append(
            [
                name,
                torque,
                f"{100 * run['velocity_error']:.1f} %",
                f"{math.degrees(run['joint_error']):.2f}°",
                f"{1000 * run['slip']:.2f} mm",
                f"{run['tangential']:.2f} N",
                f"{run['power'] / run['speed']:.1f} J/m",
                f"{run['torque']:.2f} N·m",
            ]
        )
    head = ["robot, joints", "torque", "velocity error", "joint error", "slip per step"]
    return markdown([*head, "tangential force", "energy of the joints", "peak torque"], rows)
