"""Walks over unknown ground, and a paired comparison of the passes of two versions of phasmid.

    python tools/ground.py --quick                        passes of this version
    python tools/ground.py --quick --against HEAD~1       compared with those of a commit
    python tools/ground.py --quick --against FILE.json    compared with passes kept by --write

A version with other passes on the same grounds and seeds walks differently; a sign test on the
pairs of runs says whether it walks better or worse. Exit status: 0 where it is not shown to be
worse, 1 where it is, 2 for bad arguments, 130 after Ctrl-C.

Only public functions of phasmid are used: --against COMMIT runs this file, as it is, with the
sources of that commit.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple, NoReturn

import numpy as np
from scipy.stats import binomtest

import phasmid
from phasmid.experiment import Command
from versions import ROOT, UserError, check_source, commit_of, run_of

# The walk -----------------------------------------------------------------------------------------

ROBOT, JOINTS = "phantomx-mk4", "ideal-servo"
"""Robot and drive of its joints: servos that are not the limit of what the controller can do."""

SPEED, PERIOD = 0.06, 1.3
"""Commanded forward velocity [m/s] and duration of a cycle of the tripod [s]."""

STEP_HEIGHT, HIGHER = 0.03, 0.05
"""Step height, and that for rough ground without sensing [m]."""

DISTANCE, LARGEST_DEVIATION, TIME_LIMIT = 0.6, 0.2, 20.0
"""Distance to walk [m], largest lateral deviation [m], time limit [s]; where a ground has another
distance, the lateral deviation is in proportion."""

LARGEST_TILT = math.radians(35)
"""Tilt relative to the slope of the ground above which a robot has fallen [rad]."""

CHECK_INTERVAL, LATE_SPEED_RATIO = 0.1, 1.2
"""Time between two checks [s]; multiple of the commanded velocity above which a robot that would
need it is late."""

RECORD_INTERVAL_MS = 20
"""Time between two samples [ms]; `CHECK_INTERVAL` is a multiple."""


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
NOISY = "with a lidar, all sensors noisy"
MODES = {
    "without": Mode({"ground_sensing": False, "dynamics": "none"}),
    "ground sensing": Mode({"ground_sensing": True, "dynamics": "none"}),
    "dynamics": Mode({"ground_sensing": False, "dynamics": "feed-forward"}),
    BLIND: Mode(SENSING),
    SEEING: Mode({**SENSING, "terrain_map": "points"}, {"depth": "lidar"}),
    NOISY: Mode(
        {**SENSING, "terrain_map": "points"},
        # Sensors read no more often than samples are recorded.
        {"depth": "lidar", "measured": "everything", "record_interval_ms": 10},
    ),
}


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
    fixed: Mapping[str, float]
    terrain: str
    step_height: float = STEP_HEIGHT
    distance: float = DISTANCE
    limit: float = TIME_LIMIT
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


def label(kind: str, size: float) -> str:
    """Return the name of a ground with its size."""
    name, joined, extra = kind.partition(" with ")
    words = f"{name} {size:g} {GROUNDS[kind].unit}{joined}{extra}"
    return words.replace(" °", "°").rstrip()


def scenario_of(
    kind: str, size: float, seed: int, robot: str | phasmid.Robot = ROBOT, joints: str = JOINTS
) -> phasmid.Scenario:
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
    return phasmid.Scenario().replace(
        robot=robot,
        drive=joints,
        duration=ground.limit,
        record_interval_ms=RECORD_INTERVAL_MS,
        terrain=terrain,
    )


def engine_of(
    robot: phasmid.Robot, kind: str, mode: str, step_height_ratio: float = 1.0
) -> phasmid.LocomotionEngine:
    """Return the engine of a mode with the step height of a ground, times a ratio."""
    step_height = step_height_ratio * GROUNDS[kind].step_height
    return phasmid.LocomotionEngine(
        robot, period=PERIOD, step_height=step_height, **MODES[mode].engine
    )


# The result of a walk -----------------------------------------------------------------------------


class Task(NamedTuple):
    """What a walk must achieve to pass.

    Attributes:
        distance: Distance to walk along x [m].
        limit: Time limit [s].
        tilt: Largest tilt of the body [rad].
    """

    distance: float
    limit: float
    tilt: float

    @property
    def lateral(self) -> float:
        """Largest lateral deviation [m]."""
        return LARGEST_DEVIATION * (self.distance / DISTANCE)


class Outcome(NamedTuple):
    """Result of a walk at the time at which it is decided.

    Attributes:
        why: Why it failed: ``fell``, ``astray`` or ``late``; empty if it passed.
        distance: Distance along x [m].
        lateral: Largest lateral deviation [m].
        tilt: Largest tilt [deg].
        time: Time of the decision [s].
    """

    why: str
    distance: float
    lateral: float
    tilt: float
    time: float


def task_of(kind: str, size: float) -> Task:
    """Return the task on a ground of a size."""
    ground = GROUNDS[kind]
    slope = math.radians(size) if kind == "slope" else 0.0
    return Task(ground.distance, ground.limit, LARGEST_TILT + slope)


def walk(
    scenario: phasmid.Scenario,
    controller: Any,
    task: Task,
    command: Command = Command(velocity=(SPEED, 0.0, 0.0)),  # noqa: B008, a frozen value
) -> tuple[Outcome, Any]:
    """Let a controller walk for the whole duration, and decide the result.

    No public function shows the true pose while a robot is driven, so that a decided run goes on.

    Returns:
        The outcome, and the recording up to the time at which it is decided.
    """
    run = phasmid.drive(scenario, controller, command)
    outcome = decide(run, task)
    return outcome, run.sel(time=slice(None, outcome.time + 1e-9))


def decide(run: Any, task: Task) -> Outcome:
    """Return the result of a recorded walk at the first check that decides it.

    Args:
        run: Recording of the whole duration; it is shorter only if the robot fell.
        task: The task.
    """
    clock, position = run["time"].values, run["body_position"].values
    _, qx, qy, _ = run["body_orientation"].values.T
    every = round(CHECK_INTERVAL / (clock[1] - clock[0])) if len(clock) > 1 else 1
    checks = np.arange(len(clock))[every::every]
    if not len(checks):
        return Outcome("fell", 0.0, 0.0, 0.0, float(clock[-1]))
    elapsed = clock[checks]
    x, y = (position[checks] - position[0])[:, :2].T
    lateral = np.maximum.accumulate(np.abs(y))
    # The body's z axis has the component 1 - 2 (qx² + qy²) along the world's.
    upright = 1 - 2 * (qx**2 + qy**2)[checks]
    tilt = np.maximum.accumulate(np.arccos(np.clip(upright, -1.0, 1.0)))
    conditions = {
        "fell": tilt > task.tilt,
        "astray": lateral > task.lateral,
        "": x >= task.distance,
        "late": task.distance - x > LATE_SPEED_RATIO * SPEED * (task.limit - elapsed),
    }
    decided = np.any(list(conditions.values()), axis=0)
    at, why = len(checks) - 1, "fell"
    if decided.any():
        at = int(np.argmax(decided))
        why = next(name for name, holds in conditions.items() if holds[at])
    values = x[at], lateral[at], math.degrees(tilt[at]), elapsed[at]
    return Outcome(why, *map(float, values))


# Runs of a version --------------------------------------------------------------------------------


class Cell(NamedTuple):
    """Ground, size and mode of runs that differ in their seeds only."""

    kind: str
    size: float
    mode: str


class Passes(NamedTuple):
    """Results of a version.

    Attributes:
        seeds: Seeds, N of them.
        results: Of each cell N letters of `LETTERS`, one for each seed.
    """

    seeds: list[int]
    results: dict[Cell, str]


REFUSED = "-"
"""Letter of a ground that phasmid refuses: some hills are too steep for the contact model."""

LETTERS = {"": "+", "fell": "f", "astray": "a", "late": "l", "refused": REFUSED}

CELLS = [
    Cell(kind, size, mode)
    for kind, ground in GROUNDS.items()
    for size in ground.sizes
    for mode in MODES
]

# Cells of docs/control.md on which 9 to 16 of 20 runs pass: near one half, most seeds are near the
# edge, so that a small change of the walk turns their results; 20 of 20 and 0 of 20 hardly change.
# With a lidar no cell is nearer to the edge than 18 of 20. Ground sensing makes up for much, such
# as low steps, so that a third of the cells have the feed-forward alone. Two versions walk over so
# many cells with ten seeds in 5 minutes on two cores.
QUICK = [
    Cell("blocks", 120, BLIND),
    Cell("stairs", 67, BLIND),
    Cell("beams", 60, BLIND),
    Cell("stepping stones", 120, BLIND),
    Cell("blocks", 120, "ground sensing"),
    Cell("blocks", 60, "dynamics"),
    Cell("stairs", 20, "dynamics"),
    Cell("gap", 30, "dynamics"),
    Cell("slope", 15, "dynamics"),
    Cell("rubble", 40, "without"),
    Cell("beams", 60, SEEING),
    Cell("stepping stones", 200, NOISY),
]


def measure(cell: Cell, seed: int, step_height_ratio: float = 1.0) -> Outcome:
    """Walk over one ground.

    Raises:
        InvalidInput: phasmid refuses the ground.
    """
    scenario = scenario_of(cell.kind, cell.size, seed).replace(**MODES[cell.mode].scenario)
    engine = engine_of(phasmid.load_robot(ROBOT), cell.kind, cell.mode, step_height_ratio)
    return walk(scenario, engine, task_of(cell.kind, cell.size))[0]


def letter(case: tuple[Cell, int], step_height_ratio: float) -> str:
    """Return the result of a cell and seed as a letter of `LETTERS`."""
    try:
        return LETTERS[measure(*case, step_height_ratio).why]
    except phasmid.InvalidInput:
        return REFUSED


def measure_all(
    cells: Sequence[Cell], seeds: list[int], processes: int, step_height_ratio: float = 1.0
) -> Passes:
    """Walk over every cell with every seed, some runs at a time."""
    cases = [(cell, seed) for cell in cells for seed in seeds]
    # Each run has one core; threads of linear algebra would occupy the others.
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
    letters = ""
    # Ctrl-C ends the program, not each of its runs.
    ignore = signal.signal, (signal.SIGINT, signal.SIG_IGN)
    with ProcessPoolExecutor(processes, get_context("spawn"), *ignore) as pool:
        try:
            for result in pool.map(partial(letter, step_height_ratio=step_height_ratio), cases):
                letters += result
                if len(letters) % 20 == 0:
                    print(f"  {len(letters)} of {len(cases)} runs", file=sys.stderr, flush=True)
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    count = len(seeds)
    return Passes(
        seeds, {cell: letters[k * count : (k + 1) * count] for k, cell in enumerate(cells)}
    )


def save(passes: Passes, path: Path) -> None:
    """Write passes as JSON, a line for each cell."""
    lines = ",\n".join(
        json.dumps([*cell, letters], ensure_ascii=False) for cell, letters in passes.results.items()
    )
    path.write_text(f'{{"seeds": {passes.seeds},\n"results": [\n{lines}\n]}}\n', "utf-8")


def load(path: Path) -> Passes:
    """Read passes.

    Raises:
        UserError: The file was not written by `save`.
    """
    try:
        content = json.loads(path.read_text("utf-8"))
        seeds = [int(seed) for seed in content["seeds"]]
        results = {
            Cell(str(kind), float(size), str(mode)): str(letters)
            for kind, size, mode, letters in content["results"]
        }
    except (OSError, ValueError, KeyError, TypeError):
        raise UserError(f"{path} holds no passes; write some with --write.") from None
    allowed = set(LETTERS.values())
    if any(len(each) != len(seeds) or set(each) - allowed for each in results.values()):
        raise UserError(f"{path} is damaged: a cell has not one result for each seed.")
    return Passes(seeds, results)


# Comparison ---------------------------------------------------------------------------------------

SIGNIFICANCE = 0.05
"""Probability below which a difference is shown: the usual one chance in twenty."""


class Row(NamedTuple):
    """Pairs of a cell.

    Attributes:
        cell: The cell.
        pairs: Number of pairs.
        ours: Passes of this version.
        theirs: Passes of the other one.
        won: Pairs that only this version passes.
        lost: Pairs that only the other one passes.
    """

    cell: Cell
    pairs: int
    ours: int
    theirs: int
    won: int
    lost: int


def seed_pairs(ours: Sequence[int], theirs: Sequence[int]) -> list[tuple[int, int]]:
    """Return the places of seeds that make a pair: equal seeds, or in order if none are equal."""
    places = {seed: place for place, seed in enumerate(theirs)}
    equal = [(place, places[seed]) for place, seed in enumerate(ours) if seed in places]
    return equal or [(place, place) for place in range(min(len(ours), len(theirs)))]


def compare(ours: Passes, theirs: Passes) -> list[Row]:
    """Return the pairs of every cell that both have."""
    places, rows = seed_pairs(ours.seeds, theirs.seeds), []
    for cell, mine in ours.results.items():
        other = theirs.results.get(cell, "")
        counts = Counter(
            (mine[i] == "+", other[j] == "+")
            for i, j in places
            # What only one version refuses it does not pass.
            if other and not mine[i] == other[j] == REFUSED
        )
        both, won, lost = counts[True, True], counts[True, False], counts[False, True]
        if counts:
            rows.append(Row(cell, counts.total(), both + won, both + lost, won, lost))
    return rows


def sign_test(won: int, lost: int) -> float:
    """Return the probability of pairs as unequal as these if neither version is better.

    Exact and two-sided: each discordant pair is won or lost with probability 1/2, independently.
    Grounds of one seed are alike in all cells, which makes their pairs dependent: a little with
    equal seeds, more where the seeds of the two versions differ.
    """
    return float(binomtest(lost, won + lost).pvalue) if won + lost else 1.0


def smallest_loss(won: int, pairs: int) -> int | None:
    """Return the least number of lost pairs that is shown, beside those won; None: too few."""
    shown = (n for n in range(won + 1, pairs - won + 1) if sign_test(won, n) < SIGNIFICANCE)
    return next(shown, None)


def report(rows: Sequence[Row], same_grounds: bool) -> tuple[str, bool]:
    """Return table and verdict, and whether this version is worse."""
    lines = [f"{'ground':<34}{'mode':<32} pairs  ours  theirs  won  lost"]
    lines += [
        f"{label(row.cell.kind, row.cell.size):<34}{row.cell.mode:<32} {row.pairs:>5} "
        f"{row.ours:>5} {row.theirs:>7} {row.won:>4} {row.lost:>5}"
        for row in rows
    ]
    pairs, ours, theirs, won, lost = (sum(column) for column in list(zip(*rows, strict=True))[1:])
    lines.append(f"{'all':<66} {pairs:>5} {ours:>5} {theirs:>7} {won:>4} {lost:>5}\n")
    if not same_grounds:
        # Of random halves of 20 seeds of one version, 9 % differ at p < 0.05.
        lines.append(
            "The seeds differ: the runs of a pair are not on the same ground. Start and direction "
            "of a seed are the same in all cells, so that p is too small."
        )
    p = sign_test(won, lost)
    if p < SIGNIFICANCE:
        lines.append(f"Verdict: {'worse' if lost > won else 'better'} (p = {p:.2g}).")
        return "\n".join(lines), lost > won
    lines.append(f"Verdict: no difference shown (p = {p:.2g}).")
    least = smallest_loss(won, pairs)
    shown = f"no loss could be shown by {pairs} pairs"
    if least is not None:
        net = least - won
        shown = (
            f"with {won} pairs won, the smallest loss that {pairs} pairs could show is {least} "
            f"pairs lost, {net} passes fewer ({100 * net / pairs:.1f} %)"
        )
    lines.append(f"That is not equality: {shown}.")
    return "\n".join(lines), False


# Another version ----------------------------------------------------------------------------------


def passes_of(commit: str, arguments: Sequence[str]) -> Passes:
    """Run this file in a worktree of a commit, and return its passes.

    Args:
        commit: Full name of the commit.
        arguments: Arguments that choose seeds, cells and processes.

    Raises:
        UserError: The worktree, its environment or its runs fail.
    """
    python, environment = run_of(commit)
    with TemporaryDirectory() as folder:
        file = Path(folder) / "passes.json"
        command = [python, str(Path(__file__).resolve()), *arguments, "--write", str(file)]
        # Unlike subprocess.run this does not kill the program after Ctrl-C, which stops its runs.
        with subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL) as program:
            status = program.wait()
        if status:
            raise UserError(f"the runs of {commit} fail with status {status}.")
        return load(file)


# Command line -------------------------------------------------------------------------------------


class Parser(argparse.ArgumentParser):
    """Parser whose errors are one sentence."""

    def error(self, message: str) -> NoReturn:
        """Print the sentence and exit with status 2."""
        self.exit(2, f"{message}\n")


def seeds_from(text: str) -> list[int]:
    """Return the seeds of a text such as ``0-9`` or ``0-4,7``."""
    seeds: list[int] = []
    for part in text.split(","):
        first, _, last = part.partition("-")
        if not (first.isdecimal() and (last or first).isdecimal()):
            raise argparse.ArgumentTypeError(f"{text!r} names no seeds; try 0-9 or 0-4,7")
        seeds += range(int(first), int(last or first) + 1)
    if not seeds or len(set(seeds)) < len(seeds):
        raise argparse.ArgumentTypeError(f"{text!r} names no seed, or one twice; try 0-9")
    return seeds


def positive(text: str) -> float:
    """Return a finite number greater than 0."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0):
        raise argparse.ArgumentTypeError(f"{text!r} is not a finite number greater than 0")
    return value


