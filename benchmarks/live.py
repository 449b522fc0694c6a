"""Cost of the live view in Foxglove: processor time of a run alone and served, in turns.

    python benchmarks/live.py [SECONDS]

A client in another process subscribes to the topics of `docs/foxglove-layout.json`, or to all. The
cost is the added processor time of the simulating thread, in seconds per second at 60 updates a
second: the share of its speed that a run loses. At full speed the run waits for nothing. In real
time it sleeps between updates, and its data leave the processor's caches.
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

CLIENTS = {"layout": ("/tf", "/links", "/scene", "/joint_states"), "all topics": None}

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


def compare(name: str, begin: Callable[[float], Run], seconds: float) -> None:
    speed = seconds / processor_time(begin(seconds))
    for title, pace in ("at full speed", speed), ("in real time", 1.0):
        costs: dict[str, list[float]] = {key: [] for key in CLIENTS}
        for _ in range(ROUNDS):
            alone = processor_time(begin(seconds * pace))
            for key, topics in CLIENTS.items():
                spent, updates = served(begin(seconds * pace), pace, topics)
                costs[key].append(60 * (spent - alone) / updates)
        shares = (f"{key} {statistics.median(each):5.1%}" for key, each in costs.items())
        print(f"{name:10} {title:14} {pace:5.1f} s/s, cost:", *shares, flush=True)


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 5.0
    scenario = load_scenario("paper")
    walk, command = plan(scenario), Command(velocity=(0.05, 0.0, 0.1))
    compare("walk", lambda time: new_run(scenario.replace(duration=time), walk), seconds)
    driven = scenario.replace(drive="ideal-servo")
    compare("drive", lambda time: new_drive(driven.replace(duration=time), None, command), seconds)


if __name__ == "__main__":
    main()
