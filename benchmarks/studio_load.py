"""The live page under load: pace, frames a second, waits, memory.

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

sys.path.insert(0, str(Path(__file__).parents[1] / "tools"))

from pages.studio import chromium, studio, walked


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


def main() -> None:
    """Run, and print a line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--browsers", type=int, default=0, help="pages of the real command")
    parser.add_argument("--clients", type=int, default=4, help="who send ten changes a second")
    options = parser.parse_args()
    print(json.dumps(seen(options) if options.browsers else pressed(options)))


if __name__ == "__main__":
    main()
