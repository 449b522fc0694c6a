"""``phasmid advise``: do these servos hold, how warm do they get, how long, and which others do."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from phasmid.advice import Advice, advise
from phasmid.advice.advice import MEASURED, MINUTES, USABLE, WARM_UP
from phasmid.cli.figures import check_figure_path, write_figure
from phasmid.cli.options import Number
from phasmid.cli.output import print_table, say
from phasmid.cli.scenario_options import SCENARIO, print_idle, scenario_of, scenario_options
from phasmid.errors import InfeasibleWalk, InvalidInput, plain
from phasmid.servo.words import servo_label

OPTIONS = {
    "--speed-mm-s MM/S": Number("forward speed; default: by the period", 0.1, 10_000),
    "--battery-mah MAH": Number("capacity of the battery; default: 2200", 1, 1_000_000, 2200),
    "--out FILE": "draw torque and heat: svg, png or pdf",
    "--force": "replace an older figure",
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.set_defaults(quiet=False)
    scenario_options(parser, SCENARIO.format("phantomx-paper"))


def run(options: argparse.Namespace) -> int:
    """Print the advice, and return the exit status: 2 where the servos do not hold."""
    figure = None if options.out is None else Path(options.out)
    if figure is not None:
        check_figure_path("--out", figure, force=options.force)
    speed = None if options.speed_mm_s is None else options.speed_mm_s / 1000
    scenario = scenario_of(options, default=None)
    print_idle(scenario.driven(), options, "the advice on servos")
    try:
        advice = advise(scenario, speed=speed, capacity=options.battery_mah / 1000)
    except InfeasibleWalk as error:
        error.hint = error.hint or "another --speed-mm-s, --step-length-mm or --gait"
        raise
    _print(advice)
    if figure is not None:
        from phasmid.reporting.advice_figure import advice_figure

        write_figure(advice_figure(advice), [figure])
        say(f"Written to {plain(str(figure))}")
    if not advice.verdict.is_possible:
        servo = servo_label(advice.servo.name)
        what = f"the {servo} does not hold it in the {advice.verdict.gait} gait."
        say(f"phasmid: {InvalidInput(what, hint='another --servo or --gait')}", file=sys.stderr)
        return 2
    return 0


def _print(advice: Advice) -> None:
    experiment, verdict, load = advice.experiment, advice.verdict, advice.load
    air = advice.servo.ambient_temperature
    say(
        f"{plain(advice.robot.name)}, {plain(servo_label(verdict.servo))} at {advice.voltage:g} V, "
        f"{plain(verdict.gait)} gait, {1000 * advice.speed:.3g} mm/s, payload "
        f"{1000 * experiment.payload:g} g, air {air:g} °C"
    )
    law = "their own law" if load.heat is not None else f"ideal servos: {_unknown(advice)}"
    say(f"{MEASURED} cycles after {WARM_UP}, simulated with {law}\n")
    warmth = [rows for rows in map(advice.temperature, MINUTES) if rows is not None]
    rows = [["joint", "peak N·m", "of stall", "rms N·m", "of continuous"]]
    if warmth:
        rows[0].append(f"°C, {'/'.join(f'{minutes:g}' for minutes in MINUTES)} min")
    arrays, servo = advice.robot.arrays, advice.servo
    stall = arrays.stall_torque.ravel()
    continuous = arrays.strength.ravel() * min(servo.continuous_torque, servo.stall_torque)
    for i, name in enumerate(advice.joint_names):
        peak, rms = float(load.peak_torque.ravel()[i]), float(load.rms_torque.ravel()[i])
        row = [
            plain(name),
            f"{peak:.2f}",
            f"{100 * peak / stall[i]:.0f} %",
            f"{rms:.2f}",
        ]
        row.append(f"{100 * rms / continuous[i]:.0f} %")
        if warmth:
            row.append(", ".join(f"{estimates[1].ravel()[i]:.0f}" for estimates in warmth))
        rows.append(row)
    print_table(rows, right=(1, 2, 3, 4))
    if load.failure:
        say(f"\nthe simulated walk ended early: {plain(load.failure)}")
    _print_supply(advice)
    say("\nWithout help from friction:")
    for line in verdict.lines:
        say(f"  {plain(line)}")
    _print_catalogue(advice)


def _unknown(advice: Advice) -> str:
    """Return why the servos' own law is not simulated."""
    if advice.servo.stall_current is None:
        return "the servo has no stall current"
    if not advice.robot.has_equal_servos:
        return "the servos of the joints differ"
    return f'the drive is "{advice.experiment.solver.drive}"'


def _print_supply(advice: Advice) -> None:
    """Print the warmest servo, current and battery time."""
    hour, load = advice.temperature(60.0), advice.load
    if hour is None or load.supply_current is None or load.peak_supply_current is None:
        say(f"\nheat, current and battery time are unknown: {_unknown(advice)}.")
        return
    # The one that may become the warmest.
    warmest = int(hour[2].argmax())
    low, _, high = (float(rows.ravel()[warmest]) for rows in hour)
    say(
        f"\nwarmest after an hour: {plain(advice.joint_names[warmest])}, {low:.0f} to {high:.0f} "
        f"°C by assumed heat figures; limit {advice.servo.temperature_limit:g} °C"
    )
    say(
        f"current: {load.supply_current:.2f} A, at most {load.peak_supply_current:.2f} A, with "
        f"{1000 * advice.servo.standby_current:g} mA for each servo's electronics"
    )
    say(
        f"battery of {1000 * advice.capacity:g} mAh: {advice.battery_minutes:.0f} min on "
        f"{100 * USABLE:.0f} % of it, without the robot's computer"
    )


def _print_catalogue(advice: Advice) -> None:
    count = 3 * len(advice.robot.legs)
    say(f"\nOther servos, at their rated voltage, with prices of {count} (look them up):")
    rows = [["servo", "price", "lacks"]]
    for choice in advice.choices:
        price = "unknown" if choice.price is None else f"about ${choice.price:.0f}"
        rows.append([choice.servo.name, price, choice.lacks or "nothing"])
    print_table(rows, right=(1,))
    if advice.cheapest is not None:
        say(f"Cheapest that holds: {advice.cheapest.servo.name}")
    else:
        say("None of them holds for an unlimited time.")
