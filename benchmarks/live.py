"""Cost of the live view in Foxglove: processor time of a run alone and served, in turns.

    python benchmarks/live.py [SECONDS]

A client in another process subscribes to the topics of `docs/foxglove-layout.json`, or to all. The
cost is the added processor time of the simulating thread, in seconds per second at 60 updates a
second: the share of its speed that a run loses. It is the time of the shorter blocks in which a
watched run advances, and that of the server. At full speed the run waits for nothing. In real time
it sleeps between updates, and the server's data leave the processor's caches. Each figure is the
least of some rounds, since other work on the machine only adds to it.
"""

from __future__ import annotations

import math
import subprocess
import sys
import time
from collections.abc import Callable, Mapping

import numpy as np

from phasmid import load_scenario, plan
from phasmid.experiment import Command
from phasmid.live import RATE, serve
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


def cost_of_blocks(begin: Callable[[float], Run], seconds: float, pace: float) -> float:
    """Share of a core that the blocks between two updates add."""
    alone = watched = math.inf
    for _ in range(ROUNDS):
        alone = min(alone, processor_time(begin(seconds)))
        run = begin(seconds)
        run.watch(lambda times, channels: None, pace / RATE)
        watched = min(watched, processor_time(run))
    return (watched - alone) * pace / seconds


def cost_of_server(run: Run, pace: float, topics: tuple[str, ...] | None) -> float:
    """Share of a core that the server takes with a client; None: it subscribes to all topics."""
    wanted = ["all"] if topics is None else ["some", *topics]
    with serve(run, port=0, pace=pace) as server:
        spent = 0.0

        def show(times: np.ndarray, channels: Mapping[str, np.ndarray]) -> None:
            nonlocal spent
            begin = time.thread_time()
            server.show(times, channels)
            spent += time.thread_time() - begin

        run.watch(show, pace / RATE)
        command = [sys.executable, "-c", CLIENT, server.address, *wanted]
        client = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        client.stdout.readline()
        run.simulate()
    updates = int(client.communicate(timeout=20)[0].split()[-1])
    return RATE * spent / updates


def compare(name: str, begin: Callable[[float], Run], seconds: float) -> None:
    # The first run compiles.
    processor_time(begin(seconds))
    speed = seconds / processor_time(begin(seconds))
    for title, pace in ("at full speed", speed), ("in real time", 1.0):
        blocks = cost_of_blocks(begin, seconds, pace)
        print(f"{name:6} {title:14} {pace:5.1f} s/s: blocks {blocks:.1%}, server:", end="")
        for key, topics in CLIENTS.items():
            runs = (begin(seconds * pace) for _ in range(ROUNDS))
            cost = min(cost_of_server(run, pace, topics) for run in runs)
            print(f" {key} {cost:.1%}", end="", flush=True)
        print()


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 5.0
    scenario = load_scenario("paper")
    walk, command = plan(scenario), Command(velocity=(0.05, 0.0, 0.1))
    compare("walk", lambda time: new_run(scenario.replace(duration=time), walk), seconds)
    driven = scenario.replace(drive="ideal-servo")
    compare("drive", lambda time: new_drive(driven.replace(duration=time), None, command), seconds)


if __name__ == "__main__":
    main()
