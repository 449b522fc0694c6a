"""The demo: a recorded walk without MuJoCo's WebAssembly build, physics in the browser with it."""

import base64
import functools
import http.server
import json
import os
import re
import threading
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from build_demo import build
from support.browsers import NEEDED, is_ours, pixels, started, until
from support.exported_walks import walk

ROOT = Path(__file__).parents[2]
WASM = Path(os.environ.get("PHASMID_MUJOCO_WASM", ROOT / "build/demo"))

browser_needed = [
    *NEEDED,
    pytest.mark.skipif(
        not (WASM / "mujoco.wasm").is_file(),
        reason="PHASMID_MUJOCO_WASM names no folder with MuJoCo's WebAssembly build",
    ),
]


def test_without_physics_the_demo_replays_a_walk(tmp_path, capsys):
    assert build(tmp_path / "page", tmp_path) is False
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert f"{tmp_path} has no mujoco.js and no mujoco.wasm" in told
    page = (tmp_path / "page/index.html").read_text("utf-8")
    assert 'href="../index.html"' in page
    scene = json.loads(re.search(r'id="scene">(.*?)</script>', page)[1])
    packed = scene["body_position"]
    position = np.frombuffer(base64.b64decode(packed["data"]), "<f4").reshape(packed["shape"])
    # Five seconds at 80 mm/s; docs/learning.md: the policy walks 7 % slower with the servos' law.
    assert position[-1, 0] - position[0, 0] == pytest.approx(0.93 * 0.4, abs=0.03)


def marked(test):
    """A test that needs a browser and MuJoCo's WebAssembly build."""
    for mark in browser_needed:
        test = mark(test)
    return test


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """The folder of a demo with physics, and its address on a plain file server."""
    folder = tmp_path_factory.mktemp("demo")
    assert build(folder, WASM) is True
    handler = functools.partial(Quiet, directory=folder)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield folder, f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


class Quiet(http.server.SimpleHTTPRequestHandler):
    """A file server that writes no log."""

    def log_message(self, *args):
        """Write nothing."""


@pytest.fixture(scope="module")
def browser():
    with started("--use-gl=angle", "--use-angle=swiftshader") as browser:
        yield browser


@contextmanager
def opened(browser, page, *, width=1000, height=700, scheme="light"):
    """The walking robot in a window that gets the folder's files alone; nothing goes wrong."""
    address, wrong = page[1], []
    context = browser.new_context(viewport={"width": width, "height": height}, color_scheme=scheme)

    def serve(route):
        if route.request.url.startswith((address, "data:")):
            route.continue_()
        else:
            wrong.append(f"asks: {route.request.url}")
            route.abort()

    context.route("**/*", serve)
    window = context.new_page()
    window.on("console", lambda line: is_ours(line) and wrong.append(f"{line.type}: {line.text}"))
    window.on("pageerror", lambda error: wrong.append(f"error: {error}"))
    window.on("requestfailed", lambda request: wrong.append(f"failed: {request.url}"))
    window.goto(address)
    window.wait_for_selector("#readings:not([hidden])", timeout=90_000)
    yield window
    context.close()
    assert wrong == []


def number(name, index=0):
    """A reading of the page, as JavaScript."""
    return f"Number(document.getElementById('{name}').textContent.match(/-?[\\d.]+/g)[{index}])"


@marked
@pytest.mark.parametrize(("width", "scheme"), [(390, "light"), (1000, "dark")])
def test_the_robot_walks_by_itself(browser, page, width, scheme):
    with opened(browser, page, width=width, scheme=scheme) as window:
        until(window, f"{number('time')} > 2.4 && {number('place')} > 0.1")
        assert 64 <= window.evaluate(number("speed")) <= 88
        assert window.evaluate("document.documentElement.scrollWidth") <= width
        shown = pixels(window)
        assert len(np.unique(shown.reshape(-1, 3), axis=0)) > 200
        assert (shown.mean() < 128) == (scheme == "dark")


@marked
def test_the_page_computes_what_the_package_computes(browser, page):
    """Both round to 24 bits in the network and to 53 in the physics, in two versions of MuJoCo.

    A difference of 1e-3 rad is a fifth of what the servo resolves; a wrong observation, delay or
    friction makes a hundred times as much.
    """
    command, seconds = (0.08, 0.02, 0.1), 5.0
    with opened(browser, page) as window:
        targets, position = window.evaluate(
            """async ([command, seconds]) => {
              const { default: load } = await import("./mujoco.js");
              const { Walker } = await import("./walker.js");
              const read = async (name) => (await fetch(name)).json();
              const { unpacked } = Phasmid.algebra;
              const layers = (await read("policy.json")).map((layer) => ({
                weights: unpacked(layer.weights), biases: unpacked(layer.biases) }));
              const xml = await (await fetch("robot.xml")).text();
              const walker = new Walker(await load(), xml, await read("task.json"), layers);
              walker.command = command;
              const targets = [];
              while (walker.time < seconds - 1e-9) {
                walker.advance();
                if (targets.at(-1) !== walker.target) targets.push(walker.target);
              }
              return [targets, walker.position];
            }""",
            [command, seconds],
        )
    positions, expected = walk(page[0], "walk", command, seconds)
    np.testing.assert_allclose(targets, expected, atol=1e-3)
    np.testing.assert_allclose(position, positions[-1], atol=1e-3)
