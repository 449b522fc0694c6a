"""Walks over unknown ground, with ground sensing and dynamics and without.

Grounds, modes and the rule by which a walk passes are those of ``tools/ground.py``.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

import ground
from ground import BLIND, GROUNDS, MODES, ROBOT, SEEING, label
from phasmid.control import LocomotionEngine
from phasmid.control.estimation import EstimatorSettings
from phasmid.errors import InvalidInput
from phasmid.experiment import Command
from phasmid.kinematics import quaternion_rotation
from phasmid.reporting.style import RUN_COLOURS, save_figure, styled
from phasmid.robot import Robot, load_robot, load_servo
from phasmid.scenario import Scenario
from phasmid.simulation import drive

from .study import Case, grouped, markdown

DRIVES = {"ideal": ground.JOINTS, "AX-12A": "servo"}
"""Drives of the joints; AX-12A servos replace the robot's own."""

COLUMNS = 6
"""Most panels in a row of the figure."""


def cases(
    seeds: int = 20, kinds: tuple[str, ...] = tuple(GROUNDS), modes: tuple[str, ...] = tuple(MODES)
) -> list[Case]:
    """Return every ground, mode and seed."""
    return [
        {"kind": kind, "size": size, "mode": mode, "seed": seed}
        for kind in kinds
        for size in GROUNDS[kind].sizes
        for mode in modes
        for seed in range(seeds)
    ]


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


def hardest_cases(seeds: int = 20) -> list[Case]:
    """Return runs on the hardest grounds with held-out seeds, on ideal and on AX-12A servos."""
    return [
        {"kind": kind, "size": size, "mode": mode, "seed": seed, "joints": joints}
        for kind, sizes in HARDEST.items()
        for size in sizes
        for joints in DRIVES
        for mode in (BLIND, SEEING)
        for seed in HELD_OUT_SEEDS[:seeds]
    ]


def robot_with(joints: str) -> Robot:
    """Return the robot with its own servos, or with those of `DRIVES` in their place."""
    robot = load_robot(ROBOT)
    return replace(robot, servo=load_servo(joints)) if joints == "AX-12A" else robot


def measure(kind: str, size: float, mode: str, seed: int, joints: str = "ideal") -> Case:
    """Walk over one ground."""
    robot = robot_with(joints)
    try:
        scenario = ground.scenario_of(kind, size, seed, robot, DRIVES[joints])
        scenario = scenario.replace(**MODES[mode].scenario)
    except InvalidInput as error:
        # Hills of some seeds are steeper than the contact is verified for.
        return {"refused": str(error)}
    engine = ground.engine_of(robot, kind, mode)
    outcome, _ = ground.walk(scenario, engine, ground.task_of(kind, size))
    return case_of(outcome)


def case_of(outcome: ground.Outcome) -> Case:
    """Return the result of a walk as that of a study."""
    return {"passed": not outcome.why, **outcome._asdict()}


def table_of_hardest(results: list[Case]) -> str:
    """Return the table of the runs on the hardest grounds, by mode and servo."""
    columns = [(mode, joints) for joints in DRIVES for mode in (BLIND, SEEING)]
    rows = []
    for (kind, size), runs in grouped(results, "kind", "size").items():
        some = (
            [run for run in runs if (run["mode"], run["joints"]) == column] for column in columns
        )
        rows.append([label(kind, size), *map(cell, some)])
    return markdown(["ground", *(f"{mode}, {joints}" for mode, joints in columns)], rows)


def table(results: list[Case]) -> str:
    """Return the table of the runs that passed, by ground and mode."""
    modes = [mode for (mode,) in grouped(results, "mode")]
    rows = [
        [label(kind, size), *(cell([r for r in runs if r["mode"] == mode]) for mode in modes)]
        for (kind, size), runs in grouped(results, "kind", "size").items()
    ]
    return markdown(["ground", *modes], rows)


def cell(runs: list[Case]) -> str:
    """Return the runs that passed, mean tilt and time, and the failures, as a table has them."""
    mine = [run for run in runs if "passed" in run]
    if not mine:
        return "–"
    tilt = np.mean([run["tilt"] for run in mine])
    times = [run["time"] for run in mine if run["passed"]]
    whys = [run["why"] for run in mine if not run["passed"]]
    failed = ", ".join(f"{whys.count(why)} {why}" for why in sorted(set(whys)))
    text = f"**{sum(run['passed'] for run in mine)}** of {len(mine)}, {tilt:.1f}°"
    text += f", {np.mean(times):.1f} s" if times else ""
    return text + (f" ({failed})" if failed else "")


def levelling(slope_deg: float = 10.0, duration: float = 5.0) -> Case:
    """Measure the tilt of a body that stands on a slope, parallel to it and levelled."""
    tilts = {}
    for name, level in (("parallel", 0.0), ("level", 1.0)):
        scenario = Scenario().replace(
            robot=ROBOT,
            drive=ground.JOINTS,
            duration=duration,
            record_interval_ms=20,
            terrain={"kind": "slope", "slope_deg": slope_deg, "planned_on": "level"},
        )
        engine = LocomotionEngine(load_robot(ROBOT), estimator=EstimatorSettings(level=level))
        run = drive(scenario, engine, Command())
        R = quaternion_rotation(run["body_orientation"].values)
        tilts[name] = float(np.degrees(np.arccos(np.clip(R[-25:, 2, 2], -1, 1)).mean()))
    return tilts | {"slope": slope_deg, "taken": 1 - tilts["level"] / tilts["parallel"]}


def draw(results: list[Case], path: str) -> None:
    """Draw the runs that passed over the size of each ground."""
    with styled():
        _draw(results, path)


def _draw(results: list[Case], path: str) -> None:
    from matplotlib.figure import Figure

    kinds = [kind for (kind,) in grouped(results, "kind")]
    modes = [mode for (mode,) in grouped(results, "mode")]
    rows = math.ceil(len(kinds) / COLUMNS)
    figure = Figure(figsize=(11, 3.1 * rows), layout="constrained")
    figure.get_layout_engine().set(w_pad=0.1, h_pad=0.1)
    panels = figure.subplots(rows, math.ceil(len(kinds) / rows), sharey=True, squeeze=False)
    for axes in panels.flat[len(kinds) :]:
        axes.remove()
    for axes, kind in zip(panels.flat, kinds, strict=False):
        runs = [run for run in results if run["kind"] == kind and "passed" in run]
        for (mode,), some in grouped(runs, "mode").items():
            sizes = grouped(some, "size")
            share = [100 * np.mean([run["passed"] for run in mine]) for mine in sizes.values()]
            style = {"without": ":s", "ground sensing": "--o", "dynamics": "-.v"}.get(mode, "-^")
            colour = RUN_COLOURS[modes.index(mode) % len(RUN_COLOURS)]
            at = [size for (size,) in sizes]
            axes.plot(at, share, style, label=mode, markersize=4, color=colour)
        axes.margins(x=0.06)
        title = kind.replace(" with ", "\nwith ")
        field, unit = GROUNDS[kind].field, GROUNDS[kind].unit
        words = (field.rpartition("_")[0] if unit else field).replace("_", " ")
        axes.set(title=title, xlabel=f"{words} [{unit}]" if unit else words, ylim=(-5, 105))
    for axes in panels[:, 0]:
        axes.set_ylabel("passed [%]")
    lines = figure.axes[0].get_lines()
    figure.legend(handles=lines, loc="outside lower center", ncols=len(lines))
    save_figure(figure, Path(path), dpi=100)
