"""How long an update takes, and how much faster than the clock a driven simulation is."""

from __future__ import annotations

import time

import numpy as np

from phasmid.control import Command, EngineSettings, LocomotionEngine, Observation
from phasmid.robot import load_robot
from phasmid.scenario import Scenario
from phasmid.simulation import drive

from .study import Case, markdown

ROBOT = "phantomx-ax"
STAGES = {
    "walking alone": {"dynamics": "none", "feeling": False},
    "and feeling": {"dynamics": "none", "feeling": True},
    "and dynamics": {"dynamics": "feed-forward", "feeling": True},
}
DURATION = 5.0


def cases() -> list[Case]:
    """An update with ever more stages; driven simulations."""
    updates = [{"what": "update", "name": name} for name in STAGES]
    return updates + [{"what": "run", "name": kind} for kind in ("ideal-servo", "servo")]


def measure(what: str, name: str) -> Case:
    """The best of several rounds."""
    return _update(name) if what == "update" else _run(name)


def _update(name: str) -> Case:
    robot = load_robot(ROBOT)
    engine = LocomotionEngine(robot, EngineSettings(**STAGES[name]))
    q, legs = engine.state.q[0].copy(), len(robot.legs)

    def seen(step: int) -> Observation:
        return Observation(
            step * engine.settings.update_period,
            q,
            orientation=np.array([1.0, 0.0, 0.0, 0.0]),
            angular_velocity=np.zeros(3),
            acceleration=np.array([0.0, 0.0, 9.81]),
            contact=engine.state.leg == 0,
            foot_normal_force=np.full(legs, 6.0),
        )

    engine.reset(seen(0))
    limit = engine.largest_velocity((1.0, 0.2, 0.5))
    command = Command(velocity=tuple(0.7 * part for part in limit.velocity))
    best, step = np.inf, 0
    for _ in range(50):
        told = []
        for _ in range(100):
            step += 1
            told.append(seen(step))
        start = time.perf_counter()
        for one in told:
            engine.update(one, command)
        best = min(best, (time.perf_counter() - start) / 100)
    return {"microseconds": 1e6 * float(best)}


def _run(kind: str) -> Case:
    scenario = Scenario().replace(robot=ROBOT, drive=kind, duration=0.1, terrain="flat")
    command, best = Command(velocity=(0.05, 0.0, 0.1)), 0.0
    drive(scenario, LocomotionEngine(scenario.load_robot()), command)
    for _ in range(2):
        engine = LocomotionEngine(scenario.load_robot())
        start = time.perf_counter()
        drive(scenario.replace(duration=DURATION), engine, command)
        best = max(best, DURATION / (time.perf_counter() - start))
    return {"real_time": best}


def table(results: list[Case]) -> str:
    """Both."""
    rows = [
        [f"update: {run['name']}", f"{run['microseconds']:.0f} µs"]
        if run["what"] == "update"
        else [
            f"driven, all stages, {run['name']}",
            f"{run['real_time']:.0f} × real time",
        ]
        for run in results
    ]
    return markdown(["", "on this page's machine"], rows)
