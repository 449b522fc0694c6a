"""The whole studio in this process: a robot in physics, its server, and what a browser hears."""

import json
import threading
from collections import deque
from contextlib import contextmanager

import numpy as np

from phasmid.scenario import load_scenario
from phasmid.studio.live_simulation import LiveSimulation
from phasmid.studio.server import Server, listen


class Studio:
    """A stage that stays, behind a server that can be ended and begun anew."""

    def __init__(self, out, **changes):
        scenario = load_scenario("paper").replace(**changes)
        self.stage = LiveSimulation(scenario, out=out, publish=self._publish)
        self.port = 0
        self.begin()
        self.stage.start()

    def _publish(self, message):
        # Whichever server there is now.
        self.server.publish(message)

    def begin(self):
        self._listening = listen("127.0.0.1", self.port)
        self.port = self._listening.getsockname()[1]
        self.server = Server(self._listening, token="known")
        opened = threading.Event()
        self._thread = threading.Thread(target=self.server.run, args=(self.stage, opened.set))
        self._thread.start()
        assert opened.wait(30)

    def end(self):
        self.server.stop()
        self._thread.join()
        self._listening.close()

    @property
    def origin(self):
        return f"http://127.0.0.1:{self.port}"

    @property
    def address(self):
        return self.server.address


@contextmanager
def running(out, **changes):
    """A studio that is closed in the end.

    Args:
        out: Folder of saved runs.
        changes: To the paper's scenario.
    """
    studio = Studio(out, **changes)
    try:
        yield studio
    finally:
        studio.end()
        studio.stage.close()


class Heard:
    """What came to a page through its websocket."""

    def __init__(self, window):
        self.told, self.events = {}, []
        self._frames = deque(maxlen=4)
        window.on("websocket", lambda talk: talk.on("framereceived", self._hear))

    def _hear(self, message):
        if isinstance(message, bytes):
            self._frames.append(message)
            return
        table = json.loads(message)
        self.told |= table
        self.events += [table["event"]] if "event" in table else []

    def value(self, name):
        """Numbers of the newest frame of the present scene; None before there is one."""
        scene = self.told.get("scene")
        for raw in reversed(self._frames) if scene else ():
            row, at = np.frombuffer(raw, dtype="<f4"), 0
            found = {}
            for part, count in scene["layout"]:
                found[part], at = row[at : at + count], at + count
            if at == len(row) and found["scene"][0] == scene["number"]:
                return found[name]
        return None
