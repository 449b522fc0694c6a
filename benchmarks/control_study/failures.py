"""Walks during which one servo dies: the robot continues on five legs."""

from __future__ import annotations

import numpy as np

from phasmid import load_robot
from phasmid.control import LocomotionEngine, SafetyFilter, Sequencer
from phasmid.experiment import Command, Ending
from phasmid.robot import JOINTS
from phasmid.scenario import Scenario
from phasmid.simulation import drive

from .study import Case

ROBOT = "phantomx-ax"
DIES, JUDGED, ENDS = 4.0, 6.0, 12.0
"""Times at which the servo dies, the judged part begins, and the run ends [s]."""

WALKS = 0.02
"""Least speed of a run that passes [m/s]."""


def cases(drives: tuple[str, ...] = ("ideal-servo", "servo"), legs: int = 6) -> list[Case]:
    """Return every servo with each drive."""
    names = load_robot(ROBOT).leg_names[:legs]
    return [
        {"joints": kind, "leg": leg, "joint": joint}
        for kind in drives
        for leg in names
        for joint in JOINTS
    ]


def measure(joints: str, leg: str, joint: str) -> Case:
    """Walk forward at half the largest velocity while a servo dies."""
    robot = load_robot(ROBOT)
    engine = LocomotionEngine(robot)
    velocity = engine.largest_velocity((1.0, 0.0, 0.0)).velocity[0] / 2
    run = drive(
        Scenario().replace(robot=ROBOT, drive=joints, duration=ENDS, record_interval_ms=20),
        SafetyFilter(Sequencer(engine, robot), robot),
        Command(velocity=(velocity, 0.0, 0.0)),
        faults=[f"{leg}.{joint} dead at {DIES:g} s"],
    )
    time, place = run["time"].values, run["body_position"].values
    dies, since = (min(int(np.searchsorted(time, t)), len(time) - 1) for t in (DIES, JUDGED))
    speed = float((place[-1, 0] - place[since, 0]) / max(time[-1] - time[since], 1e-9))
    return {
        "walks": Ending[run.attrs["ending"]].is_full_length and speed > WALKS,
        "ending": run.attrs["ending"],
        "velocity": velocity,
        "speed": speed,
        "way": float(place[-1, 0] - place[dies, 0]),
        "lowest": float(place[dies:, 2].min()),
    }
