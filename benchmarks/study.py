"""Studies: rate on one and two processes, memory of the driver, and a search against a grid.

    python benchmarks/study.py [--runs 10000]

Planned walks of 2 s. Takes about 20 minutes on two cores.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import psutil

import phasmid

COST, SPEED = "energy.cost_of_transport", "travel.commanded_distance"
BASE: dict[str, Any] = {
    "kind": "plan",
    "metrics": [COST, SPEED],
    "set": {"duration": 2.0},
    "axes": {
        "gait": ["tripod", "wave", "ripple"],
        "step_length_mm": {"low": 10, "high": 60},
        "period": {"low": 1.5, "high": 4.0},
        "step_height_mm": {"low": 10, "high": 50},
    },
}


def rate(folder: Path, runs: int, workers: int) -> float:
    """Return the rate of a study after its first tenth [1/s]; print it and the driver's memory."""
    process, marks = psutil.Process(), []

    def note(done: int, total: int, failures: int) -> None:
        del total, failures
        if not marks or done - marks[-1][0] >= runs // 10:
            marks.append((done, time.perf_counter(), process.memory_info().rss / 1e6))

    study = BASE | {"sampler": "sobol", "runs": runs}
    phasmid.study(study, out=folder / f"rate-{workers}", workers=workers, progress=note)
    (first, begin, before), (last, end, after) = marks[1], marks[-1]
    found = (last - first) / (end - begin)
    print(
        f"{workers} processes: {found:.1f} runs/s; memory of the driver {before:.1f} MB at run "
        f"{first}, {after:.1f} MB at run {last}",
        flush=True,
    )
    return found


def hypervolume(points: np.ndarray, worst: np.ndarray) -> float:
    """Return the area that points (N, 2), both to be small, dominate up to a worst point."""
    area, low = 0.0, worst[1]
    for x, y in sorted(map(tuple, points)):
        if x < worst[0] and y < low:
            area += (worst[0] - x) * (low - y)
            low = y
    return area


def search(folder: Path, budget: int = 400) -> None:
    """Compare the hypervolume of NSGA-II with that of a grid of ten times as many points."""
    objectives = {"minimise": [COST], "maximise": [SPEED]}
    found = phasmid.study(
        BASE | {"search": {"budget": budget, "batch": 40} | objectives}, out=folder / "search"
    )
    counts = {"step_length_mm": 11, "period": 11, "step_height_mm": 11}
    axes = {
        key: axis | {"count": counts[key]} if key in counts else axis
        for key, axis in BASE["axes"].items()
    }
    grid = phasmid.study(BASE | {"axes": axes}, out=folder / "grid").table
    sets = [table[table["status"] == "done"] for table in (found.table, grid)]
    points = [np.stack([table[COST], -table[SPEED]], axis=1) for table in sets]
    worst = np.concatenate(points).max(axis=0)
    ours, dense = (hypervolume(each, worst) for each in points)
    print(
        f"NSGA-II with {budget} points: {100 * ours / dense:.1f} % of the hypervolume of a grid of "
        f"{len(grid)} points"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=10_000)
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp())
    try:
        one = rate(folder, max(options.runs // 5, 100), 1)
        two = rate(folder, options.runs, 2)
        print(f"two processes: {two / (2 * one):.2f} of twice the rate of one")
        search(folder)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
