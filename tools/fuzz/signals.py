"""Send signals to commands at random moments, and flip bits in the parts of a study.

A command must end as stopped (status 130) unless it had completed its work. It must leave nothing
half-made and no process after 3 s, and must print no traceback. A flipped bit must be named.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import psutil

from phasmid.recording import load_recording
from phasmid.studies import load_study, study
from phasmid.studies.results import PARTS, DamagedPart, write_rows

MOST_TIME = 3.0
"""Time in which all processes of a command must have ended [s]."""

START_TIME = 1.0
"""Time in which Python itself may still start, where a signal has its default effect [s]."""

END_TIME = 2.0
"""Time in which a command that has completed its work ends, on a busy machine [s]."""

STUDY = """
kind = "simulate"
metrics = ["torque.simulation.largest"]
seeds = 4
keep = "all"
set = {duration_s = 1}
[axes]
gait = ["tripod", "wave"]
step_length_mm = [20, 40]
"""
"""A study of 16 runs."""

COMMANDS = {
    "walk": ("walk", "--duration", "6", "--out", "walk"),
    "drive": ("drive", "--velocity", "0.05,0,0", "--duration", "6", "--out", "drive"),
    "study": ("study", "study.toml", "--workers", "2", "--out", "study"),
    "paper": ("paper", "--out", "paper"),
}
SHARES = {"walk": 0.35, "drive": 0.35, "study": 0.18, "paper": 0.12}
"""Parts of all signals; reproducing the paper takes longest."""

SIGNALS = signal.SIGINT, signal.SIGTERM, signal.SIGHUP


def start(command: str, folder: Path) -> subprocess.Popen:
    (folder / "study.toml").write_text(STUDY, encoding="utf-8")
    with (folder / "output.txt").open("wb") as output:
        return subprocess.Popen(
            [sys.executable, "-m", "phasmid", *COMMANDS[command]],
            cwd=folder,
            stdout=output,
            stderr=output,
            start_new_session=True,
        )


def members(session: int) -> list[psutil.Process]:
    """Processes of a session that still run."""
    found = []
    for process in psutil.process_iter():
        with suppress(OSError, psutil.Error):
            if os.getsid(process.pid) == session and process.status() != psutil.STATUS_ZOMBIE:
                found.append(process)
    return found


def remaining(session: int) -> str:
    """What runs `MOST_TIME` after the end of a session's leader; it is killed."""
    end = time.monotonic() + MOST_TIME
    while (found := members(session)) and time.monotonic() < end:
        time.sleep(0.05)
    names = ""
    for process in found:
        with suppress(psutil.Error):
            names += f"process {process.cmdline()[-1][:60]} is left; "
            process.kill()
    return names


def half_made(command: str, folder: Path) -> str:
    """What a command left that is neither complete nor documented."""
    faults = [str(path) for path in folder.rglob("*") if path.name.startswith(".")]
    place = folder / command
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            if command == "study" and place.exists():
                if list((place / PARTS).iterdir()):
                    load_study(place)
                for path in place.glob("recordings/*"):
                    load_recording(path)
            elif command == "paper" and place.exists():
                files = sum(path.is_file() for path in place.rglob("*"))
                faults += [f"{files} files"] if files != 9 else []
            elif command in ("walk", "drive"):
                log = folder / f"{command}.mcap"
                if place.exists() and log.exists():
                    faults.append("folder and log")
                if place.exists():
                    load_recording(place)
                if log.exists():
                    load_recording(log)
        except Exception as error:
            faults.append(f"{type(error).__name__}: {error}")
    return "; ".join(faults)


