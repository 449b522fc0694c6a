"""Random commands and walks over unknown ground: tables of docs/control.md.

    python tools/pages control [--processes=N] [--seeds=20] [--sequences=1000] [--simulated=100]
        [--only=TABLE]

Takes two hours on two cores, most of it unknown ground. The page's prose stays as it is.
"""

from __future__ import annotations

import argparse
import json
import math
import os
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import ground
from ground import BLIND, GROUNDS, MODES, SEEING, label
from phasmid import drive as simulate
from phasmid.control import LocomotionEngine
from phasmid.errors import InvalidInput
from phasmid.experiment import Command, Ending
from phasmid.reporting.style import RUN_COLOURS, save_figure, styled
from phasmid.robot import Robot, load_robot
from phasmid.scenario import Scenario
from phasmid.servo import load_servo
from support.kinematic_world import drive, random_commands, worst

DOCS = Path(__file__).parents[2] / "docs"

Case = dict[str, Any]
"""Parameters and results of one run; numbers, texts and lists of them."""


def run(measure: Callable[..., Case], cases: Sequence[Case], processes: int) -> list[Case]:
    """Measure all cases; each result includes its case."""
    # Each run has one core; threads of linear algebra would occupy the others.
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        futures = [pool.submit(measure, **case) for case in cases]
        return [case | future.result() for case, future in zip(cases, futures, strict=True)]


