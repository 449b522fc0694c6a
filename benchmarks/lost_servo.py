"""Walking on with one servo dead: every servo of a hexapod, one run each.

Run: python benchmarks/lost_servo.py [ideal-servo|servo] [robot]
"""

import sys

import numpy as np

from phasmid import load_robot
from phasmid.control import Command, LocomotionEngine, SafeController, Sequencer
from phasmid.robot import JOINTS
from phasmid.scenario import Scenario
from phasmid.simulation import drive

DIES, JUDGED, ENDS = 4.0, 6.0, 12.0
"""When the servo dies, from when on the walk is judged, and when it ends [s]."""

WALKS = 0.02
"""A robot faster than this walks on [m/s]."""


def main(kind: str = "ideal-servo", name: str = "phantomx-ax") -> int:
    """Print a line for each servo; the status is 1 where a robot did not walk on."""
    robot = load_robot(name)
    limit = LocomotionEngine(robot).largest_velocity((1.0, 0.0, 0.0)).velocity[0]
    print(f"{name}, {kind}: half of {limit:.3f} m/s ahead, a servo dies at {DIES:g} s")
    walked = 0
    for leg in robot.leg_names:
        for joint in JOINTS:
            scenario = Scenario().replace(
                robot=name, drive=kind, duration=ENDS, record_interval_ms=20
            )
            controller = SafeController(Sequencer(LocomotionEngine(robot), robot), robot)
            run = drive(
                scenario,
                controller,
                Command(velocity=(limit / 2, 0.0, 0.0)),
                faults=[f"{leg}.{joint} dead at {DIES:g} s"],
            )
            time, place = run["time"].values, run["body_position"].values
            since = min(int(np.searchsorted(time, JUDGED)), len(time) - 1)
            speed = (place[-1, 0] - place[since, 0]) / max(time[-1] - time[since], 1e-9)
            good = run.attrs["ending"] == "COMPLETED" and speed > WALKS
            walked += good
            print(
                f"{leg:>14}.{joint:<6} {run.attrs['ending']:<10} {speed:6.3f} m/s, lowest body "
                f"{1000 * place[since:, 2].min():3.0f} mm  {'walks' if good else 'DOES NOT WALK'}",
                flush=True,
            )
    count = 3 * len(robot.legs)
    print(f"{walked} of {count} walk on")
    return int(walked < count)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
