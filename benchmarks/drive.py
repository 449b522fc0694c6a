"""How fast a driven simulation is: the engine at 200 Hz, physics at 1 ms, all channels."""

from __future__ import annotations

import time

from phasmid import drive, load_scenario
from phasmid.control import Command

DURATION = 10.0

if __name__ == "__main__":
    for kind in ("prescribed", "ideal-servo", "servo"):
        scenario = load_scenario("paper").replace(period=1.0, drive=kind)
        command = Command(velocity=(0.05, 0.0, 0.1))
        # What is compiled is compiled before.
        drive(scenario.replace(duration=0.1), commands=command)
        best = 0.0
        for _ in range(3):
            start = time.perf_counter()
            drive(scenario.replace(duration=DURATION), commands=command)
            best = max(best, DURATION / (time.perf_counter() - start))
        print(f"driven, {kind:12} {best:6.1f} x real time")