def whole_number(text: str) -> int:
    """Return a whole number from 1."""
    if not (text.isdecimal() and int(text) > 0):
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 1")
    return int(text)


def arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    """Return the options of the command line."""
    parser = Parser(description=__doc__.splitlines()[0])
    option = parser.add_argument
    option("--seeds", type=seeds_from, default="0-9", help="such as 0-9 or 0-4,7")
    option("--grounds", help=f"with commas between: {', '.join(GROUNDS)}")
    option("--modes", nargs="+", choices=MODES, metavar="MODE", help="; ".join(MODES))
    option("--quick", action="store_true", help=f"only {len(QUICK)} cells, near the edge")
    option("--against", metavar="COMMIT|FILE", help="what the passes are compared with")
    option("--write", type=Path, metavar="FILE", help="keep the passes of this version")
    option("--processes", type=whole_number, default=os.cpu_count() or 1, help="runs at a time")
    option(
        "--step-height-ratio",
        type=positive,
        default=1.0,
        help="change the step height of this version alone, to prove that a loss is found",
    )
    options = parser.parse_args(argv)
    chosen = options.grounds.split(",") if options.grounds else list(GROUNDS)
    if unknown := set(chosen) - set(GROUNDS):
        known = ", ".join(GROUNDS)
        parser.error(f"--grounds knows {known}, not {', '.join(sorted(unknown))}.")
    options.cells = [
        cell
        for cell in (QUICK if options.quick else CELLS)
        if cell.kind in chosen and cell.mode in (options.modes or MODES)
    ]
    if not options.cells:
        parser.error("--quick has no cell of these grounds and modes.")
    return options


