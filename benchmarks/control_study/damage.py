"""Walks over unknown ground with legs lost, on ideal and on AX-12A servos."""

from __future__ import annotations

from collections.abc import Collection
from itertools import combinations

import numpy as np
from scipy.spatial import ConvexHull

import ground
from phasmid.control import LocomotionEngine
from phasmid.control.reach import ENOUGH, reach_margin
from phasmid.control.types import Model
from phasmid.experiment import Command
from phasmid.gait import support_margin
from phasmid.kinematics import centre_of_mass, joint_angles
from phasmid.robot import load_robot

from . import terrain
from .study import Case, markdown

GROUNDS = (("slope", 0), ("blocks", 20), ("blocks", 40), ("slope", 10))
"""Kinds and sizes of ground; a slope of 0 is level."""

LEGS = range(1, 7)

PAIRS = tuple(pair for pair in combinations(LEGS, 2) if pair[1] - pair[0] not in (1, 5))
"""Pairs of legs that are not adjacent, by their numbers around the body."""

SEEDS_OF_PAIR, DISTANCE_OF_PAIR = 2, 0.3
"""Seeds of each pair, and distance to walk without it [m]."""


def cases(seeds: int = 20) -> list[Case]:
    """Return every ground and drive, with no leg lost and one, and two lost on level ground."""
    one = [
        {"kind": kind, "size": size, "lost": lost, "joints": joints, "seed": seed}
        for kind, size in GROUNDS
        for joints in terrain.DRIVES
        for damaged in (False, True)
        for seed in range(seeds)
        # The seeds spread over the legs.
        for lost in ([seed % len(LEGS) + 1] if damaged else [],)
    ]
    two = [
        {"kind": "slope", "size": 0, "lost": list(pair), "joints": joints, "seed": seed}
        for pair in PAIRS
        for joints in terrain.DRIVES
        for seed in range(min(seeds, SEEDS_OF_PAIR))
    ]
    return one + two


def measure(kind: str, size: float, lost: list[int], joints: str, seed: int) -> Case:
    """Walk over one ground with ground sensing and dynamics, without some legs from the start."""
    robot, task = terrain.robot_with(joints), ground.task_of(kind, size)
    if len(lost) == 2:
        task = task._replace(distance=DISTANCE_OF_PAIR)
    scenario = ground.scenario_of(kind, size, seed, robot, terrain.DRIVES[joints])
    command = Command(velocity=(ground.SPEED, 0.0, 0.0), lost_legs=frozenset(lost))
    engine = ground.engine_of(robot, kind, ground.BLIND)
    return terrain.case_of(ground.walk(scenario, engine, task, command)[0])


def largest_margin(lost: Collection[int]) -> float:
    """Return an upper bound of the support margin with which each remaining leg can lift [m].

    For each leg, the other feet stand wherever the level body at its neutral height reaches on
    level ground, and the margin is the largest of all such places. Below 0 no quasi-static gait
    walks.
    """
    robot = load_robot(ground.ROBOT)
    model = LocomotionEngine(robot).model
    rest = [leg - 1 for leg in LEGS if leg not in lost]
    q = joint_angles(robot.arrays, np.array(robot.arrays.neutral_foot))
    held = [leg - 1 for leg in lost]
    q[held] = model.folded[held]
    com = centre_of_mass(robot, q)[:2]
    feet = {leg: _reached(model, leg) - com for leg in rest}
    margins = []
    for lifted in rest:
        places = [feet[leg] for leg in rest if leg != lifted]
        chosen = np.stack(np.meshgrid(*map(range, map(len, places)), indexing="ij"), axis=-1)
        chosen = chosen.reshape(-1, len(places))
        stood = np.stack([p[chosen[:, k]] for k, p in enumerate(places)], axis=1)
        ones = np.ones(stood.shape[:2], dtype=bool)
        margins.append(support_margin(stood, ones, np.zeros((len(stood), 2))).max())
    return float(min(margins))


def _reached(model: Model, leg: int) -> np.ndarray:
    """Return corners of the part of the ground that a leg reaches, in the body frame [m]."""
    radius, angle = np.meshgrid(np.arange(0.05, 0.26, 0.01), np.radians(np.arange(0, 360, 5)))
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    places = model.p_body_hip[leg][:2] + np.stack([x, y], axis=-1).reshape(-1, 2)
    R, body = np.eye(3), np.array([0.0, 0.0, model.height])
    kept = [p for p in places if reach_margin(model, leg, R, body, *p, 0.0) >= ENOUGH]
    return np.array(kept)[ConvexHull(kept).vertices]


def table(results: list[Case]) -> str:
    """Return the table of the runs that passed on all or five legs, by ground and joints."""
    rows: dict[str, list[Case]] = {}
    for run in results:
        if len(run["lost"]) < 2:
            name = ground.label(run["kind"], run["size"]) if run["size"] else "level"
            rows.setdefault(f"{name}, {6 - len(run['lost'])} legs", []).append(run)
    return markdown(
        ["ground", *terrain.DRIVES], ([name, *_cells(runs)] for name, runs in rows.items())
    )


def table_of_pairs(results: list[Case]) -> str:
    """Return the table of the runs without two legs, with the bound of the support margin."""
    names = load_robot(ground.ROBOT).leg_names
    rows = []
    for pair in PAIRS:
        words = " and ".join(names[leg - 1].replace("_", " ") for leg in pair)
        runs = [run for run in results if run["lost"] == list(pair)]
        rows.append([words, f"{1000 * largest_margin(pair):.0f} mm", *_cells(runs)])
    return markdown(["lost", "support margin, at most", *terrain.DRIVES], rows)


def _cells(runs: list[Case]) -> list[str]:
    return [terrain.cell([run for run in runs if run["joints"] == name]) for name in terrain.DRIVES]
