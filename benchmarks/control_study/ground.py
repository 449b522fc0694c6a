"""Walks over unknown ground, with ground sensing and dynamics and without."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from phasmid.control import Command, Controller, EngineSettings, LocomotionEngine
from phasmid.control.estimation import EstimatorSettings
from phasmid.errors import InvalidInput
from phasmid.kinematics import quaternion_rotation
from phasmid.reporting.style import RUN_COLOURS, save_figure, styled
from phasmid.robot import Robot, load_robot, load_servo
from phasmid.scenario import Scenario
from phasmid.simulation import drive
from phasmid.simulation.closed_loop import ClosedLoopRun
from phasmid.simulation.faults import Faults
from phasmid.simulation.run import Keep
from phasmid.simulation.start import standing

from .study import Case, grouped, markdown

ROBOT, DRIVE = "phantomx-mk4", "ideal-servo"
SPEED, PERIOD, STEP_HEIGHT = 0.06, 1.3, EngineSettings().step_height
"""Commanded forward velocity [m/s], duration of a cycle of the tripod [s], step height [m]."""

RATE = 1 / EngineSettings().update_period
"""Updates of a controller per second."""

DISTANCE, ASTRAY, LIMIT = 0.6, 0.2, 20.0
"""Distance to walk [m], largest lateral deviation [m], time limit [s]; where a ground has another
distance, the lateral deviation is in proportion."""

TIPPED = math.radians(35)
"""Tilt relative to the slope of the ground above which a robot has fallen [rad]."""

LOOK, FASTEST = 0.1, 1.2
"""Time between two checks [s]; multiple of the commanded velocity above which a robot that would
need it is late."""


class Mode(NamedTuple):
    """A way of walking.

    Attributes:
        engine: Settings of the locomotion engine.
        scenario: Fields of the scenario.
    """

    engine: dict[str, Any]
    scenario: dict[str, Any] = {}


SENSING = {"ground_sensing": True, "dynamics": "feed-forward"}
BLIND, SEEING = "ground sensing and dynamics", "with a lidar"
MODES = {
    "without": Mode({"ground_sensing": False, "dynamics": "none"}),
    "ground sensing": Mode({"ground_sensing": True, "dynamics": "none"}),
    "dynamics": Mode({"ground_sensing": False, "dynamics": "feed-forward"}),
    BLIND: Mode(SENSING),
    SEEING: Mode({**SENSING, "terrain_map": "points"}, {"depth": "lidar"}),
    "with a lidar, all sensors noisy": Mode(
        {**SENSING, "terrain_map": "points"},
        # Sensors read no more often than samples are recorded.
        {"depth": "lidar", "measured": "everything", "record_interval_ms": 10},
    ),
}

JOINTS = {"ideal": "ideal-servo", "AX-12A": "servo"}
"""Drives of the joints; AX-12A servos replace the robot's own."""

HIGHER = 0.05
"""Step height for rough ground without sensing [m]."""

COLUMNS = 6
"""Most panels in a row of the figure."""


class Ground(NamedTuple):
    """A kind of ground.

    Attributes:
        field: Field of a scenario's terrain with the size.
        sizes: Sizes.
        unit: Unit of the sizes; empty for plain numbers.
        fixed: Other fields of the terrain.
        terrain: Kind of the terrain in a scenario.
        step_height: Step height of the walk [m].
        distance: Distance to walk [m].
        limit: Time limit [s].
        edges: Function of size and start [mm] that returns the fields of a terrain of kind
            ``steps``, in place of `field`.
    """

    field: str
    sizes: tuple[float, ...]
    unit: str
    fixed: dict[str, float]
    terrain: str
    step_height: float = STEP_HEIGHT
    distance: float = DISTANCE
    limit: float = LIMIT
    edges: Callable[[float, float], dict[str, Any]] | None = None


def up_and_down(rise: float, start: float) -> dict[str, Any]:
    """Return two stairs up to a plateau of 300 mm and two down, 150 mm deep, all in mm."""
    return {
        "edge_x_mm": [start + x for x in (0, 150, 450, 600)],
        "edge_z_mm": [rise, 2 * rise, rise, 0],
    }


BLOCKS, HIGH = {"block_size_mm": 100}, f"blocks with steps of {1000 * HIGHER:.0f} mm"
GROUNDS = {
    "blocks": Ground("block_height_mm", (10, 20, 30, 40, 60, 80, 100, 120), "mm", BLOCKS, "blocks"),
    HIGH: Ground("block_height_mm", (40, 60, 80, 100), "mm", BLOCKS, "blocks", HIGHER),
    "hills": Ground("roughness_mm", (5, 10, 15, 20), "mm", {"rough_length_mm": 300}, "rough"),
    "slope": Ground("slope_deg", (5, 10, 15, 20, 25), "°", {}, "slope"),
    "stairs": Ground("rise_mm", (20, 40, 60, 67), "mm", {"run_mm": 150}, "stairs"),
    "gap": Ground("gap_width_mm", (30, 60), "mm", {"gap_depth_mm": 100}, "gap"),
    "stairs up and down": Ground(
        "rise_mm", (20, 40), "mm", {}, "steps", distance=1.2, limit=40.0, edges=up_and_down
    ),
    "rubble": Ground("block_height_mm", (40, 60, 80), "mm", {"block_size_mm": 50}, "blocks"),
    "beams": Ground(
        "beam_height_mm",
        (20, 40, 60),
        "mm",
        {"beam_width_mm": 50, "beam_distance_mm": 300},
        "beams",
    ),
    "stepping stones": Ground(
        "stone_distance_mm",
        (120, 160, 200),
        "mm",
        {"stone_size_mm": 100, "block_height_mm": 20, "gap_depth_mm": 100},
        "stepping-stones",
    ),
    "course": Ground("course_level", (0.5, 1.0), "", {}, "course", distance=3.0, limit=100.0),
}


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
        for joints in JOINTS
        for mode in (BLIND, SEEING)
        for seed in HELD_OUT_SEEDS[:seeds]
    ]


