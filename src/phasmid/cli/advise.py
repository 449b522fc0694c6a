"""``phasmid advise``: do these servos hold, which others do, and with which supply."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from phasmid.advice import Advice, Wiring, advise
from phasmid.advice.answer import degrees_words, margin_words
from phasmid.advice.supply import EMPTY_CELL, USABLE
from phasmid.cli.figures import check_figure_path, write_figure
from phasmid.cli.options import Number
from phasmid.cli.output import print_table, say
from phasmid.cli.scenario_options import SCENARIO, print_idle, scenario_of, scenario_options
from phasmid.errors import InvalidInput, plain
from phasmid.servo.words import servo_label

OPTIONS = {
    "--speed-mm-s MM/S": Number("forward speed; default: by the period", 0.1, 10_000),
    "--cells N": Number("battery of lithium-polymer cells in series; its sag counts", 1, 14),
    "--battery-mah MAH": Number("capacity of the battery; default: 2200", 10, 1_000_000, 2200),
    "--wire-mm2 MM2": Number("wire from the supply to the servos; its drop counts", 0.03, 100),
    "--wire-length-mm MM": Number("length of that wire, one way; default: 300", 0, 20_000, 300),
    "--out FILE": "draw load and heat: svg, png or pdf",
    "--force": "replace an older figure",
}

INTERFACES = {
    "pwm": "PWM servos: feed them from the supply, not through the controller board. Nothing "
    "reports or limits their heat; feel the warmest one by hand.",
    "bus": "Bus servos: a chain for each leg, all fed from the supply. They shut down when hot. "
    "`phasmid drive --bus` knows Dynamixel alone.",
    "smart": "Smart servos: a chain for each leg, all fed from the supply. Set their torque and "
    "temperature limits, and read their temperature. `phasmid drive --bus` knows Dynamixel alone.",
}
"""Advice by a servo's interface."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.set_defaults(quiet=False)
    scenario_options(parser, SCENARIO.format("phantomx-paper"))


def run(options: argparse.Namespace) -> int:
    """Print the advice, and return the exit status: 2 where the servos do not hold."""
    figure = None if options.out is None else Path(options.out)
    if figure is not None:
        check_figure_path("--out", figure, force=options.force)
    if options.cells is not None and options.cells % 1:
        raise InvalidInput(f"--cells is {options.cells:g}; it must be a whole number.")
    wiring = Wiring(
        cells=None if options.cells is None else int(options.cells),
        capacity=options.battery_mah / 1000,
        wire_area=None if options.wire_mm2 is None else options.wire_mm2 / 1e6,
        wire_length=options.wire_length_mm / 1000,
    )
    speed = None if options.speed_mm_s is None else options.speed_mm_s / 1000
    scenario = scenario_of(options, default=None)
    print_idle(scenario, options, "the advice on servos")
    advice = advise(scenario, speed=speed, wiring=wiring)
    _print(advice)
    if figure is not None:
        from phasmid.reporting.advice_figure import advice_figure

        write_figure(advice_figure(advice), [figure])
        say(f"Written to {plain(str(figure))}")
    if not advice.verdict.holding.is_possible:
        verdict = advice.verdict
        what = f"{advice.robot.name} with the {servo_label(verdict.servo)}: {verdict.answer}."
        say(f"phasmid: {InvalidInput(what, hint='another --servo or --gait')}", file=sys.stderr)
        return 2
    return 0


def _print(advice: Advice) -> None:
    """Print the verdict, the servos of the catalogue, and the supply."""
    experiment, verdict, wiring = advice.experiment, advice.verdict, advice.wiring
    say(
        f"{plain(advice.robot.name)}, {plain(verdict.gait)} gait, {1000 * advice.speed:.3g} mm/s, "
        f"payload {1000 * experiment.payload:g} g"
    )
    if resistance := wiring.resistance(advice.robot.servo):
        words = f"through {1000 * resistance:.0f} mΩ of battery and wire"
        say(f"{verdict.voltage:g} V reach the servos, {words}.")
    for line in verdict.lines:
        say(plain(line))
    _print_catalogue(advice)
    _print_supply(advice)


def _print_catalogue(advice: Advice) -> None:
    count = 3 * len(advice.robot.legs)
    say("")
    rows = [["servo", "at V", f"{count} cost", "margin", "", "decides", "after 1 h", "holds"]]
    for choice in advice.choices:
        verdict = choice.verdict
        hour = verdict.hour_temperature
        rows.append(
            [
                choice.servo.name,
                f"{choice.servo.rated_voltage:g}",
                "unknown" if choice.price is None else f"~${choice.price:.0f}",
                margin_words(verdict.margin),
                verdict.grade.value,
                verdict.deciding,
                "unknown" if hour is None else degrees_words(hour),
                f"{1000 * choice.payload:.0f} g",
            ]
        )
    print_table(rows, right=(1, 2, 7))
    if advice.best is None:
        say("None of them holds.")
        return
    cheapest = ", ".join(choice.servo.name for choice in advice.cheapest) or "none"
    say(
        f"Best at {1000 * advice.speed:.3g} mm/s: {advice.best.servo.name}. Cheapest that hold "
        f"without help from the floor: {cheapest}. Rows count the servos' masses; --servo does not."
    )


def _print_supply(advice: Advice) -> None:
    """Print currents, and what to buy for them."""
    needed, bought, wiring = advice.currents, advice.supply, advice.wiring
    servo = advice.robot.servo
    if needed is None:
        unknown = servo.known_motor is None
        reason = "the servo has no stall current" if unknown else "the robot is not stable"
        say(f"Supply: unknown, since {reason}.")
        return
    say(
        f"Current of all servos: {_pair(needed.mean)} A on average, at most "
        f"{needed.walking[0]:.2g} A in the walk and {needed.rising[0]:.2g} A standing up, without "
        f"starts; {needed.to_carry:.2g} A with a caught leg, {needed.stall:.3g} A with all stalled."
    )
    if bought is None:
        say("Supply: no usual fuse and wire carry this current; divide the servos.")
        return
    empty = EMPTY_CELL * bought.cells
    say(
        f"Supply: LiPo {bought.cells}S, {1000 * wiring.capacity:g} mAh, at least "
        f"{bought.c_rating} C, to stop at {empty:.3g} V; fuse {bought.fuse:g} A at the battery, "
        f"{bought.leg_fuse:g} A and {1e6 * bought.leg_area:g} mm² for each leg."
    )
    if bought.regulator is None:
        say("Regulator (BEC): none is needed.")
    else:
        say(f"Regulator (BEC): {bought.regulator:g} V, {bought.regulator_current:g} A.")
    thin = wiring.wire_area is not None and wiring.wire_area < bought.wire_area
    say(
        f"Wire before the legs divide: {1e6 * bought.wire_area:g} mm² or more, which loses "
        f"{bought.wire_drop:.2f} V in {1000 * wiring.wire_length:g} mm."
        + (f" {1e6 * (wiring.wire_area or 0):g} mm² are too thin." if thin else "")
    )
    low, high = bought.minutes
    say(f"{low:.0f} to {high:.0f} min on {100 * USABLE:.0f} % of it, without the robot's computer.")
    if wiring.cells is None and bought.regulator is None:
        say(f"Judged at {servo.voltage:g} V; --cells {bought.cells} judges near its end.")
    if servo.interface is not None:
        say(INTERFACES[servo.interface])


def _pair(bounds: tuple[float, float]) -> str:
    high, low = (f"{each:.2g}" for each in bounds)
    return low if low == high else f"{low} to {high}"