def disturb(job: tuple[str, int, bool, float]) -> tuple[str, str, float, str]:
    """Send a signal; return command, outcome, time to the end [s] and faults."""
    command, number, to_group, moment = job
    folder = Path(tempfile.mkdtemp(prefix="phasmid-signals-"))
    process = start(command, folder)
    with suppress(subprocess.TimeoutExpired):
        process.wait(moment)
    if process.returncode is not None:
        shutil.rmtree(folder, ignore_errors=True)
        return command, "ended before", 0.0, ""
    begin = time.monotonic()
    with suppress(ProcessLookupError):
        (os.killpg if to_group else os.kill)(process.pid, number)
    status = process.wait()
    took = time.monotonic() - begin
    faults = remaining(process.pid)
    text = (folder / "output.txt").read_text(encoding="utf-8", errors="replace")
    if "Traceback" in text or "Exception ignored" in text:
        faults += f"printed {text[-600:]!r}; "
    if number != signal.SIGKILL:
        faults += half_made(command, folder)
    outcome = {130: "stopped", 0: "completed", -number: "at the start"}.get(status, str(status))
    if number == signal.SIGKILL:
        outcome = "killed"
    elif outcome == "at the start" and (folder / command).exists():
        outcome = "at the end"
    elif outcome == "at the start" and moment > START_TIME:
        faults += f"status {status} at {moment:.2f} s"
    elif status == 0 and (took > END_TIME or not (folder / command).exists()):
        faults += f"swallowed: status 0 after {took:.1f} s"
    elif status not in (0, 130, -number):
        faults += f"status {status}: {text[-300:]!r}"
    if faults:
        print(f"  {command}, {signal.Signals(number).name} at {moment:.2f} s: {faults}", flush=True)
    shutil.rmtree(folder, ignore_errors=True)
    return command, outcome, took, faults


def send(count: int, kills: int, seed: int, at_once: int) -> int:
    """Send signals to all commands; return the number of faults."""
    rng, lengths = random.Random(seed), {}
    for command in COMMANDS:
        folder = Path(tempfile.mkdtemp(prefix="phasmid-signals-"))
        begin = time.monotonic()
        assert start(command, folder).wait() == 0, (folder / "output.txt").read_text()
        lengths[command] = time.monotonic() - begin
        assert not half_made(command, folder), half_made(command, folder)
        shutil.rmtree(folder)
        print(f"  undisturbed {command}: {lengths[command]:.1f} s", flush=True)
    jobs = []
    for command, share in SHARES.items():
        for _ in range(round(count * share)):
            moment = rng.uniform(0.1, lengths[command])
            jobs.append((command, rng.choice(SIGNALS), rng.random() < 0.5, moment))
    moments = [rng.uniform(0.1, lengths["study"]) for _ in range(kills)]
    jobs += [("study", signal.SIGKILL, False, moment) for moment in moments]
    rng.shuffle(jobs)
    with ThreadPoolExecutor(at_once) as pool:
        results = list(pool.map(disturb, jobs))
    for command in COMMANDS:
        own = [result for result in results if result[0] == command]
        print(
            f"{command}: {len(own)} signals, {dict(Counter(r[1] for r in own))}, "
            f"{sum(bool(r[3]) for r in own)} faults, at most {max(r[2] for r in own):.1f} s to "
            "the end"
        )
    return sum(bool(result[3]) for result in results)


def flip(count: int, seed: int) -> int:
    """Flip bits in the parts of a study; return the number that were not named."""
    rng, folder = random.Random(seed), Path(tempfile.mkdtemp(prefix="phasmid-flips-"))
    definition = {
        "kind": "plan",
        "set": {"duration": 0.5},
        "metrics": ["energy.cost_of_transport"],
        "axes": {"gait": ["tripod", "wave"], "step_length_mm": [20, 40, 60]},
    }
    whole = study(definition, out=folder / "study", workers=1)
    shutil.rmtree(folder / "study" / PARTS)
    (folder / "study" / PARTS).mkdir()
    for number in range(len(whole.table)):
        write_rows(folder / "study", [whole.table.iloc[number].to_dict()])
    parts = sorted((folder / "study" / PARTS).iterdir())
    silent = 0
    for _ in range(count):
        part = rng.choice(parts)
        content = part.read_bytes()
        bit = rng.randrange(8 * len(content))
        damaged = bytearray(content)
        damaged[bit // 8] ^= 1 << bit % 8
        part.write_bytes(damaged)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            table = load_study(folder / "study").table
        others = whole.table.drop(index=parts.index(part)).reset_index(drop=True)
        named = [str(one.message) for one in caught if one.category is DamagedPart]
        silent += len(named) != 1 or part.name not in named[0] or not table.equals(others)
        part.write_bytes(content)
    shutil.rmtree(folder)
    print(f"{count} flipped bits in {len(parts)} parts: {silent} silent, none with a traceback")
    return silent


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--signals", type=int, default=200)
    parser.add_argument("--kills", type=int, default=10, help="kill -9 of a study")
    parser.add_argument("--flips", type=int, default=400)
    parser.add_argument("--at-once", type=int, default=2, help="commands at a time")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    # nohup makes commands ignore it.
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    bad = flip(options.flips, options.seed)
    if options.signals or options.kills:
        bad += send(options.signals, options.kills, options.seed, options.at_once)
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
