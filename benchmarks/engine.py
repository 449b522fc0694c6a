"""The locomotion engine under random commands, and how long its update takes.

    python benchmarks/engine.py [SEQUENCES] [SECONDS] [ROBOT ...]

Each sequence drives an engine without forces with random velocities, poses, gaits, starts and
stops, then stops it; it fails where a foot that stands slips, a joint is too fast or beyond its
limits, the centre of mass leaves the feet, or the robot does not come to rest.
"""

from __future__ import annotations

import collections
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from kinematic_world import core_engine, drive, random_commands, worst
from phasmid.experiment import Command, Observation
from phasmid.robot import load_robot, preset_names

SETTLING = 8.0
"""Time at the end in which a robot comes to rest [s]."""


def faults(seen, engine) -> list[str]:
    """What went wrong in a sequence."""
    found = worst(seen)
    judged = {
        "slips": found["slip"] > 1e-9,
        "joint too fast": found["speed"] > 1,
        "joint beyond its limit": found["beyond"] > 0,
        "support lost": not found["margin"] > 0,
        "not finite": not found["finite"],
        "never rests": not engine.is_standing,
        "held all": any("held all" in sentence for _, sentence in seen.events),
    }
    return [name for name, is_so in judged.items() if is_so]


def stress(name: str, sequences: int, duration: float) -> int:
    """Drive a robot through random sequences; the number of those that failed."""
    robot, failed, said = load_robot(name), 0, collections.Counter()
    margin, began = np.inf, time.perf_counter()
    for seed in range(sequences):
        commands = random_commands(robot, np.random.default_rng(seed), duration - SETTLING)
        commands.append((duration - SETTLING, Command(gait=commands[-1][1].gait)))
        engine = core_engine(robot)
        seen = drive(engine, commands, duration)
        wrong = faults(seen, engine)
        margin = min(margin, worst(seen)["margin"])
        said.update(sentence.split(":")[0].split(" by ")[0] for _, sentence in seen.events)
        if wrong:
            failed += 1
            print(f"  {name}, seed {seed}: {', '.join(wrong)}")
    took = time.perf_counter() - began
    print(
        f"{name}: {sequences - failed} of {sequences} sequences of {duration:g} s as they should "
        f"be, least support margin {1e3 * margin:.1f} mm, {took:.0f} s; {dict(said)}"
    )
    return failed


def update_time(name: str) -> float:
    """Least mean time of an update while walking, of many rounds [s]."""
    engine = core_engine(load_robot(name))
    limit = engine.largest_velocity((1.0, 0.2, 0.5))
    command = Command(velocity=tuple(0.7 * v for v in limit.velocity), pose=(0, 0, 0.01, 0, 0, 0))
    observation, best = Observation(0.0, engine.state.q.copy()), np.inf
    for _ in range(100):
        began = time.perf_counter()
        for _ in range(100):
            engine.update(observation, command)
        best = min(best, (time.perf_counter() - began) / 100)
    return float(best)


def main() -> int:
    arguments = sys.argv[1:]
    sequences = int(arguments[0]) if arguments else 20
    duration = float(arguments[1]) if len(arguments) > 1 else 30.0
    names = arguments[2:] or preset_names()
    for name in names:
        print(f"{name}: an update takes {1e6 * update_time(name):.1f} us")
    return 1 if sum([stress(name, sequences, duration) for name in names]) else 0


if __name__ == "__main__":
    sys.exit(main())
