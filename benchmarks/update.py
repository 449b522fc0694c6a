"""How long one update of the locomotion engine takes, by robot and by the stages that take part.

    python benchmarks/update.py [ROBOT ...]

Each time is the mean over a walk's updates, of each of which the least counts that it takes in ten
walks that are alike. Robot and sensors agree: feet feel the ground where they meet it, on level
ground or on waves of 20 mm from trough to crest. Beside it stands a loop of Python's own of which
the machine should always take the same time: where that is slow the machine was busy.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from control_study.pace import STAGES, update_time

from phasmid.control import Command, EngineBatch, Observation
from phasmid.errors import PhasmidError
from phasmid.robot import Robot, load_robot, preset_names


def loop_time() -> float:
    """Least time of a thousand additions in Python [s]."""
    best = np.inf
    for _ in range(500):
        began, total = time.perf_counter(), 0.0
        for i in range(1000):
            total += 0.5 * i
        best = min(best, time.perf_counter() - began)
    return float(best)


def many_time(robot: Robot, threads: int, count: int = 64, updates: int = 200) -> float:
    """Least time per update and robot of many robots that walk, on some threads [s]."""
    batch = EngineBatch(robot, count, threads=threads)
    command = Command(velocity=(0.05, 0.0, 0.1))
    for engine in batch.engines:
        legs = np.ones(len(robot.legs), dtype=bool)
        seen = Observation(0.0, engine.state.q.copy(), contact=legs)
        engine.reset(seen)
        engine.prepare(seen, command)
    best = np.inf
    for _ in range(updates):
        began = time.perf_counter()
        batch.advance()
        best = min(best, time.perf_counter() - began)
    return best / count


def main() -> int:
    print(f"a thousand additions in Python: {1e6 * loop_time():.1f} us")
    for name in sys.argv[1:] or preset_names():
        try:
            robot = load_robot(name)
        except PhasmidError as error:
            print(error.what, file=sys.stderr)
            return 2
        told = [f"{stage} {1e6 * update_time(robot, stage):.1f} us" for stage in STAGES]
        print(f"update, {name}: {', '.join(told)}", flush=True)
        one, two = many_time(robot, 1), many_time(robot, 2)
        figures = f"{1e6 * one:.1f} us on one thread, {1e6 * two:.1f} us on two"
        print(f"batch, {name}: {figures}, {one / two:.2f} x", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
