"""``phasmid advise``: do these servos hold, which others do, and with which supply."""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

from phasmid.advice import Advice, ServoChoice, ServoVerdict, Wiring, advise
from phasmid.advice.answer import Grade, Holding, degrees_words, margin_words
from phasmid.advice.supply import EMPTY_CELL, FULL_CELL, REGULATOR_LOSS, USABLE
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

QUICK = 2.0
"""Margin of speed below which a simulated walk takes more current than a robot at rest."""

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
    wiring = Wiring(
        cells=options.cells,
        capacity=options.battery_mah / 1000,
        wire_area=None if options.wire_mm2 is None else options.wire_mm2 / 1e6,
        wire_length=options.wire_length_mm / 1000,
    )
    speed = None if options.speed_mm_s is None else options.speed_mm_s / 1000
    scenario = scenario_of(options, default=None)
    print_idle(scenario, options, "the advice on servos")
    two = wiring.cells and scenario.servo.voltage is not None
    if two and wiring.battery(scenario.load_robot().servo)[1]:
        raise InvalidInput(
            f"{wiring.cells:g} cells are connected to the servos and set their voltage.",
            hint="--cells or --voltage, and not both",
        )
    advice = advise(scenario, speed=speed, wiring=wiring)
    _print(advice)
    if figure is not None:
        from phasmid.reporting.advice_figure import advice_figure

        write_figure(advice_figure(advice), [figure])
        say(f"Written to {plain(str(figure))}")
    verdict = advice.verdict
    if verdict.grade is Grade.NO:
        what = f"{advice.robot.name} with the {servo_label(verdict.servo)}: {verdict.answer}."
        say(f"phasmid: {InvalidInput(what, hint=_remedy(verdict))}", file=sys.stderr)
        return 2
    return 0


def _remedy(verdict: ServoVerdict) -> str:
    """Return what to try where the servos do not hold, or have little margin."""
    if verdict.is_supply_too_high:
        return f"--voltage {verdict.highest_voltage:g}"
    if verdict.holding is Holding.NOT_STABLE:
        return "another --gait"
    if verdict.deciding == "speed":
        return "longer steps at the same speed (--step-length-mm), a lower speed, or more volts"
    return "feet nearer to the hips (--stance-radius-mm), a lighter robot, or another --servo"


def _print(advice: Advice) -> None:
    """Print the verdict, the servos of the catalogue, and the supply."""
    experiment, verdict, wiring = advice.experiment, advice.verdict, advice.wiring
    stride = experiment.course.stride
    say(
        f"{plain(advice.robot.name)}, {plain(verdict.gait)} gait, {1000 * advice.speed:.3g} mm/s "
        f"(steps of {1000 * stride.step_length:.3g} mm, period {stride.period:.3g} s), payload "
        f"{1000 * experiment.payload:g} g"
    )
    servo = advice.robot.servo
    sags = wiring.cells is not None and wiring.battery(servo)[1]
    parts = ["battery"] * sags + ["wire"] * (wiring.wire_area is not None)
    words = f", through {1000 * wiring.resistance(servo):.0f} mΩ of {' and '.join(parts)}"
    if wiring.cells or parts:
        say(
            f"{verdict.voltage:g} V reach the servos{words if parts else ''}. "
            "The table is at rated voltage."
        )
    for line in verdict.lines:
        say(plain(line))
    if verdict.grade is Grade.TIGHT or (
        verdict.grade is Grade.GOOD and verdict.deciding == "speed"
    ):
        say(f"More margin: {_remedy(verdict)}.")
    _print_catalogue(advice)
    _print_supply(advice)


