"""``phasmid identify``: fit a servo to logs, or compare a robot's log with the simulation."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Any

import numpy as np

from phasmid.cli.compare import compare_log
from phasmid.cli.figures import check_figure_path, write_figure
from phasmid.cli.options import Number, declare, refuse_given
from phasmid.cli.output import print_table, say
from phasmid.errors import InvalidInput, nearest, plain
from phasmid.formats import load_robot
from phasmid.identification import (
    MODELS,
    BenchLog,
    Determined,
    Identification,
    LegLog,
    Pendulum,
    identify,
)
from phasmid.identification.bam import save_bam
from phasmid.identification.log_file import load_bench_log
from phasmid.identification.parameters import PARAMETERS, table_slope
from phasmid.identification.robot_log import log_of_recording, read_csv_log
from phasmid.recording import load_recording
from phasmid.recording.file import check_new_file, write_whole
from phasmid.robot import Robot, with_servo
from phasmid.servo import load_servo
from phasmid.servo.catalogue import servo_table

BENCH: dict[str, str | tuple[str, str] | Number] = {
    "--mass-g G": "mass of the weight; several with commas between, one for each log",
    "--length-mm MM": "from the axis to the weight's centre; one or one for each log",
    "--arm-mass-g G": "mass of the arm, a rod of that length; default: 0",
    "--joint LEG.JOINT": "joint of recordings of a bench; not for CSV",
    "--hanging-deg DEG": Number(
        "angle that the servo reports where the pendulum hangs down, roughly; default: 0", -360, 360
    ),
}
"""Options of a pendulum."""

FIT = {
    "--model MODEL": "friction model: own, or m1 to m6 of BAM; default: own",
    "--voltage V": "supply; one or one for each log; default: the log's, or the servo's rated one",
    "--fix NAMES": "parameters that keep the servo's values, with commas between",
    "--leg NAMES": "legs whose servos are fitted, with commas between; default: the first",
    "--bam FILE": "write the parameters for BAM, .json (m1 to m6)",
    "--figure FILE": "draw measured and simulated angles: svg, png or pdf",
}
"""Options of a fit."""

OPTIONS: dict[str, str | tuple[str, str] | Number] = {
    "--robot ROBOT": "the logs are of this robot, its legs in the air, and not of a pendulum; with "
    "--compare default: the robot of the recording",
    "--servo NAME": "servo of the catalogue at all joints, such as MG996R; default: the robot's, "
    "of a pendulum AX-12A",
    "--compare": "compare a log of the robot with the replay of its joint targets in simulation",
    "--scenario SCENARIO": "preset or file for --compare; default: that of the recording, or paper "
    "with --robot",
    "--out PATH": "write the servo as a table for robot files, .toml; with --compare the folder "
    "of figures and numbers; default of that: results/NAME_compare",
    "--force": "replace older files",
    "--quiet": "print only errors",
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "logs",
        nargs="+",
        metavar="LOG",
        help="CSV with the columns time [s], target [deg], position [deg], powered; or a "
        "recording; with --robot and --compare a log of a robot: .csv, recording.nc, its folder, "
        "or .mcap",
    )
    declare(parser.add_argument_group("fit"), FIT)
    declare(parser.add_argument_group("pendulum bench"), BENCH)


def run(options: argparse.Namespace) -> int:
    """Identify a servo, print it and return the exit status: 1 where nothing is determined."""
    _refuse(options)
    if options.compare:
        return compare_log(options)

    model: Any = options.model or "own"
    if model not in MODELS:
        guess = nearest(model, MODELS)
        hint = f'"{guess}"' if guess else f"one of {', '.join(MODELS)}"
        raise InvalidInput(f'no model "{plain(model)}".', hint=hint)
    if options.bam is not None and model == "own":
        raise InvalidInput("BAM has no model of phasmid's own friction.", hint="--model m6")
    if options.figure is not None:
        check_figure_path("--figure", Path(options.figure), force=options.force)
    for flag, ending in (("out", ".toml"), ("bam", ".json")):
        name = vars(options)[flag]
        if name is not None:
            if Path(name).suffix != ending:
                raise InvalidInput(f'--{flag} is "{plain(name)}"; it must end in {ending}.')
            check_new_file(Path(name), option=f"--{flag} FILE", force=options.force)
    robot = _robot(options)
    servo = load_servo(options.servo or "AX-12A") if robot is None else robot.servo
    volts = servo.rated_voltage
    found = identify(
        _bench_logs(options, volts) if robot is None else _leg_logs(options, robot, volts),
        servo,
        model=model,
        fixed=options.fix.split(",") if options.fix else (),
        hanging=math.radians(options.hanging_deg or 0.0),
    )
    if not options.quiet:
        _print(found)
    _write(found, options)
    return 0 if any(one is not Determined.NO for one in found.determined) else 1


def _refuse(options: argparse.Namespace) -> None:
    """Refuse options of other kinds of logs.

    Raises:
        InvalidInput: An option has no effect.
    """
    if options.leg and options.robot is None and not options.compare:
        raise InvalidInput("--leg needs the robot of the log.", hint="--robot phantomx-ax")
    for table, is_used, reason in (
        (BENCH, options.robot is None, "is for a pendulum; --robot is for a leg"),
        ({**BENCH, **FIT}, not options.compare, "is for a fit; --compare makes none"),
        ({"--scenario": ""}, options.compare, "is for --compare"),
    ):
        keys = (name.split()[0][2:].replace("-", "_") for name in table)
        refuse_given(options, () if is_used else keys, reason)


def _robot(options: argparse.Namespace) -> Robot | None:
    """Return the robot of the options, with their servo; None: the logs are of a bench."""
    if options.robot is None:
        return None
    robot = load_robot(options.robot)
    return robot if options.servo is None else with_servo(robot, load_servo(options.servo))


def _leg_logs(options: argparse.Namespace, robot: Robot, voltage: float) -> list[LegLog]:
    """Read the logs of a robot, one of each leg, with their supply."""
    known = [leg.name for leg in robot.legs]
    chosen = options.leg.split(",") if options.leg else known[:1]
    for name in chosen:
        if name not in known:
            guess = nearest(name, known)
            raise InvalidInput(
                f'{robot.name} has no leg "{plain(name)}".',
                hint=f'"{guess}"' if guess else f"one of {', '.join(known)}",
            )
    volts: list[float | None] = [None] * len(options.logs)
    if options.voltage:
        volts = [*_numbers("--voltage", options.voltage, len(options.logs))]
    logs = []
    for text, supply in zip(options.logs, volts, strict=True):
        path = Path(text)
        if path.suffix.lower() == ".csv":
            log, contact = read_csv_log(path, robot), None
        else:
            recording = load_recording(path)
            log = log_of_recording(recording, path.stem, robot)
            contact = recording.get("contact")
        if supply is None:
            supply = float(np.nanmean(log.measured.get("voltage", voltage)))
        for name in chosen:
            i = known.index(name)
            if contact is not None and np.asarray(contact.values)[:, i].any():
                raise InvalidInput(
                    f"{path.name}: {name} touches the ground; its load is known in the air only.",
                    hint="a log with the robot on a stand",
                )
            target, position = log.target[:, i], log.position[:, i]
            title = f"{log.name}, {name}"
            logs.append(LegLog(title, log.time, target, position, robot.legs[i], supply))
    return logs


def _bench_logs(options: argparse.Namespace, voltage: float) -> list[BenchLog]:
    """Read the logs of a bench, each with its load and supply."""
    paths = options.logs
    for flag in ("mass_g", "length_mm"):
        if vars(options)[flag] is None:
            name = f"--{flag.replace('_', '-')}"
            raise InvalidInput(
                f"{name} is missing: the load of the servo.", hint=f"{name} 150, or --robot"
            )
    supply = options.voltage or str(voltage)
    columns = [
        _numbers(flag, text, len(paths))
        for flag, text in (
            ("--mass-g", options.mass_g),
            ("--length-mm", options.length_mm),
            ("--arm-mass-g", options.arm_mass_g or "0"),
            ("--voltage", supply),
        )
    ]
    return [
        load_bench_log(
            path, Pendulum(grams / 1000, mm / 1000, arm / 1000), volts, joint=options.joint or ""
        )
        for path, grams, mm, arm, volts in zip(paths, *columns, strict=True)
    ]


LARGEST = 1e6
"""Largest number of a list."""


def _numbers(flag: str, text: str, count: int) -> list[float]:
    """Return one number for each log, from one or from a list of so many."""
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = [-1.0]
    least = 0 if flag == "--arm-mass-g" else 1e-9
    if not all(least <= value <= LARGEST for value in values):
        raise InvalidInput(
            f'{flag} is "{plain(text)}"; it must be a positive number, or several with commas '
            "between.",
            hint=f"{flag} 150",
        )
    if len(values) not in (1, count):
        raise InvalidInput(f"{flag} has {len(values)} numbers for {count} logs; one for each.")
    return values * count if len(values) == 1 else values


def _print(found: Identification) -> None:
    """Print values, intervals, trade-offs and the error."""
    logs = found.logs
    seconds = sum(float(log.time[-1] - log.time[0]) for log in logs)
    say(
        f"{plain(found.servo.name)}, model {found.model}, {len(logs)} "
        f"{'log' if len(logs) == 1 else 'logs'}, {seconds:.3g} s, {found.evaluations} simulations\n"
    )
    rows = [["parameter", "value", "95 % interval", "unit", "determined"]]
    for name, value, half, how in zip(
        found.names, found.values, found.half_widths, found.determined, strict=True
    ):
        one = PARAMETERS[name]
        low, high = (max(value - half, one.low), min(value + half, one.high))
        digits = max(0, 2 - math.floor(math.log10(max(half * one.per_si, 1e-9))) - 1)
        texts = [f"{x * one.per_si:.{min(digits, 6)}f}" for x in (value, low, high)]
        interval = f"{texts[1]} to {texts[2]}"
        rows.append([name, texts[0], interval, one.unit, str(how)])
    for name, value in found.fixed.items():
        one = PARAMETERS[name]
        remark = "fixed"
        if name == "compliance_margin" and found.margin is not None:
            remark = "yes, a whole number" if found.margin < 0.5 else "no"
        rows.append([name, f"{value * one.per_si:.4g}", "", one.unit, remark])
    print_table(rows, right=(1, 2))
    _print_trade_offs(found)
    angle, step = (math.degrees(x) for x in (found.rms_error, found.servo.resolution))
    say(f"\nrms error {angle:.3f}°; the sensor's step is {step:.3f}°")
    if found.rms_error > LARGE_ERROR * found.servo.resolution:
        say(
            "That is too much for this model: intervals and values may be wrong. Check load, "
            "supply, units and --hanging-deg, or try another --model. A leg must touch nothing."
        )
    motor = found.motor
    volts = found.servo.rated_voltage
    say(
        f"at {volts:g} V: stall torque {motor.stall_torque(volts):.3f} N·m, no-load speed "
        f"{motor.no_load_speed(volts):.2f} rad/s"
    )


LARGE_ERROR = 1.5
"""Error in steps of the sensor above which a model is doubted; a step alone gives 0.29."""


SLOPE_ERROR = 0.05
"""Share by which the slope of a table may differ from the fitted one without a remark."""


REMEDIES = {
    "viscous_friction": "a part with the torque off, on a bench",
    "backlash": "a slow motion to and fro through the angle without load",
    "compliance_margin": "steps of one to five ticks, or read it from the servo and --fix it",
    "punch": "steps of one to five ticks, or read it from the servo and --fix it",
    "compliance_slope": "read it from the servo and --fix it",
    "p_gain": "read it from the servo and --fix it",
    "load_loss": "the same slow motion with another load",
    "armature": "a fast sweep",
    "stribeck_speed": "slow motion at several loads",
}
"""What would determine a parameter that trades off with others."""

MOST_NAMES = 4
"""Most parameters that are named in a trade-off; they come by size."""


def _print_trade_offs(found: Identification) -> None:
    """Print which parameters cannot be told apart."""
    if not found.trade_offs:
        say("\nAll parameters can be told apart by these logs.")
        return
    say("\nThese logs cannot tell apart:")
    for one in found.trade_offs:
        parts = [f"{name} {change:+.0%}" for name, change in one.changes.items()][:MOST_NAMES]
        if len(parts) == 1:
            say(f"  {next(iter(one.changes))}: unknown by {one.deviation:.0%}")
        else:
            say(f"  {', '.join(parts)} (together, unknown by {one.deviation:.0%})")
    named = {name for one in found.trade_offs for name in one.changes}
    for name, remedy in REMEDIES.items():
        if name in named:
            say(f"{name}: {remedy}.")
    say("More loads and faster motion help with all, and so does --fix NAMES for what is known.")


def _write(found: Identification, options: argparse.Namespace) -> None:
    """Write the files of the options."""
    files: list[str] = []
    if options.out is not None:
        slope = found.all_values.get("compliance_slope")
        if slope is not None and abs(table_slope(slope) / slope - 1) > SLOPE_ERROR:
            say(
                f"The servo's compliance slope is a power of two: {table_slope(slope):g} instead "
                f"of {slope:.3g} in the table. Read it from the servo, and fit with --fix."
            )
        write_whole(Path(options.out), ("\n".join(servo_table(found.identified)) + "\n").encode())
        files.append(f"{options.out}, a table for a robot file")
    if options.bam is not None:
        save_bam(found.bam, options.bam)
        files.append(options.bam)
    if options.figure is not None:
        from phasmid.identification.figure import identification_figure

        write_figure(identification_figure(found), [Path(options.figure)])
        files.append(options.figure)
    for file in () if options.quiet else files:
        say(f"Written to {plain(file)}")
