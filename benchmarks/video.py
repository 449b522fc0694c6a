"""How long it takes to film the paper's walk: 10 s at 1280 × 720 and 30 frames a second.

    python benchmarks/video.py [SECONDS]

On a shared machine processor time says more than the clock.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import phasmid
from phasmid.video import lack


def main(length: float) -> int:
    missing = lack(".mp4")
    if missing is not None:
        print(f"{missing.sentence}: try {missing.advice}")
        return 0
    scenario = phasmid.load_scenario("paper").replace(duration=length)
    recording = phasmid.simulate(scenario, phasmid.plan(scenario))
    with tempfile.TemporaryDirectory() as folder:
        start, used = time.perf_counter(), time.process_time()
        path = phasmid.save_video(recording, Path(folder) / "walk.mp4")
        start, used = time.perf_counter() - start, time.process_time() - used
        size = path.stat().st_size / 1e6
    print(f"{length:g} s of walking as MP4, 1280 x 720, {30 * length:g} frames:")
    print(f"{start:.1f} s by the clock, {used:.1f} s of processor time, {size:.1f} MB")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(float(sys.argv[1]) if len(sys.argv) > 1 else 10.0))
