"""The live page's robot for some minutes: pace, frames a second, share of a core, memory.

    python benchmarks/studio_load.py --minutes 10 [--scenario paper] [--set robot=octopod ...]

Everything but the browser: the simulation walks as for three browsers, which now and then drive it,
change its gait and its ground, push it and let it fall. Memory is that of the process after the
first minute, or a fifth of the time, against that at the end.

    python benchmarks/studio_load.py --browsers 1

The command itself with so many pages in Chromium, which nobody sees and the processor draws: what
each page's own strip says, each half second. It needs playwright.
"""

from __future__ import annotations

import argparse
import json
import random
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from phasmid import load_scenario
from phasmid.errors import PhasmidError
from phasmid.studio.live_simulation import LiveSimulation
from phasmid.studio.messages import Change, Limb, Load, Play, Push, Request, Stick


class Looker:
    """Counts what is published."""

    def __init__(self) -> None:
        self.frames = self.texts = self.bytes = 0
        self.pace: list[float] = []
        self.events: list[str] = []

    def take(self, what: str | bytes) -> None:
        """Take in a text or a frame."""
        self.bytes += len(what)
        if isinstance(what, bytes):
            self.frames += 1
            return
        self.texts += 1
        event = json.loads(what).get("event")
        if event and len(self.events) < 1000:
            self.events.append(event["text"])


def memory() -> float:
    """Of this process [MB]."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return float(line.split()[1]) / 1024
    return 0.0


def doings(rng: random.Random, calm: bool) -> Request:
    """Something that a person may do."""
    if calm:
        return Stick(at=(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)))
    return rng.choice(
        [
            Change(
                name="gait", value=rng.choice(["tripod", "wave", "ripple", "amble", "tetrapod"])
            ),
            Change(name="period", value=rng.choice([1.0, 1.5, 2.0, 3.0])),
            Change(name="body_height", value=rng.uniform(-20, 20)),
            Change(name="roll", value=rng.uniform(-6, 6)),
            Change(name="friction", value=rng.choice([0.3, 0.7, 1.0])),
            Change(
                name="terrain", value=rng.choice(["flat", "stairs", "waves", "blocks", "rough"])
            ),
            Change(name="payload", value=rng.choice([0.0, 0.3, 0.8])),
            Change(
                name="robot",
                value=rng.choice(["phantomx-paper", "phantomx-ax", "octopod", "quadruped"]),
            ),
            Change(
                name="drive", value=rng.choice(["prescribed", "servo", "ideal-servo", "torque"])
            ),
            Change(name="force_model", value=rng.choice(["minimum-norm", "friction-cone"])),
            Change(name="walks", value=rng.choice(["by itself", "by itself", "the plan"])),
            Push(impulse=(rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5), 0.0)),
            Limb(leg=rng.randint(1, 4), how="lose"),
            Limb(leg=rng.randint(1, 4), how="limp"),
            Play(how="reset"),
            Load(what="scenario", name="paper.toml", content=b""),
        ]
    )


def main() -> None:
    """Run, and print a line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--scenario", default="paper")
    parser.add_argument("--set", action="append", default=[], metavar="FIELD=VALUE")
    parser.add_argument("--calm", action="store_true", help="only walk; nobody does anything")
    parser.add_argument("--every", type=float, default=5.0, help="seconds between two doings")
    parser.add_argument("--browsers", type=int, default=0, help="pages of the real command")
    options = parser.parse_args()
    if options.browsers:
        print(json.dumps(seen(options)))
        return
    looker, rng = Looker(), random.Random(1)
    with tempfile.TemporaryDirectory() as folder:
        simulation = LiveSimulation(
            load_scenario(options.scenario), out=Path(folder), publish=looker.take
        )
        simulation.viewers(3)
        simulation.start()
        for one in options.set:
            name, value = one.split("=", 1)
            simulation.submit(Change(name=name, value=_value(value))).result(300)
        simulation.submit(Play(how="play")).result(300)
        print(json.dumps(measured(simulation, looker, rng, options)))
        simulation.close()


def _value(text: str) -> float | str | bool:
    try:
        return float(text)
    except ValueError:
        return {"true": True, "false": False}.get(text, text)


def measured(
    simulation: LiveSimulation, looker: Looker, rng: random.Random, options: argparse.Namespace
) -> dict[str, Any]:
    """Let the time pass; the figures."""
    length = 60 * options.minutes
    begin, used, frames = time.monotonic(), time.process_time(), looker.frames
    next_doing, settled, early, done = begin + options.every, begin + min(60.0, length / 5), 0.0, 0
    refused, course = 0, [memory()]
    live = simulation.live
    simulated = live.now if live else 0.0
    while (now := time.monotonic()) < begin + length:
        time.sleep(0.2)
        if not early and now >= settled:
            early = memory()
        if now >= begin + 60 * len(course):
            course.append(memory())
        if not options.calm and now >= next_doing:
            next_doing, done = now + options.every, done + 1
            try:
                simulation.submit(doings(rng, calm=done % 3 == 0)).result(300)
            except PhasmidError:
                refused += 1
    passed, late = time.monotonic() - begin, memory()
    live = simulation.live
    found: dict[str, Any] = {
        "wall": round(passed, 1),
        "frames_a_second": round((looker.frames - frames) / passed, 2),
        "share_of_a_core": round((time.process_time() - used) / passed, 3),
        "memory_early": round(early, 1),
        "memory_late": round(late, 1),
        "growth": round(late / early - 1, 4) if early else None,
        "memory_each_minute": [round(one) for one in course],
        "events": len(looker.events),
        "faults": [event for event in looker.events if "unforeseen" in event],
        "done": done,
        "refused": refused,
    }
    if options.calm and live is not None:
        found["pace"] = round((live.now - simulated) / passed, 4)
    return found


def seen(options: argparse.Namespace) -> dict[str, Any]:
    """What pages in a browser say of themselves once the robot has walked for a while."""
    from playwright.sync_api import sync_playwright

    sys.path.insert(0, str(Path(__file__).parents[1] / "docs"))
    from studio_page import chromium, studio, walked

    with studio() as address, sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium(), args=["--no-sandbox"])
        pages = []
        for _ in range(options.browsers):
            pages.append(browser.new_page(viewport={"width": 1400, "height": 900}))
            pages[-1].goto(address)
        for page in pages:
            walked(page)
        told: list[dict[str, list[float]]] = [{"rate": [], "real": []} for _ in pages]
        end = time.monotonic() + 60 * options.minutes
        while time.monotonic() < end:
            for page, own in zip(pages, told, strict=True):
                for name, values in own.items():
                    text = page.locator(f"#now-{name}").text_content() or ""
                    values.append(float(text.rstrip("/s×")))
            time.sleep(0.5)
        browser.close()
    return {
        "frames_a_second": [round(statistics.mean(own["rate"]), 1) for own in told],
        "least_frames": [min(own["rate"]) for own in told],
        "pace": [round(statistics.mean(own["real"]), 3) for own in told],
    }


if __name__ == "__main__":
    main()
