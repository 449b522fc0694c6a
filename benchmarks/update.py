"""How long one update of the locomotion engine takes, by robot and by the stages that take part.

    python benchmarks/update.py [ROBOT ...]

Each time is the mean of a whole cycle of the gait, the least of many; on rough ground, where no
cycle is like another, their median. Robot and sensors agree: feet feel the ground where they meet
it, on level ground or on waves of 20 mm from trough to crest. Beside it stands a loop of Python's
own of which the machine should always take the same time: where that is slow the machine was busy.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from phasmid import LocomotionEngine
from phasmid.control import Command, Observation
from phasmid.errors import PhasmidError
from phasmid.robot import Robot, load_robot, preset_names

ROUNDS, CYCLE = 25, 200
"""Rounds, and updates in each: a whole cycle of the gait."""

STAGES = {
    "walking alone": {"feeling": False, "dynamics": "none"},
    "with feeling": {"feeling": True, "dynamics": "none"},
    "with dynamics": {"feeling": False, "dynamics": "feed-forward"},
    "with both": {"feeling": True, "dynamics": "feed-forward"},
}

TOUCH = 1e-4
"""A foot that is lower than this over the ground feels it [m]."""


def level(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 0.0 * x


def rough(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 0.005 * (np.sin(40.0 * x) + np.sin(31.0 * y))


def loop_time() -> float:
    """Least time of a thousand additions in Python [s]."""
    best = np.inf
    for _ in range(500):
        began, total = time.perf_counter(), 0.0
        for i in range(1000):
            total += 0.5 * i
        best = min(best, time.perf_counter() - began)
    return float(best)


def update_times(robot: Robot, ground=level, **settings) -> list[float]:
    """Mean times of an update in each cycle of a walk [s]."""
    engine = LocomotionEngine(robot, **settings)
    legs, means, now = len(robot.legs), [], 0.0
    limit = engine.largest_velocity((1.0, 0.2, 0.5))
    command = Command(velocity=tuple(0.7 * v for v in limit.velocity))
    sensors = {
        "joint_load": np.zeros((legs, 3)),
        "orientation": np.array([1.0, 0.0, 0.0, 0.0]),
        "angular_velocity": np.zeros(3),
        "acceleration": np.array([0.0, 0.0, 9.80665]),
    }
    engine.reset(
        Observation(now, engine.state.q[0].copy(), contact=np.ones(legs, dtype=bool), **sensors)
    )
    for _ in range(ROUNDS):
        took = 0.0
        for _ in range(CYCLE):
            now += engine.settings.update_period
            x, y, z = engine.state.foot.T
            touch = z - ground(x, y) < TOUCH
            told = Observation(now, engine.state.q[0].copy(), contact=touch, **sensors)
            began = time.perf_counter()
            engine.update(told, command)
            took += time.perf_counter() - began
        means.append(took / CYCLE)
    return means


def main() -> int:
    print(f"a thousand additions in Python: {1e6 * loop_time():.1f} us")
    for name in sys.argv[1:] or preset_names():
        try:
            robot = load_robot(name)
        except PhasmidError as error:
            print(error.what, file=sys.stderr)
            return 2
        told = [
            f"{kind} {1e6 * min(update_times(robot, **s)):.1f} us" for kind, s in STAGES.items()
        ]
        waves = np.median(update_times(robot, rough, **STAGES["with both"]))
        told.append(f"on rough ground {1e6 * waves:.1f} us")
        print(f"update, {name}: {', '.join(told)}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
