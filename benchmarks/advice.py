"""Compares the advice on servos with long simulations of the same walks.

    python benchmarks/advice.py [--minutes 15]

Prints, for each preset, the duration of the advice in a process that has made one before, and the
differences from the simulation: in the joint with the largest value, and in all joints together,
over the largest value. Takes two minutes.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from phasmid.advice import advise, simulate_load
from phasmid.advice.advice import plan_cycles
from phasmid.gait import gaits_of
from phasmid.robot import load_robot, preset_names
from phasmid.scenario import Scenario


def main() -> None:
    """Print a line for each preset."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=15.0, help="simulated time")
    minutes = parser.parse_args().minutes
    print("preset, duration of advice and simulation, differences of peak torque, rms torque and")
    print("warming: in the largest value, and in all joints over the largest value")
    for name in preset_names():
        gait = next(iter(gaits_of(len(load_robot(name).legs))))
        scenario = Scenario(robot=name, gait=gait)
        advise(scenario)
        begin = time.perf_counter()
        advice = advise(scenario)
        took = time.perf_counter() - begin
        period = advice.experiment.course.stride.period
        begin = time.perf_counter()
        full = simulate_load(
            *plan_cycles(advice.experiment.replace(max_steps=10**8), cycles=60 * minutes / period)[
                :2
            ],
            skip=period,
        )
        simulated = time.perf_counter() - begin
        air = advice.servo.ambient_temperature
        warmth = advice.temperature(minutes)
        pairs = [
            (advice.load.peak_torque, full.peak_torque),
            (advice.load.rms_torque, full.rms_torque),
        ]
        if warmth is not None and full.temperature is not None:
            pairs.append((warmth[1] - air, full.temperature - air))
        cells = [
            f"{100 * abs(a.max() / b.max() - 1):.1f}, {100 * np.abs(a - b).max() / b.max():.1f} %"
            for a, b in pairs
        ]
        print(
            f"{name:16}  {took:.2f} s  {simulated:.0f} s{'':20}  {'  '.join(cells)}", full.failure
        )


if __name__ == "__main__":
    main()
