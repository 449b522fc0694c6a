"""``phasmid advise``: do these servos hold, how warm do they get, how long, and which others do."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from phasmid.cli.number_option import number_within
from phasmid.cli.progress import progress_bar
from phasmid.cli.robot_options import add_import_options, import_options
from phasmid.errors import InfeasibleWalk, InvalidInput, plain

if TYPE_CHECKING:
    from phasmid.advice import Advice, ServoLoad
    from phasmid.scenario import Scenario

LONGEST = 120.0
"""Longest full simulation [min]."""

FIELDS = {
    "payload_g": ("G", "mass on the trunk"),
    "step_length_mm": ("MM", "way of the body in one step; default: 40"),
    "voltage": ("V", "supply; default: the rated voltage of the servo"),
    "ambient_temperature": ("DEGC", "air; default: 25"),
}
"""Unit and help of the scenario's fields that have an option."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("robot", metavar="ROBOT", help="a preset or a robot file")
    parser.add_argument("--gait", metavar="GAIT", help="default: the first of the leg count")
    parser.add_argument(
        "--speed-mm-s", metavar="MM/S", help="forward speed; default: by a cycle of 2 s"
    )
    for key, (unit, words) in FIELDS.items():
        parser.add_argument(f"--{key.replace('_', '-')}", metavar=unit, help=words)
    parser.add_argument("--servo", metavar="NAME", help="another servo; default: the robot's")
    parser.add_argument(
        "--battery-mah",
        metavar="MAH",
        default="2200",
        help="the battery; default: 2200",
    )
    parser.add_argument(
        "--simulate",
        metavar="MIN",
        help="also simulate so many minutes of walking, and compare",
    )
    parser.add_argument("--figure", metavar="FILE", help="draw torque and heat: svg, png or pdf")
    parser.add_argument("--force", action="store_true", help="replace an older figure")
    parser.add_argument("--json", action="store_true", help="print the numbers as JSON")
    add_import_options(parser)


def run(options: argparse.Namespace) -> int:
    """Print the advice, and return the exit status: 2 where the servos do not hold."""
    from phasmid.advice import advise

    figure = _figure_path(options)
    minutes = number_within("--simulate", options.simulate, 0.1, LONGEST)
    speed = number_within("--speed-mm-s", options.speed_mm_s, 0.1, 10_000)
    capacity = number_within("--battery-mah", options.battery_mah, 1, 1_000_000)
    assert capacity is not None
    try:
        advice = advise(
            _scenario(options),
            speed=None if speed is None else speed / 1000,
            capacity=capacity / 1000,
        )
    except InfeasibleWalk as error:
        error.hint = error.hint or "another --speed-mm-s, --step-length-mm or --gait"
        raise
    full = None if minutes is None else _simulate(advice, minutes)
    if options.json:
        found = advice.as_dict()
        if full is not None:
            found["simulation"] = _comparison(advice, full)
        print(json.dumps(found, indent=2, ensure_ascii=False))
    else:
        _print(advice)
        if full is not None:
            _print_comparison(advice, full)
    if figure is not None:
        from phasmid.advice.figure import advice_figure
        from phasmid.recording.file import write_whole
        from phasmid.reporting.style import encoded_figure

        write_whole(figure, encoded_figure(advice_figure(advice), figure.suffix[1:].lower()))
        if not options.json:
            print(f"Written to {plain(str(figure))}")
    if not advice.verdict.is_possible:
        what = f"the {advice.servo.name} does not hold it in the {advice.verdict.gait} gait."
        print(f"phasmid: {InvalidInput(what, hint='another --servo or --gait')}", file=sys.stderr)
        return 2
    return 0


def _figure_path(options: argparse.Namespace) -> Path | None:
    """Return the path of the figure, which can be written."""
    from phasmid.cli.plot import KINDS
    from phasmid.recording.file import check_new_file

    if options.figure is None:
        return None
    path = Path(options.figure)
    if path.suffix[1:].lower() not in KINDS:
        raise InvalidInput(
            f'--figure is "{plain(options.figure)}"; it must end in .{", .".join(KINDS)}.',
            hint="--figure advice.svg",
        )
    check_new_file(path, option="--figure FILE", force=options.force)
    return path


def _scenario(options: argparse.Namespace) -> Scenario:
    """Return the scenario of the options."""
    from dataclasses import replace

    from phasmid.cli.scenario_options import number_or_text
    from phasmid.formats import load_robot
    from phasmid.gait import gaits_of
    from phasmid.robot import load_servo
    from phasmid.scenario import Scenario
    from phasmid.tables import dotted

    robot = load_robot(options.robot, import_options(options))
    if options.servo is not None:
        robot = replace(robot, servo=load_servo(options.servo))
    fields: dict[str, Any] = {"robot": robot}
    gait = options.gait or next(iter(gaits_of(len(robot.legs))), None)
    if gait is not None:
        fields["gait"] = gait
    for key in FIELDS:
        if vars(options)[key] is not None:
            fields[key] = number_or_text(vars(options)[key])

    def locate(loc: tuple[str | int, ...]) -> tuple[str, str]:
        key = next((key for key in FIELDS if key.startswith(str(loc[-1]))), None)
        return f"--{key.replace('_', '-')}" if key else dotted(loc), ""

    return Scenario().changed(fields, locate)


def _simulate(advice: Advice, minutes: float) -> ServoLoad:
    """Simulate some minutes of the advice's walk."""
    from phasmid.advice import simulate_load
    from phasmid.advice.advice import plan_cycles

    period = advice.scenario.stride.period
    scenario, walk, _ = plan_cycles(
        advice.scenario.replace(max_steps=100_000_000, record_interval=None),
        cycles=60 * minutes / period,
    )
    with progress_bar("simulating", 60 * minutes, quiet=False) as progress:
        return simulate_load(scenario, walk, skip=period, progress=progress)


