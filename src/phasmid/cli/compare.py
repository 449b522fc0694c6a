"""``phasmid identify --compare``: a robot's log beside its replay in simulation."""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import asdict
from pathlib import Path

from phasmid.cli.figures import run_name, write_figure
from phasmid.cli.output import print_table, say
from phasmid.cli.progress import progress_bar
from phasmid.cli.report import print_damage
from phasmid.errors import InvalidInput, plain
from phasmid.formats import load_robot
from phasmid.identification import Comparison, Quantity, compare
from phasmid.identification.replay_fit import REPLAYS
from phasmid.recording import load_recording
from phasmid.recording.file import check_new_file, write_whole
from phasmid.scenario import Scenario, load_scenario, recorded_scenario
from phasmid.servo.words import servo_label

SHOWN = {
    "s": ("ms", 1e3),
    "rad": ("°", 180 / math.pi),
    "m": ("mm", 1e3),
    "rad/s": ("°/s", 180 / math.pi),
    "rad/(N·m)": ("°/N·m", 180 / math.pi),
    "N·m": ("mN·m", 1e3),
}
"""Units in which SI units are printed, and factors to them."""


def compare_log(options: argparse.Namespace) -> int:
    """Compare a log with the replay of its joint targets, and return the exit status."""
    if len(options.logs) > 1:
        raise InvalidInput(f"--compare takes one log; {len(options.logs)} were given.")
    path = Path(options.logs[0])
    folder = Path(options.out or Path("results") / f"{run_name(path)}_compare")
    files = {name: folder / f"{name}.svg" for name in ("angles", "errors", "spectrum")}
    numbers = folder / "comparison.json"
    for file in (*files.values(), numbers):
        check_new_file(file, option="--out DIR", force=options.force)
    with progress_bar("comparing", REPLAYS, quiet=options.quiet) as progress, print_damage():
        found = compare(path, _scenario(options, path), progress=progress)
    from phasmid.identification.comparison_figures import comparison_figures

    for name, figure in comparison_figures(found).items():
        write_figure(figure, [files[name]])
    _write_numbers(found, numbers)
    if not options.quiet:
        _print(found)
        written = ", ".join([numbers.name, *(file.name for file in files.values())])
        say(f"\nWritten to {plain(str(folder))}/: {written}")
    return 0


def _scenario(options: argparse.Namespace, path: Path) -> Scenario | None:
    """Return the scenario of the options; None: that of the recording."""
    is_table = path.suffix.lower() == ".csv" and path.exists()
    if is_table and options.scenario is options.robot is None:
        raise InvalidInput(
            f"{plain(path.name)} does not name its robot.", hint="--robot phantomx-ax"
        )
    if options.scenario is options.robot is options.servo is None:
        return None
    robot = None if options.robot is None else load_robot(options.robot)
    if options.scenario is None and path.suffix.lower() == ".csv":
        scenario = load_scenario("paper")
        scenario = scenario if robot is None else scenario.for_robot(robot)
    else:
        if options.scenario is not None:
            scenario = load_scenario(options.scenario)
        else:
            scenario = recorded_scenario(load_recording(path).attrs)
        scenario = scenario if robot is None else scenario.replace(robot=robot)
    return scenario if options.servo is None else scenario.replace(servo=options.servo)


def _write_numbers(found: Comparison, path: Path) -> None:
    """Write all quantities in SI."""
    table = {
        "log": found.log.name,
        "robot": found.robot.name,
        "error_rad": found.error,
        "error_with_fitted_servo_rad": found.rest,
        "unexplained_share": found.rest_share,
        "quantities": [asdict(each) for each in found.quantities],
        "sentence": found.sentence,
    }
    write_whole(path, (json.dumps(table, indent=2, ensure_ascii=False) + "\n").encode())


def _print(found: Comparison) -> None:
    duration = float(found.log.time[-1])
    say(
        f"{plain(found.log.name)}: {duration:.3g} s of {plain(found.robot.name)}, "
        f"{plain(servo_label(found.robot.servo.name))}"
    )
    say(
        f"rms error of the joint angles: {math.degrees(found.error):.2g}°, "
        f"{math.degrees(found.rest):.2g}° with the fitted servo\n"
    )
    rows = [["quantity", "robot", "simulation", "difference, 95 %", "of error"]]
    rows += [_row(each) for each in found.quantities]
    if found.rest_share is not None:
        rows.append(["unexplained", "", "", "", _percent(found.rest_share)])
    print_table(rows, right=(1, 2, 3, 4))
    say(f"\n{found.sentence}")


def _row(quantity: Quantity) -> list[str]:
    """Return the cells of a quantity, rounded to about two digits of its interval."""
    unit, factor = SHOWN.get(quantity.unit, (quantity.unit, 1.0))
    half = 0.0
    if quantity.interval is not None:
        half = factor * (quantity.interval[1] - quantity.interval[0]) / 2
    robot = factor * quantity.robot
    size = max(half, abs(robot) / 1000, 1e-3)
    digits = min(3, max(0, 1 - math.floor(math.log10(size))))

    def shown(value: float | None, form: str = "") -> str:
        if value is None:
            return ""
        # Adding zero turns a rounded -0 into 0.
        return f"{round(factor * value, digits) + 0.0:{form}.{digits}f}"

    return [
        f"{quantity.name} [{unit}]",
        shown(quantity.robot),
        shown(quantity.simulation),
        f"{shown(quantity.difference, '+')} ± {half:.{digits}f}".strip(),
        "" if quantity.share is None else _percent(quantity.share),
    ]


def _percent(share: float) -> str:
    return f"{round(100 * share) + 0} %"