def robot_with(joints: str) -> Robot:
    """Return the robot with its own servos, or with those of `JOINTS` in their place."""
    robot = load_robot(ROBOT)
    return replace(robot, servo=load_servo(joints)) if joints == "AX-12A" else robot


def scenario_of(
    kind: str, size: float, seed: int, robot: str | Robot = ROBOT, joints: str = DRIVE
) -> Scenario:
    """Return the scenario of a ground and seed, for a robot with a drive of its joints."""
    ground, rng = GROUNDS[kind], np.random.default_rng([seed, 77])
    # The robot starts on level ground, and meets the terrain at an angle.
    yaw, start = float(rng.uniform(-20, 20)), float(rng.uniform(220, 320))
    terrain = {
        "kind": ground.terrain,
        **(ground.edges(size, start) if ground.edges else {ground.field: size}),
        **ground.fixed,
        "planned_on": "level",
        "terrain_seed": seed + 1,
        "terrain_yaw_deg": yaw,
        "terrain_start_mm": start,
    }
    return Scenario().replace(
        robot=robot, drive=joints, duration=ground.limit, record_interval_ms=20, terrain=terrain
    )


def measure(kind: str, size: float, mode: str, seed: int, joints: str = "ideal") -> Case:
    """Walk over one ground until the result is decided."""
    robot = robot_with(joints)
    try:
        scenario = scenario_of(kind, size, seed, robot, JOINTS[joints])
        scenario = scenario.replace(**MODES[mode].scenario)
    except InvalidInput as error:
        # Hills of some seeds are steeper than the contact is verified for.
        return {"refused": str(error)}
    return walk_over(scenario, robot, engine_of(robot, kind, mode), kind, size)


def engine_of(robot: Robot, kind: str, mode: str) -> LocomotionEngine:
    """Return the engine of a mode with the step height of a ground."""
    settings = EngineSettings(
        period=PERIOD,
        step_height=GROUNDS[kind].step_height,
        estimator=EstimatorSettings(),
        **MODES[mode].engine,
    )
    return LocomotionEngine(robot, settings)


def walk_over(
    scenario: Scenario,
    robot: Robot,
    controller: Controller,
    kind: str,
    size: float,
    keep: Keep = lambda rows: None,
    lost: frozenset[int] = frozenset(),
    distance: float | None = None,
) -> Case:
    """Let a controller walk over a ground until the result is decided.

    `keep` gets the samples; `lost` are the numbers of legs that are not used; `distance` is that of
    the ground where it is None.
    """
    command = Command(velocity=(SPEED, 0.0, 0.0), lost_legs=lost)
    run = ClosedLoopRun(
        scenario,
        standing(scenario, robot, None),
        controller,
        command,
        rate=RATE,
        faults=Faults(robot, (), scenario.sensors.contact_threshold),
    )
    ground = GROUNDS[kind]
    distance = ground.distance if distance is None else distance
    astray = ASTRAY * (distance / DISTANCE)
    start, tilt, aside, why = run.data.qpos[:2].copy(), 0.0, 0.0, "late"
    allowed = TIPPED + (math.radians(size) if kind == "slope" else 0.0)
    look = round(LOOK / run.dt)
    while run.step < run.steps:
        failure = run.advance(keep=keep, until=run.step + look)
        x, y = run.data.qpos[:2] - start
        R = quaternion_rotation(run.data.qpos[3:7])
        tilt = max(tilt, math.acos(min(max(R[2, 2], -1.0), 1.0)))
        aside = max(aside, abs(float(y)))
        if failure or tilt > allowed:
            why = "fell"
            break
        if aside > astray:
            why = "astray"
            break
        if x >= distance:
            why = ""
            break
        if distance - x > FASTEST * SPEED * (ground.limit - run.step * run.dt):
            break
    return {
        "passed": not why,
        "why": why,
        "way": float(x),
        "aside": aside,
        "tilt": math.degrees(tilt),
        "time": run.step * run.dt,
    }


def label(kind: str, size: float) -> str:
    """Return the name of a ground with its size."""
    name, joined, extra = kind.partition(" with ")
    words = f"{name} {size:g} {GROUNDS[kind].unit}{joined}{extra}"
    return words.replace(" °", "°").rstrip()


def table_of_hardest(results: list[Case]) -> str:
    """Return the table of the runs on the hardest grounds, by mode and servo."""
    columns = [(mode, joints) for joints in JOINTS for mode in (BLIND, SEEING)]
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
            drive=DRIVE,
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
