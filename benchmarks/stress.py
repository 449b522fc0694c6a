"""Kill and interrupt walks at random moments, and count what is lost.

After ``kill -9`` all that the log held must be readable and untouched. After Ctrl-C the command
must end within half a second, with a whole result folder or a readable log where the run had
begun, and with nothing half-written.
"""

from __future__ import annotations

import argparse
import hashlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections import Counter
from pathlib import Path

from phasmid.errors import InvalidInput
from phasmid.recording import load_recording

IN_TIME = 0.5
COMMAND = [sys.executable, "-m", "phasmid", "walk", "--quiet", "--out", "walk"]


def begun(folder: Path, options: list[str]) -> subprocess.Popen:
    return subprocess.Popen(
        [*COMMAND, *options], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )


def outcome(folder: Path) -> tuple[str, int]:
    """What stands in a folder after a run, and how many samples it holds."""
    run, log = folder / "walk", folder / "walk.mcap"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if run.exists():
            return "folder", load_recording(run / "recording.nc").sizes["time"]
        if log.exists():
            before = hashlib.sha256(log.read_bytes()).digest()
            samples = load_recording(log).sizes["time"]
            assert hashlib.sha256(log.read_bytes()).digest() == before, "the log was touched"
            return "log", samples
    return "nothing", 0


def samples_of(log: Path) -> int:
    """Samples that a log holds as it stands; 0 where there is none."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return load_recording(log).sizes["time"]
    except InvalidInput:
        return 0


def kill(folder: Path, moment: float, options: list[str]) -> tuple[str, int]:
    """Kill a walk; what stands there, and how many samples were lost that had been there."""
    process = begun(folder, options)
    time.sleep(moment)
    seen = samples_of(folder / "walk.mcap")
    process.kill()
    process.wait()
    what, samples = outcome(folder)
    return what, max(0, seen - samples)


def interrupt(folder: Path, moment: float, options: list[str]) -> tuple[str, int, float]:
    """Interrupt a walk; what stands there, how many files are half-written, how long it took."""
    process = begun(folder, options)
    time.sleep(moment)
    start = time.perf_counter()
    process.send_signal(signal.SIGINT)
    process.wait()
    took = time.perf_counter() - start
    hidden = [p for p in folder.iterdir() if p.name.startswith(".")]
    what, _ = outcome(folder)
    # Before Python itself is up, its own status for it is 1 or that of the signal.
    expected = {"folder": (0, 130), "log": (130,), "nothing": (130, 1, -signal.SIGINT)}[what]
    wrong = [] if process.returncode in expected else [process.returncode]
    if hidden or wrong or took > IN_TIME:
        left = f", {hidden[0].name} is left" if hidden else ""
        print(
            f"  Ctrl-C at {moment:.2f} s: {what}, status {process.returncode} "
            f"after {took:.2f} s{left}",
            flush=True,
        )
    return what, len(hidden) + len(wrong), took


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=60)
    parser.add_argument("--interrupts", type=int, default=100)
    parser.add_argument("--duration", default="60", help="of the walk [s]")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    rng, walk = random.Random(options.seed), ["--duration", options.duration]
    root = Path(tempfile.mkdtemp(prefix="phasmid-stress-"))

    def folder() -> Path:
        shutil.rmtree(root, ignore_errors=True)
        root.mkdir()
        return root

    start = time.perf_counter()
    begun(folder(), walk).wait()
    whole = time.perf_counter() - start
    print(f"an undisturbed walk of {options.duration} s takes {whole:.1f} s")
    kills = [kill(folder(), rng.uniform(0, whole), walk) for _ in range(options.kills)]
    lost = sum(samples > 0 for _, samples in kills)
    print(f"{len(kills)} kills: {dict(Counter(what for what, _ in kills))}, {lost} lost anything")
    stops = [interrupt(folder(), rng.uniform(0, whole), walk) for _ in range(options.interrupts)]
    bad, slowest = sum(wrong > 0 for _, wrong, _ in stops), max((t for *_, t in stops), default=0)
    late = sum(took > IN_TIME for *_, took in stops)
    print(
        f"{len(stops)} Ctrl-C: {dict(Counter(what for what, *_ in stops))}, {bad} left something "
        f"half-written or a wrong status, {late} took longer than {IN_TIME} s (at most "
        f"{slowest:.2f} s)"
    )
    shutil.rmtree(root, ignore_errors=True)
    return int(lost or bad or late)


if __name__ == "__main__":
    sys.exit(main())