def repeated(options: argparse.Namespace) -> list[str]:
    """Return the arguments with which another version makes the same runs."""
    texts = ["--seeds", ",".join(map(str, options.seeds)), "--processes", str(options.processes)]
    texts += ["--quick"] if options.quick else []
    texts += ["--grounds", options.grounds] if options.grounds else []
    return texts + (["--modes", *options.modes] if options.modes else [])


def main(argv: Sequence[str] | None = None) -> int:
    """Measure, compare, print and return the exit status."""
    options = arguments(argv)
    try:
        return run(options)
    except (UserError, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("stopped.", file=sys.stderr)
        return 130


def run(options: argparse.Namespace) -> int:
    """Measure, compare and print.

    Raises:
        UserError: There is no other version, or it cannot be run.
    """
    theirs, began = None, time.perf_counter()
    if options.write:
        # A file that cannot be written is refused before the runs.
        options.write.parent.mkdir(parents=True, exist_ok=True)
        options.write.touch()
    if options.against and Path(options.against).is_file():
        theirs = load(Path(options.against))
    elif options.against:
        commit = commit_of(options.against)
        check_source(sys.executable, ROOT, dict(os.environ))
        theirs = passes_of(commit, repeated(options))
        print(f"theirs: {time.perf_counter() - began:.0f} s", file=sys.stderr, flush=True)
    common = [cell for cell in options.cells if theirs is None or cell in theirs.results]
    if not common:
        raise UserError(f"{options.against} has none of these grounds and modes.")
    ours = measure_all(common, options.seeds, options.processes, options.step_height_ratio)
    if options.write:
        save(ours, options.write)
    # Without another version the table shows this one beside itself.
    rows = compare(ours, theirs or ours)
    took = f"{time.perf_counter() - began:.0f} s with {options.processes} processes"
    if theirs is None:
        print_passes(ours.results.items())
        print(took)
        return 0
    if not rows:
        raise UserError("no pair can be compared: phasmid refuses these grounds.")
    text, worse = report(rows, bool(set(ours.seeds) & set(theirs.seeds)))
    if len(common) < len(options.cells):
        print(f"{len(options.cells) - len(common)} cells are not in {options.against}.")
    print(f"{text}\n{took}")
    return int(worse)


def print_passes(results: Iterable[tuple[Cell, str]]) -> None:
    """Print passes and failures of each cell."""
    names = {mark: why for why, mark in LETTERS.items() if why}
    for cell, letters in results:
        counts = Counter(letters)
        failed = ", ".join(f"{counts[mark]} {why}" for mark, why in names.items() if counts[mark])
        passes = f"{counts['+']:>3} of {len(letters)}"
        print(f"{label(cell.kind, cell.size):<34}{cell.mode:<32} {passes}  {failed}".rstrip())


if __name__ == "__main__":
    sys.exit(main())
