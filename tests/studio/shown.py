"""The page in a browser, shown frames of a robot that stands: no physics runs."""

import json
from contextlib import contextmanager

import numpy as np

from browsers import until
from phasmid import load_scenario
from phasmid.studio.fields import catalogue, values
from phasmid.studio.live import LiveRobot
from phasmid.studio.scene import Scene
from phasmid.studio.setting import setting_of
from studio.pretended import TOKEN, PretendedStage, running


class Shown:
    """A page, and frames for it.

    Attributes:
        window: The page.
        scene: What it draws.
        stage: What it asks.
        values: Of the setting.
    """

    def __init__(self, window, scene, stage, server, row, values):
        self.window, self.scene, self.stage, self.values = window, scene, stage, values
        self._server, self._row = server, row

    def tell(self, kind, value):
        """Tell the page something else than a frame."""
        self._server.publish(json.dumps({kind: value}))

    def show(self, **changes):
        """Show a frame with other numbers, by the names of its layout."""
        row, at = self._row.copy(), 0
        for name, count in self.scene.layout:
            row[at : at + count] = changes.get(name, row[at : at + count])
            at += count
        count = self.window.evaluate("Phasmid.studio.frames.count")
        self._server.publish(row.tobytes())
        until(self.window, f"Phasmid.studio.frames.count > {count}")


@contextmanager
def shown(browser, *, middle=(0.0, 0.0), size=(1200, 900), **changes):
    """A page with a robot that stands.

    Args:
        browser: A browser.
        middle: Where the ground is shown [m].
        size: Of the window.
        changes: To the paper's scenario.
    """
    setting = setting_of(load_scenario("paper").replace(**changes))
    live = LiveRobot(setting)
    scene = Scene(live, 1)
    scene._draw_ground(np.array(middle))
    state = {"playing": True, "pace": 1.0, "recording": None, "status": "walks", "sentence": ""}
    told = {
        "catalogue": catalogue(setting),
        "scene": scene.table,
        "setting": values(setting),
        "state": state | {"lost": [], "dead": [], "time": 0.0},
    }
    stage = PretendedStage()
    stage.hello = lambda: [json.dumps({kind: value}) for kind, value in told.items()]
    with running(stage) as studio:
        window = browser.new_page(
            viewport={"width": size[0], "height": size[1]}, color_scheme="light"
        )
        wrong = []
        window.on("pageerror", lambda error: wrong.append(str(error)))
        window.goto(f"{studio.origin}/?token={TOKEN}")
        until(window, "document.querySelectorAll('#legend li').length > 0")
        row = np.frombuffer(scene.frame(live, 1.0), "<f4")
        yield Shown(window, scene, stage, studio.server, row, told["setting"])
        window.close()
    assert wrong == []