def markdown(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table whose columns are flush right, except the first."""
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)


def grouped(results: Iterable[Case], *names: str) -> dict[tuple[Any, ...], list[Case]]:
    """Group results by the values of some entries, in order of appearance."""
    groups: dict[tuple[Any, ...], list[Case]] = {}
    for result in results:
        groups.setdefault(tuple(result[name] for name in names), []).append(result)
    return groups


# Random commands ----------------------------------------------------------------------------------

WALKER, SETTLING = "phantomx-ax", 8.0
"""Robot, and time at the end in which it comes to rest [s]."""

WORLDS = {
    "forces-free": "kinematic simulation",
    "ideal-servo": "the physics engine, ideal servos",
}


def follow(world: str, seed: int, duration: float = 30.0) -> Case:
    """Follow one sequence of random commands, and stop."""
    robot = load_robot(WALKER)
    commands = random_commands(robot, np.random.default_rng(seed), duration - SETTLING)
    commands.append((duration - SETTLING, Command(gait=commands[-1][1].gait)))
    engine = LocomotionEngine(robot)
    walk = _kinematic if world == "forces-free" else partial(_simulated, world=world)
    result = walk(engine, robot, commands, duration)
    result |= {"commands": len(commands), "rests": engine.is_standing}
    faults = {
        "fell": result["fell"],
        "joint faster than its servo": result["joint_speed"] > 1 + 1e-9,
        "joint beyond its limit": result["beyond"],
        "support margin below zero": not result["margin"] >= 0,
        "standing foot moved": result.get("slip", 0.0) > 1e-9,
        "unreachable": result["unreachable"],
        "never came to rest": not result["rests"] and not result["fell"],
    }
    return result | {"faults": [name for name, holds in faults.items() if holds]}


def _kinematic(engine: LocomotionEngine, robot: Robot, commands: list, duration: float) -> Case:
    history = drive(engine, commands, duration)
    numbers = worst(history)
    return {
        "fell": False,
        "joint_speed": numbers["speed"],
        "beyond": numbers["beyond"] > 0,
        "margin": numbers["margin"],
        "slip": numbers["slip"],
        "distance": numbers["way"],
        "unreachable": any("held all" in sentence for _, sentence in history.events),
    }


def _simulated(
    engine: LocomotionEngine, robot: Robot, commands: list, duration: float, world: str
) -> Case:
    scenario = Scenario().replace(
        robot=WALKER, drive=world, duration=duration, record_interval_ms=5, terrain="flat"
    )
    starts = [start for start, _ in commands]

    def command(time: float, _: object) -> Command:
        return commands[np.searchsorted(starts, time + 1e-9, side="right") - 1][1]

    recording = simulate(scenario, engine, command)
    target = recording["joint_position_target"].values
    limits = robot.arrays.joint_limits
    speed = np.abs(np.diff(target, axis=0)).max() / np.diff(recording["time"].values).min()
    path = recording["body_position"].values[:, :2]
    events = [sentence for _, sentence in json.loads(str(recording.attrs["events"]))]
    return {
        "fell": not Ending[recording.attrs["ending"]].is_full_length,
        "joint_speed": float(speed / robot.servo.no_load_speed),
        "beyond": bool(np.any((target < limits[..., 0]) | (target > limits[..., 1]))),
        "margin": float(recording["support_margin"].values.min()),
        "distance": float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum()),
        "unreachable": any("held all" in sentence for sentence in events),
    }


def sequence_table(results: list[Case], duration: float = 30.0) -> str:
    """Return the table of random commands, by world."""
    rows = []
    for (world,), runs in grouped(results, "world").items():
        faults = Counter(name for run in runs for name in run["faults"])
        rows.append(
            (
                WORLDS[world],
                len(runs),
                f"{duration:g} s",
                sum(run["commands"] for run in runs),
                f"{sum(run['distance'] for run in runs):.0f} m",
                sum(not run["faults"] for run in runs),
                f"{1000 * min(run['margin'] for run in runs):.1f} mm",
                f"{100 * max(run['joint_speed'] for run in runs):.1f} %",
                ", ".join(f"{name}: {count}" for name, count in faults.items()) or "none",
            )
        )
    head = ["world", "sequences", "duration", "commands", "distance", "passed"]
    head += ["least support margin", "fastest joint, of its servo's", "failures"]
    return markdown(head, rows)


# Unknown ground -----------------------------------------------------------------------------------

DRIVES = {"ideal": ground.JOINTS, "AX-12A": "servo"}
"""Drives of the joints; AX-12A servos replace the robot's own."""

HARDEST = {
    "stairs": (40, 60, 67),
    "slope": (25,),
    "blocks": (80, 100),
    "gap": (60,),
    "stepping stones": (200,),
}
"""Kinds and sizes that are walked with `HELD_OUT_SEEDS`, too."""

HELD_OUT_SEEDS = range(400, 420)
"""Seeds that no constant of the controller was chosen on."""


def cross(kind: str, size: float, mode: str, seed: int, joints: str = "ideal") -> Case:
    """Walk over one ground."""
    robot = load_robot(ground.ROBOT)
    if joints == "AX-12A":
        robot = replace(robot, servo=load_servo(joints))
    try:
        scenario = ground.scenario_of(kind, size, seed, robot, DRIVES[joints])
        scenario = scenario.replace(**MODES[mode].scenario)
    except InvalidInput as error:
        # Hills of some seeds are steeper than the contact is verified for.
        return {"refused": str(error)}
    engine = ground.engine_of(robot, kind, mode)
    return case_of(ground.walk(scenario, engine, ground.task_of(kind, size))[0])


def case_of(outcome: ground.Outcome) -> Case:
    """Return the result of a walk as that of a case."""
    return {"passed": not outcome.why, **outcome._asdict()}


def ground_table(results: list[Case], *columns: str) -> str:
    """Return the table of the runs that passed, by ground and values of some entries."""
    heads = list(grouped(results, *columns))
    rows = []
    for (kind, size), runs in grouped(results, "kind", "size").items():
        cells = grouped(runs, *columns)
        rows.append([label(kind, size), *(_cell(cells.get(head, [])) for head in heads)])
    return markdown(["ground", *map(", ".join, heads)], rows)


def _cell(runs: list[Case]) -> str:
    """Return the runs that passed, mean tilt and time, and the failures."""
    walks = [run for run in runs if "passed" in run]
    if not walks:
        return "–"
    times = [run["time"] for run in walks if run["passed"]]
    failures = Counter(run["why"] for run in walks if not run["passed"])
    text = f"**{len(times)}** of {len(walks)}, {np.mean([run['tilt'] for run in walks]):.1f}°"
    text += f", {np.mean(times):.1f} s" if times else ""
    counts = ", ".join(f"{count} {why}" for why, count in sorted(failures.items()))
    return text + (f" ({counts})" if counts else "")


def draw(results: list[Case], path: Path) -> None:
    """Draw the share of runs that passed over the size of each ground."""
    by_kind = grouped((run for run in results if "passed" in run), "kind")
    modes = [mode for (mode,) in grouped(results, "mode")]
    rows = math.ceil(len(by_kind) / 6)
    with styled():
        figure = Figure(figsize=(11, 3.1 * rows), layout="constrained")
        panels = figure.subplots(rows, math.ceil(len(by_kind) / rows), sharey=True, squeeze=False)
        for axes in panels.flat[len(by_kind) :]:
            axes.remove()
        for axes, ((kind,), runs) in zip(panels.flat, by_kind.items(), strict=False):
            for (mode,), walks in grouped(runs, "mode").items():
                sizes = grouped(walks, "size")
                share = [100 * np.mean([run["passed"] for run in some]) for some in sizes.values()]
                style = {"without": ":s", "ground sensing": "--o", "dynamics": "-.v"}
                axes.plot(
                    [size for (size,) in sizes],
                    share,
                    style.get(mode, "-^"),
                    label=mode,
                    markersize=4,
                    color=RUN_COLOURS[modes.index(mode) % len(RUN_COLOURS)],
                )
            field, unit = GROUNDS[kind].field, GROUNDS[kind].unit
            words = (field.rpartition("_")[0] if unit else field).replace("_", " ")
            axes.set(
                title=kind.replace(" with ", "\nwith "),
                xlabel=f"{words} [{unit}]" if unit else words,
                ylim=(-5, 105),
            )
        for axes in panels[:, 0]:
            axes.set_ylabel("passed [%]")
        lines = panels[0, 0].get_lines()
        figure.legend(handles=lines, loc="outside lower center", ncols=len(lines))
        save_figure(figure, path, dpi=100)


# The page -----------------------------------------------------------------------------------------


def with_table(text: str, heading: str, table: str) -> str:
    """Return a page with another first table below a heading."""
    start = text.index("\n| ", text.index(f"\n{heading}\n")) + 1
    return text[:start] + table + text[text.index("\n\n", start) :]


def main() -> None:
    """Measure and write the tables and the figure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--seeds", type=int, default=20, help="of each ground")
    parser.add_argument("--sequences", type=int, default=1000, help="without forces")
    parser.add_argument("--simulated", type=int, default=100, help="sequences with physics")
    parser.add_argument("--only", choices=("commands", "ground", "hardest"))
    options = parser.parse_args()
    measured = partial(run, processes=options.processes)
    tables = {}
    if options.only in (None, "commands"):
        counts = {"forces-free": options.sequences, "ideal-servo": options.simulated}
        cases = [{"world": w, "seed": seed} for w, n in counts.items() for seed in range(n)]
        tables["### Random commands"] = sequence_table(measured(follow, cases))
    if options.only in (None, "ground"):
        cases = [
            {"kind": kind, "size": size, "mode": mode, "seed": seed}
            for kind in GROUNDS
            for size in GROUNDS[kind].sizes
            for mode in MODES
            for seed in range(options.seeds)
        ]
        results = measured(cross, cases)
        draw(results, DOCS / "images" / "control-terrain.png")
        tables["### Unknown ground"] = ground_table(results, "mode")
    if options.only in (None, "hardest"):
        cases = [
            {"kind": kind, "size": size, "mode": mode, "seed": seed, "joints": joints}
            for kind, sizes in HARDEST.items()
            for size in sizes
            for joints in DRIVES
            for mode in (BLIND, SEEING)
            for seed in HELD_OUT_SEEDS[: options.seeds]
        ]
        tables["### The hardest grounds"] = ground_table(measured(cross, cases), "mode", "joints")
    page = DOCS / "control.md"
    text = page.read_text("utf-8")
    for heading, table in tables.items():
        text = with_table(text, heading, table)
    page.write_text(text, "utf-8")
