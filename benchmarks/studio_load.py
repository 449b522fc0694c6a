"""The live page's robot for some minutes: pace, frames a second, share of a core, memory.

    python benchmarks/studio_load.py --minutes 10 [--scenario paper] [--set robot=octopod ...]

Everything but the browser: the simulation walks as for three browsers, which now and then drive it,
change its gait and its ground, push it and let it fall. Memory is that of the process after the
first minute, or a fifth of the time, against that at the end.

    python benchmarks/studio_load.py --browsers 1

The command itself with so many pages in Chromium, which nobody sees and the processor draws: what
each page's own strip says, each half second. It needs playwright.

    python benchmarks/studio_load.py --clients 4 --minutes 10

The command itself with so many clients that send ten changes a second each and wait for no answer:
the first of the robot, then of the terrain, of the payload, and of all that a person may do.
Simulated seconds per second, from the times of the frames; the time in which the page and its
scripts are answered; and the memory of the studio's process. It needs psutil.
"""

from __future__ import annotations

import argparse
import json
import random
import statistics
import sys
import tempfile
import threading
import time
import urllib.request
from collections import Counter
from dataclasses import dataclass, field
from http.cookiejar import CookieJar
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np

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
    parser.add_argument("--clients", type=int, default=0, help="who send ten changes a second")
    options = parser.parse_args()
    if options.clients:
        print(json.dumps(pressed(options)))
        return
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


@dataclass
class Client:
    """Websocket that sends changes at random, ten a second."""

    number: int
    statuses: Counter[int] = field(default_factory=Counter)
    simulated: float = 0.0

    def changes(self, rng: random.Random) -> dict[str, Any]:
        """One message."""
        robots = ["phantomx-paper", "phantomx-ax", "octopod", "quadruped"]
        grounds = ["flat", "stairs", "waves", "blocks", "rough"]
        fields: list[tuple[str, Any]] = [
            ("robot", rng.choice(robots)),
            ("terrain", rng.choice(grounds)),
            ("payload", round(rng.uniform(0, 1), 2)),
            ("gait", rng.choice(["tripod", "wave"])),
            ("friction", rng.choice([0.4, 0.7, 1.0])),
            ("body_height", rng.uniform(-10, 10)),
        ]
        name, value = fields[self.number] if self.number < 3 else rng.choice(fields)
        return {"do": "change", "name": name, "value": value}

    def talk(self, address: str, cookie: str, end: float) -> None:
        """Send and receive until a time."""
        rng = random.Random(self.number)
        with opened(address, cookie) as socket:
            reading = threading.Thread(target=self._read, args=(socket, end))
            reading.start()
            number = 0
            while time.monotonic() < end:
                number += 1
                socket.send(json.dumps({"id": number} | self.changes(rng)))
                time.sleep(0.1)
            reading.join()

    def _read(self, socket: Any, end: float) -> None:
        """Count statuses, and add up the simulated time between frames of one scene."""
        before = np.zeros(2)
        while (rest := end - time.monotonic()) > 0:
            try:
                message = socket.recv(timeout=rest)
            except TimeoutError:
                return
            if isinstance(message, bytes):
                now = np.frombuffer(message, "<f4", 2).astype(float)
                if now[0] == before[0]:
                    # A robot that is put back begins again.
                    self.simulated += max(0.0, now[1] - before[1])
                before = now
            elif message.startswith('{"reply"'):
                self.statuses[json.loads(message)["status"]] += 1


def opened(address: str, cookie: str) -> Any:
    """Websocket of the studio."""
    from websockets.sync.client import connect

    parts = urlsplit(address)
    return connect(
        f"ws://{parts.netloc}/live",
        origin=f"http://{parts.netloc}",  # type: ignore[arg-type]
        additional_headers={"Cookie": cookie},
        compression=None,
        max_size=None,
        proxy=None,
    )


def pressed(options: argparse.Namespace) -> dict[str, Any]:
    """Let clients change the robot of the real command; the figures."""
    import psutil

    sys.path.insert(0, str(Path(__file__).parents[1] / "docs"))
    from studio_page import studio

    with studio() as address:
        process = psutil.Process().children()[0]
        cookies = CookieJar()
        opener = urllib.request.build_opener(
            urllib.request.ProxyHandler({}), urllib.request.HTTPCookieProcessor(cookies)
        )
        opener.open(address, timeout=60).close()
        cookie = "; ".join(f"{one.name}={one.value}" for one in cookies)
        with opened(address, cookie) as first:
            while not isinstance(first.recv(timeout=300), bytes):
                pass
        home = address.partition("?")[0]
        memory_before, used = process.memory_info().rss, sum(process.cpu_times()[:2])
        begin = time.monotonic()
        end = begin + 60 * options.minutes
        clients = [Client(number) for number in range(options.clients)]
        talks = [
            threading.Thread(target=client.talk, args=(address, cookie, end)) for client in clients
        ]
        for talk in talks:
            talk.start()
        waits, course = [], []
        while time.monotonic() < end:
            for page in ("", "assets/studio.js", "assets/view.js"):
                asked = time.monotonic()
                opener.open(home + page, timeout=60).read()
                waits.append(time.monotonic() - asked)
            if len(course) <= (time.monotonic() - begin) // 60:
                course.append(round(process.memory_info().rss / 1e6))
            time.sleep(0.5)
        for talk in talks:
            talk.join()
        passed = time.monotonic() - begin
        return {
            "wall": round(passed, 1),
            "simulated_a_second": [round(client.simulated / passed, 3) for client in clients],
            "statuses": dict(sum((client.statuses for client in clients), Counter())),
            "pages": len(waits),
            "longest_wait": round(max(waits), 3),
            "median_wait": round(statistics.median(waits), 4),
            "memory_before": round(memory_before / 1e6),
            "memory_after": round(process.memory_info().rss / 1e6),
            "memory_each_minute": course,
            "share_of_a_core": round((sum(process.cpu_times()[:2]) - used) / passed, 2),
            "load_of_the_machine": psutil.getloadavg(),
        }


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
