"""A stage that tests can ask and listen to."""

import json
import time
from contextlib import contextmanager

import numpy as np

import phasmid
from phasmid.studio.live_simulation import LiveSimulation

PATIENCE = 600.0
"""Longest wall time for anything that happens, on a machine that does other things too [s]."""


class Heard:
    """A stage, and what it has published."""

    def __init__(self, folder, scenario="paper", **changes):
        self.texts, self.frames = [], []
        made = phasmid.load_scenario(scenario).replace(**changes)
        self.stage = LiveSimulation(made, out=folder, publish=self._take)

    def _take(self, what):
        if isinstance(what, bytes):
            self.frames.append(what)
        else:
            self.texts.append(json.loads(what))

    def submit(self, request):
        return self.stage.submit(request).result(PATIENCE)

    def newest(self, kind):
        return next(text[kind] for text in reversed(self.texts) if kind in text)

    @property
    def events(self):
        return [text["event"] for text in list(self.texts) if "event" in text]

    def wait_for(self, is_so):
        """Wait until something is so; its first value that counts as true."""
        end = time.monotonic() + PATIENCE
        while not (found := is_so()):
            assert time.monotonic() < end, "it did not happen"
            time.sleep(0.01)
        return found

    def event(self, part):
        return self.wait_for(lambda: next((e for e in self.events if part in e["text"]), None))

    def frame(self):
        """The next frame, by the names of its layout."""
        count = len(self.frames)
        self.wait_for(lambda: len(self.frames) > count + 1)
        return self.named(self.frames[-1])

    def named(self, frame):
        row, at, found = np.frombuffer(frame, "<f4"), 0, {}
        for name, count in self.newest("scene")["layout"]:
            found[name] = row[at : at + count]
            at += count
        assert at == len(row)
        return found


@contextmanager
def staged(folder, scenario="paper", **changes):
    heard = Heard(folder, scenario, **changes)
    heard.stage.viewers(1)
    heard.stage.start()
    try:
        heard.wait_for(lambda: any("scene" in text for text in heard.texts))
        yield heard
    finally:
        heard.stage.close()
