"""How long one update of the locomotion engine takes, by robot and by the stages that take part.

    python benchmarks/update.py [ROBOT ...]

Each time is the mean over a walk's updates, of each of which the least counts that it takes in ten
walks that are alike. Robot and sensors agree: feet feel the ground where they meet it, on level
ground or on waves of 20 mm from trough to crest. A lidar reads 20 times a second; the updates that
write its points into the height map count apart. The time of a loop in Python shows how busy the
machine is.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from control_study.pace import STAGES, update_times

from phasmid.errors import PhasmidError
from phasmid.robot import load_robot, preset_names


def loop_time() -> float:
    """Least time of a thousand additions in Python [s]."""
    best = np.inf
    for _ in range(500):
        began, total = time.perf_counter(), 0.0
        for i in range(1000):
            total += 0.5 * i
        best = min(best, time.perf_counter() - began)
    return float(best)


def main() -> int:
    print(f"a thousand additions in Python: {1e6 * loop_time():.1f} us")
    for name in sys.argv[1:] or preset_names():
        try:
            robot = load_robot(name)
        except PhasmidError as error:
            print(error.what, file=sys.stderr)
            return 2
        for stage in STAGES:
            alone, reading = update_times(robot, stage)
            also = "" if np.isnan(reading) else f"; with a reading {1e6 * reading:.0f} us"
            print(f"update, {name}, {stage}: {1e6 * alone:.1f} us{also}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