def _comparison(advice: Advice, full: ServoLoad) -> dict[str, Any]:
    """Return the numbers of a full simulation beside those of the advice, by joint."""
    minutes = (full.duration + advice.scenario.stride.period) / 60
    expected = advice.temperature(minutes)
    columns: dict[str, Any] = {
        "peak_torque": (full.peak_torque, advice.load.peak_torque),
        "rms_torque": (full.rms_torque, advice.load.rms_torque),
    }
    if full.temperature is not None and expected is not None:
        columns["temperature"] = full.temperature, expected[1]
    joints = {
        name: {key: [float(v.ravel()[i]) for v in pair] for key, pair in columns.items()}
        for i, name in enumerate(advice.joint_names)
    }
    return {"minutes": minutes, "failure": full.failure, "joints": joints}


def _print(advice: Advice) -> None:
    from phasmid.advice.advice import MEASURED, MINUTES, USABLE, WARM_UP

    scenario, verdict, load = advice.scenario, advice.verdict, advice.load
    air = scenario.servo.ambient_temperature
    print(
        f"{plain(advice.robot.name)}, {plain(verdict.servo)} at {advice.voltage:g} V, "
        f"{plain(verdict.gait)} gait, {1000 * advice.speed:.3g} mm/s, payload "
        f"{1000 * scenario.model.payload:g} g, air {air:g} °C"
    )
    law = "their own law" if load.heat is not None else "ideal servos: the stall current is unknown"
    print(f"{MEASURED} cycles after {WARM_UP}, simulated with {law}\n")
    warmth = [advice.temperature(minutes) for minutes in MINUTES]
    after = ", ".join(f"{minutes:g}" for minutes in MINUTES)
    heads = ["joint", "peak N·m", "of stall", "rms N·m", "of continuous"]
    if load.heat is not None:
        heads.append(f"°C after {after} min")
    rows = [heads]
    for i, name in enumerate(advice.joint_names):
        peak, rms = float(load.peak_torque.ravel()[i]), float(load.rms_torque.ravel()[i])
        row = [
            plain(name),
            f"{peak:.2f}",
            f"{100 * peak / verdict.stall_torque:.0f} %",
            f"{rms:.2f}",
            f"{100 * rms / verdict.continuous_torque:.0f} %",
        ]
        found = [f"{w[1].ravel()[i]:.0f}" for w in warmth if w is not None]
        rows.append(row + [", ".join(found)] * bool(found))
    _print_table(rows)
    if load.failure:
        print(f"\nthe simulated walk ended early: {plain(load.failure)}")
    _print_supply(advice, USABLE)
    print("\nWithout help from friction:")
    for line in verdict.lines:
        print(f"  {plain(line)}")
    _print_catalogue(advice)


def _print_supply(advice: Advice, usable: float) -> None:
    """Print the warmest servo, current and battery time."""
    hour, load = advice.temperature(60.0), advice.load
    if hour is None or load.supply_current is None or load.peak_supply_current is None:
        print("\nheat, current and battery time are unknown: the servo has no stall current.")
        return
    # The one that may become the warmest.
    warmest = int(hour[2].argmax())
    low, _, high = (float(rows.ravel()[warmest]) for rows in hour)
    print(
        f"\nwarmest after an hour: {plain(advice.joint_names[warmest])}, {low:.0f} to {high:.0f} "
        f"°C by assumed heat figures; limit {advice.servo.temperature_limit:g} °C"
    )
    print(
        f"current: {load.supply_current:.2f} A, at most {load.peak_supply_current:.2f} A, with "
        f"{1000 * advice.servo.standby_current:g} mA for each servo's electronics"
    )
    print(
        f"battery of {1000 * advice.capacity:g} mAh: {advice.battery_minutes:.0f} min on "
        f"{100 * usable:.0f} % of it, without the robot's computer"
    )


def _print_catalogue(advice: Advice) -> None:
    count = 3 * len(advice.robot.legs)
    print(f"\nOther servos, at their rated voltage, with prices of {count} (look them up):")
    rows = [["servo", "price", "lacks"]]
    for choice in advice.choices:
        price = "unknown" if choice.price is None else f"about ${choice.price:.0f}"
        rows.append([choice.servo.name, price, choice.lacks or "nothing"])
    _print_table(rows)
    if advice.cheapest is not None:
        print(f"Cheapest that holds: {advice.cheapest.servo.name}")
    else:
        print("None of them holds for an unlimited time.")


def _print_comparison(advice: Advice, full: ServoLoad) -> None:
    found = _comparison(advice, full)
    print(f"\nFull simulation of {found['minutes']:.3g} min, and the advice beside it:")
    if full.failure:
        print(f"it ended early: {plain(full.failure)}")
    heads = ["joint", "peak N·m", "rms N·m"]
    if full.temperature is not None:
        heads.append("°C")
    rows = [heads]
    for name, values in found["joints"].items():
        cells = [f"{a:.3f}, {b:.3f}" for key, (a, b) in values.items() if key != "temperature"]
        if "temperature" in values:
            cells.append("{:.1f}, {:.1f}".format(*values["temperature"]))
        rows.append([plain(name), *cells])
    _print_table(rows)


def _print_table(rows: list[list[str]]) -> None:
    """Print rows in aligned columns, the first one and the last one to the left."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = [cell.rjust(width) for cell, width in zip(row, widths, strict=True)]
        cells[0], cells[-1] = row[0].ljust(widths[0]), row[-1]
        print("  ".join(cells).rstrip())
