"""Cost of the live view in Foxglove, with a client that subscribes to every topic.

    python benchmarks/live.py [SECONDS]

Speed is simulated seconds per second at full speed, alone and served in turns; the newest state is
sent 60 times a second of real time. In real time, serving adds the shown share of one core.
"""

from __future__ import annotations

import math
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import contextmanager

from phasmid import load_scenario, plan
from phasmid.control import Command
from phasmid.live import serve
from phasmid.simulation import Run, new_drive, new_run

ROUNDS = 7

CLIENT = """
import json, sys
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
count = 0
with connect(sys.argv[1], subprotocols=["foxglove.sdk.v1"], max_size=None) as connection:
    try:
        for message in connection:
            content = json.loads(message) if isinstance(message, str) else {}
            for channel in content.get("channels", ()):
                wanted = [{"id": channel["id"], "channelId": channel["id"]}]
                connection.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
            if channels := content.get("channels"):
                print(len(channels), flush=True)
            count += message[:1] == bytes([1])
    except ConnectionClosed:
        pass
print(count, flush=True)
"""


@contextmanager
def watched(run: Run, pace: float):
    """Serve a run to a client in another process, which prints how many messages it received."""
    with serve(run, port=0, pace=pace) as server:
        command = [sys.executable, "-c", CLIENT, server.address]
        client = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        client.stdout.readline()
        yield client
    client.communicate(timeout=20)


def seconds(run: Run) -> tuple[float, float]:
    """Real time and processor time of a run [s]."""
    begin = time.perf_counter(), time.thread_time()
    run.simulate()
    return time.perf_counter() - begin[0], time.thread_time() - begin[1]


def compare(name: str, begin: Callable[[], Run], duration: float) -> None:
    alone, served = [], []
    for _ in range(ROUNDS):
        alone.append(seconds(begin())[0])
        run = begin()
        with watched(run, math.inf):
            served.append(seconds(run)[0])
    lost = statistics.median(1 - a / b for a, b in zip(alone, served, strict=True))
    run, processor = begin(), seconds(begin())[1]
    with watched(run, 1.0):
        added = (seconds(run)[1] - processor) / duration
    speed, slower = (duration / statistics.median(each) for each in (alone, served))
    print(
        f"{name:16} alone {speed:5.1f} s/s, served {slower:5.1f} s/s, cost {lost:6.1%}; "
        f"in real time {added:5.1%} of a core"
    )


def main() -> None:
    duration = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    scenario = load_scenario("paper").replace(duration=duration)
    walk, command = plan(scenario), Command(velocity=(0.05, 0.0, 0.1))
    compare("walk", lambda: new_run(scenario, walk), duration)
    for drive in ("ideal-servo", "servo"):
        driven = scenario.replace(drive=drive)
        compare(f"drive, {drive}", lambda s=driven: new_drive(s, None, command), duration)


if __name__ == "__main__":
    main()
