"""How fast a driven simulation is: the engine at 200 Hz, physics at 1 ms, all channels.

    python benchmarks/drive.py

Runs of 30 s, with all that it takes to set them up. Beside it, in turns, the physics engine makes
the same steps with the same goals and nothing else: that is the limit on this machine.
"""

from __future__ import annotations

import time

import numpy as np

from phasmid import Scenario, load_scenario
from phasmid.control import Command
from phasmid.simulation.closed_loop import ClosedLoopRun
from phasmid.simulation.drive import DriveExperiment

DURATION, ROUNDS = 30.0, 3
COMMAND = Command(velocity=(0.05, 0.0, 0.1))


def driving(scenario: Scenario) -> DriveExperiment:
    """A walk with everything that `phasmid.drive` has around it."""
    return DriveExperiment(scenario, None, COMMAND, rate=200.0, between=None)


def goals(scenario: Scenario) -> list[np.ndarray]:
    """What the joints are told in each period of such a walk."""
    run, told = driving(scenario).begin_run(), []
    find = run.drive.targets

    def noted(*args):
        told.append(find(*args).copy())
        return told[-1]

    run.drive.targets = noted
    run.advance()
    return told


def step_through(run: ClosedLoopRun, told: list[np.ndarray]) -> float:
    """How long the steps alone take, with goals that are known [s]."""
    began = time.perf_counter()
    for rows in told:
        run._advance(rows)
    return time.perf_counter() - began


def main() -> None:
    for kind in ("prescribed", "ideal-servo", "servo"):
        scenario = load_scenario("paper").replace(period=1.0, drive=kind, duration=DURATION)
        # What is compiled is compiled before.
        driving(scenario.replace(duration=0.1)).simulate()
        told = goals(scenario)
        whole = steps = np.inf
        for _ in range(ROUNDS):
            began = time.perf_counter()
            driving(scenario).simulate()
            whole = min(whole, time.perf_counter() - began)
            steps = min(steps, step_through(driving(scenario).begin_run(), told))
        print(
            f"driven, {kind:12} {DURATION / whole:6.1f} x real time; MuJoCo's steps alone "
            f"{DURATION / steps:6.1f} x, {100 * steps / whole:3.0f} % of the time",
            flush=True,
        )


if __name__ == "__main__":
    main()
