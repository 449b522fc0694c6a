"""Build the demo: a page on which the robot walks in MuJoCo, in the browser and without a server.

    python tools/build_demo.py --out build/demo
    python -m http.server --directory build/demo

npm fetches MuJoCo's WebAssembly build; ``--wasm FOLDER`` takes ``mujoco.js`` and ``mujoco.wasm``
from a folder instead. Without either, the page replays a recorded walk.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tarfile
import tempfile
from importlib import metadata
from pathlib import Path

import phasmid
from phasmid.errors import PhasmidError
from phasmid.experiment import Command
from phasmid.learning import PolicyController, export_task, load_task
from phasmid.reporting.robot_mesh import mesh_pieces
from phasmid.reporting.summary import summarise
from phasmid.reporting.webpage import DRAWING, own_text, page_html
from phasmid.reporting.webpage.packing import packed
from phasmid.reporting.webpage.replay import looks
from phasmid.robot import JOINTS, load_robot
from phasmid.scenario import Scenario
from phasmid.units import STANDARD_GRAVITY

HERE = Path(__file__).parents[1] / "docs" / "demo"
PACKAGE = "@mujoco/mujoco@3.14.0"
WASM = ("mujoco.js", "mujoco.wasm")
OWN = ("style.css", "demo.js", "walker.js")
POLICY = "walk"
RECORDED, SPEED = 5.0, 0.08
"""Duration [s] and speed [m/s] of the recorded walk."""


def build(out: Path, wasm: Path | None = None) -> bool:
    """Write the demo.

    Args:
        out: Folder of the page; made where it is absent.
        wasm: Folder with MuJoCo's `WASM` files; None: they are fetched with npm.

    Returns:
        Whether the page has physics; else it replays a recorded walk.
    """
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        reason = ""
        if wasm is None:
            wasm, reason = Path(folder) / "package", _fetch(Path(folder))
        missing = [name for name in WASM if not (wasm / name).is_file()]
        if reason or missing:
            reason = reason or f"{wasm} has no {' and no '.join(missing)}"
            sys.stderr.write(f"The demo replays a recorded walk, without physics: {reason}.\n")
            (out / "index.html").write_text(recorded_walk(), encoding="utf-8")
            return False
        for name in WASM:
            shutil.copyfile(wasm / name, out / name)
    write_page(out)
    return True


def _fetch(folder: Path) -> str:
    """Unpack MuJoCo's package in a folder; return the reason if it cannot be had."""
    npm = shutil.which("npm")
    if npm is None:
        return "npm, which fetches MuJoCo's WebAssembly build, is not installed"
    command = [npm, "pack", "--silent", "--pack-destination", str(folder), PACKAGE]
    try:
        subprocess.run(command, check=True, capture_output=True, timeout=300)
        (archive,) = folder.glob("*.tgz")
        with tarfile.open(archive) as file:
            file.extractall(folder, filter="data")
    except (OSError, subprocess.SubprocessError, ValueError, tarfile.TarError):
        return f"npm cannot fetch {PACKAGE}"
    return ""


def write_page(out: Path) -> None:
    """Write the page with physics, beside MuJoCo's files."""
    task = load_task(POLICY)
    robot = load_robot(task.robot)
    export_task(task, out)
    (out / "policy.json").write_text(json.dumps(policy_layers()), encoding="utf-8")
    pieces = mesh_pieces(robot)
    scene = looks(robot, pieces) | {
        "weight": robot.mass * STANDARD_GRAVITY,
        "bodies": [f"{robot.leg_names[leg]}.{JOINTS[frame]}" for leg, frame in pieces.links],
        "names": [name.replace("_", " ") for name in robot.leg_names],
        "level": 0.0,
        "ground": None,
        "patches": None,
    }
    (out / "scene.json").write_text(json.dumps(scene), encoding="utf-8")
    scripts = [*DRAWING, "input.js"]
    for name in DRAWING:
        (out / name).write_text(own_text(name), encoding="utf-8")
    studio = Path(phasmid.__file__).parent / "studio" / "page"
    shutil.copyfile(studio / "input.js", out / "input.js")
    for name in OWN:
        shutil.copyfile(HERE / name, out / name)
    colours = own_text("colours.css")
    (out / "colours.css").write_text(colours, encoding="utf-8")
    tags = "\n".join(f'<script src="{name}"></script>' for name in scripts)
    page = (HERE / "index.html").read_text(encoding="utf-8")
    (out / "index.html").write_text(page.replace("<!-- drawing -->", tags), encoding="utf-8")
    for file in metadata.files("mujoco-core") or ():
        if file.name == "LICENSE":
            shutil.copyfile(file.locate(), out / "mujoco-license.txt")


def policy_layers() -> list[dict[str, object]]:
    """Return weights and biases of the policy's layers, packed for the page."""
    import onnx

    path = Path(phasmid.__file__).parent / "learning" / "policies" / f"{POLICY}.onnx"
    arrays = [onnx.numpy_helper.to_array(one) for one in onnx.load(path).graph.initializer]
    return [
        {"weights": packed(weights, "f32"), "biases": packed(biases, "f32")}
        for weights, biases in zip(arrays[::2], arrays[1::2], strict=True)
    ]


def recorded_walk() -> str:
    """Return the page of a walk of the policy, as of a run's report."""
    controller = PolicyController(POLICY)
    scenario = Scenario().replace(
        robot=controller.task.robot, duration=RECORDED, drive="servo", name="policy-walk"
    )
    run = phasmid.drive(scenario, controller, Command(velocity=(SPEED, 0.0, 0.0)))
    page = page_html(run, summarise(run), ())
    back = (
        '<p><a href="../index.html">phasmid</a>: a neural network moves the 18 servos of this '
        f"hexapod. The walk of {RECORDED:g} s is recorded.</p>\n</header>"
    )
    return page.replace("</header>", back, 1)


def main() -> None:
    """Build the demo from the command line."""
    parser = argparse.ArgumentParser(description="Build the demo of phasmid.")
    parser.add_argument("--out", type=Path, required=True, help="folder of the page")
    parser.add_argument("--wasm", type=Path, help="folder with mujoco.js and mujoco.wasm")
    options = parser.parse_args()
    try:
        build(options.out, options.wasm)
    except (PhasmidError, OSError) as error:
        sys.exit(f"build_demo.py: {error}")


if __name__ == "__main__":
    main()