def _print_catalogue(advice: Advice) -> None:
    count = 3 * len(advice.robot.legs)
    say("")
    rows = [["servo", "at V", f"{count} cost", "margin", "", "decides", "after 1 h", "payload"]]
    for choice in advice.choices:
        verdict = choice.verdict
        hour = verdict.hour_temperature
        rows.append(
            [
                choice.servo.name,
                f"{choice.servo.rated_voltage:g}",
                _cost(choice),
                margin_words(verdict.margin),
                verdict.grade.value,
                "balance" if verdict.holding is Holding.NOT_STABLE else verdict.deciding,
                "unknown" if hour is None else degrees_words(hour),
                f"{1000 * choice.payload:.0f} g",
            ]
        )
    print_table(rows, right=(1, 2, 7))
    if advice.best is None:
        say("None of them holds.")
        return
    best, cheapest = advice.best, advice.cheapest
    names = ", ".join(choice.servo.name for choice in cheapest) or "none"
    say(
        f"Best at {1000 * advice.speed:.3g} mm/s: {best.servo.name} ({_cost(best)}). Cheapest that "
        f"hold without help{f' ({_cost(cheapest[0])})' if cheapest else ''}: "
        f"{names}. --servo NAME advises its supply."
    )


def _cost(choice: ServoChoice) -> str:
    return "unknown" if choice.price is None else f"~${choice.price:.0f}"


def _print_supply(advice: Advice) -> None:
    """Print currents, and what to buy for them."""
    needed, bought, wiring = advice.currents, advice.supply, advice.wiring
    servo = advice.robot.servo
    say("")
    if not advice.verdict.holding.is_possible:
        say("Supply: not advised, since the robot cannot walk so.")
        return
    if needed is None:
        say("Supply: unknown, since the servo has no stall current.")
        return
    say(
        f"Current of the {servo_label(servo.name)}, all {3 * len(advice.robot.legs)}: "
        f"{_pair(needed.mean)} A on average, at most {needed.walking[0]:.2g} A in the walk and "
        f"{needed.rising[0]:.2g} A standing up, without starts; {needed.to_carry:.2g} A with one "
        f"leg stalled, {needed.stall:.3g} A with all stalled."
    )
    if advice.verdict.margins["speed"][0] < QUICK:
        period = advice.experiment.course.stride.period
        say(
            "This walk is quick for its servos, and motion takes more; see phasmid walk --drive "
            f"servo --period {period:.3g} --voltage {servo.voltage:g}, with robot and load."
        )
    if bought is None:
        say("Supply: no usual fuse and wire carry this current; divide the servos.")
        return
    empty = EMPTY_CELL * bought.cells
    say(
        f"Supply: LiPo {bought.cells:g}S, {1000 * wiring.capacity:g} mAh, at least "
        f"{bought.c_rating} C, to stop at {empty:.3g} V; fuse {bought.fuse:g} A at the battery, "
        f"{bought.leg_fuse:g} A and {1e6 * bought.leg_area:g} mm² for each leg."
    )
    if bought.regulator is None:
        full = FULL_CELL * bought.cells
        most = servo.maximum_voltage
        over = f"; {full:.3g} V when full are above the {most:g} V of their data sheet"
        say(f"Regulator (BEC): none for the servos{over if full > most else ''}.")
    else:
        is_low = math.isclose(bought.regulator, empty - REGULATOR_LOSS)
        why = f", all that {bought.cells:g} nearly empty cells allow" if is_low else ""
        say(f"Regulator (BEC): {bought.regulator:g} V{why}, {bought.regulator_current:g} A.")
    thin = wiring.wire_area is not None and wiring.wire_area < bought.wire_area
    say(
        f"Wire before the legs divide: {1e6 * bought.wire_area:g} mm² or more, which loses "
        f"{bought.wire_drop:.2f} V in {1000 * wiring.wire_length:g} mm."
        + (f" {1e6 * (wiring.wire_area or 0):g} mm² are too thin." if thin else "")
    )
    low, high = bought.minutes
    say(f"{low:.0f} to {high:.0f} min on {100 * USABLE:.0f} % of it, without the robot's computer.")
    if wiring.cells is None and bought.regulator is None:
        say(
            f"The verdict is for {servo.voltage:g} V; --cells {bought.cells:g} gives that for the "
            "nearly empty battery."
        )
    if servo.interface is not None:
        say(INTERFACES[servo.interface])


def _pair(bounds: tuple[float, float]) -> str:
    high, low = (f"{each:.2g}" for each in bounds)
    return low if low == high else f"{low} to {high}"
