"""Cost of the live view in Foxglove: processor time of a run alone and served, in turns.

    python benchmarks/live.py [SECONDS]

Clients in another process subscribe to one topic, to those of `docs/foxglove-layout.json`, or to
all. The cost is the added processor time of the simulating thread per update, times 60 a second:
the share of its speed that a run loses. At full speed the run waits for nothing; in real time it
sleeps between updates, and its data leave the processor's caches.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import time
from collections.abc import Callable

from phasmid import load_scenario, plan
from phasmid.control import Command
from phasmid.live import serve
from phasmid.simulation import Run, new_drive, new_run

ROUNDS = 3

LAYOUT = ("/tf", "/links", "/scene", "/joint_states")

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
                if channel["topic"] not in sys.argv[3:] and sys.argv[2] != "all":
                    continue
                wanted = [{"id": channel["id"], "channelId": channel["id"]}]
                connection.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
            if channels := content.get("channels"):
                print(len(channels), flush=True)
            count += message[:1] == bytes([2])
    except ConnectionClosed:
        pass
print(count, flush=True)
"""


def processor_time(run: Run) -> float:
    """Processor time of a run in this thread [s]."""
    begin = time.thread_time()
    run.simulate()
    return time.thread_time() - begin


def served(run: Run, pace: float, topics: tuple[str, ...] | None) -> tuple[float, int]:
    """Processor time [s] and updates of a run with a client; None: it subscribes to all topics."""
    wanted = ["all"] if topics is None else ["some", *topics]
    with serve(run, port=0, pace=pace) as server:
        command = [sys.executable, "-c", CLIENT, server.address, *wanted]
        client = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        client.stdout.readline()
        spent = processor_time(run)
    return spent, int(client.communicate(timeout=20)[0].split()[-1])


def compare(name: str, begin: Callable[[], Run], duration: float) -> None:
    clients = {"one topic": ("/tf",), "layout": LAYOUT, "all": None}
    full: dict[str, list[float]] = {key: [] for key in clients}
    real: dict[str, list[float]] = {key: [] for key in clients}
    for _ in range(ROUNDS):
        alone = processor_time(begin())
        for key, topics in clients.items():
            for costs, pace in (full, duration / alone), (real, 1.0):
                spent, updates = served(begin(), pace, topics)
                costs[key].append(60 * (spent - alone) / updates)
    print(f"{name}, {duration / alone:.1f} times real time alone")
    for title, costs in ("at full speed", full), ("in real time", real):
        shares = (f"{key} {statistics.median(each):5.1%}" for key, each in costs.items())
        print(f"  {title:14}", *shares, sep="  ")


def main() -> None:
    duration = float(sys.argv[1]) if len(sys.argv) > 1 else 5.0
    scenario = load_scenario("paper").replace(duration=duration)
    walk, command = plan(scenario), Command(velocity=(0.05, 0.0, 0.1))
    compare("walk", lambda: new_run(scenario, walk), duration)
    for drive in ("ideal-servo", "servo"):
        driven = scenario.replace(drive=drive)
        compare(f"drive, {drive}", lambda s=driven: new_drive(s, None, command), duration)


if __name__ == "__main__":
    main()
