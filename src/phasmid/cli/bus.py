"""``phasmid bus``: list, watch and calibrate servos on a serial port, or emulate such a port."""

from __future__ import annotations

import argparse
import math
import shlex
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from itertools import product
from pathlib import Path

from phasmid.cli.bus_calibrate import POSES, calibrate
from phasmid.cli.options import Number, refuse_given
from phasmid.cli.output import print_table, say
from phasmid.cli.progress import progress_bar
from phasmid.errors import InvalidInput, nearest, plain
from phasmid.formats import load_robot
from phasmid.hardware import (
    Bus,
    Emulator,
    Model,
    ServoCalibration,
    default_calibration,
    load_calibration,
    make_servos,
    models,
    save_calibration,
)
from phasmid.hardware.bus import BAUDS, MOST_LATENCY, latency_advice
from phasmid.hardware.rates import achievable_rate
from phasmid.recording.file import check_new_file
from phasmid.robot import Robot
from phasmid.scenario import load_scenario
from phasmid.servo import servo_names
from phasmid.servo.words import servo_words

ACTIONS = ("scan", "monitor", "calibrate", "emulate")

OPTIONS = {
    "ACTION": "scan: list the servos on a port; monitor: show their state; calibrate: measure "
    "offsets, directions and ranges of a robot's servos, turned by hand; emulate: make a port with "
    "emulated servos",
    "[PORT]": "the port, such as /dev/ttyUSB0 (scan, monitor, calibrate)",
    "--baud N": Number(
        "baud rate; default: scan tries the usual ones, the others take 1000000",
        1_000,
        10_000_000,
        is_whole=True,
        hint="1000000",
    ),
    "--protocol N": Number(
        "1 or 2; default: scan tries both, monitor 1, calibrate that of the robot's servo",
        1,
        2,
        is_whole=True,
    ),
    "--ids IDS": "ids, such as 1-18 or 1,2,5; default: all that answer; calibrate and emulate: "
    "from 1, leg by leg",
    "--once": "show the state once (monitor)",
    "--robot ROBOT": "the robot (calibrate); a robot that emulated servos move in the simulation "
    "(emulate)",
    "--pose POSE": "zero: all joint angles 0; square: the same with the tibiae down; neutral: "
    "neutral feet; default: the first within the joint limits (calibrate)",
    "--out FILE": "the calibration file (calibrate); default: calibration.toml",
    "--force": "replace an older calibration file (calibrate)",
    "--calibration FILE": "ids, models, offsets and directions of the robot's servos (emulate)",
    "--model MODEL": "model of emulated servos, each with a pendulum; default: AX-12A, or that of "
    "the robot",
    "--latency-ms MS": Number(
        "latency timer of the USB adapter; emulate: default 1", 0, 255, hint="16"
    ),
    "--return-delay-us US": Number(
        "return delay of emulated servos; default: 500, the maker's setting", 0, 508
    ),
    "--seed N": Number("seed of random faults; default: 0", 0, 2**32, is_whole=True),
}


EMULATED = ("robot", "calibration", "model", "return_delay_us", "seed", "fault")
MEASURED = ("robot", "pose", "out", "force")

IDLE = {
    "scan": (*EMULATED, *MEASURED, "once"),
    "monitor": (*EMULATED, *MEASURED),
    "calibrate": (*EMULATED[1:], "once"),
    "emulate": (*MEASURED[1:], "once", "protocol"),
}
"""Options that an action does not use."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the option that may be repeated."""
    parser.add_argument(
        "--fault",
        action="append",
        metavar="FAULT",
        default=[],
        help='a fault of emulated servos: "lost 0.01", "garbled 0.01", "late 0.01 by 50 ms", '
        '"5 dead at 3 s", "5 hot", "5 overload", "5 phantom", "5 answers as 6", '
        '"brown-out at 3 s for 0.5 s"; may be repeated',
    )


def run(options: argparse.Namespace) -> int:
    """Do what the action says, and return the exit status."""
    action = options.action
    actions = dict(zip(ACTIONS, (_scan, _monitor, _calibrate, _emulate), strict=True))
    if action not in actions:
        guess = nearest(action, actions)
        raise InvalidInput(
            f'"{plain(action)}" is no action of phasmid bus.',
            hint=f'"{guess}"' if guess else f"one of {', '.join(ACTIONS)}",
        )
    if action == "emulate" and options.port:
        raise InvalidInput("phasmid bus emulate makes its own port.", hint="phasmid bus emulate")
    if action != "emulate" and not options.port:
        raise InvalidInput(
            f"phasmid bus {action} needs a port.", hint=f"phasmid bus {action} /dev/ttyUSB0"
        )
    refuse_given(options, IDLE[action], f"does nothing with phasmid bus {action}")
    return actions[action](options)


def _ids(text: str | None) -> list[int] | None:
    """Return the ids of an option, such as 1-18 or 1,2,5."""
    if not text:
        return None
    ids: list[int] = []
    for part in text.split(","):
        low, dash, high = part.strip().partition("-")
        ends = (low, high) if dash else (low, low)
        if not all(end.isdecimal() and end.isascii() and int(end) <= 252 for end in ends):
            raise InvalidInput(
                f'--ids is "{plain(text)}"; it must be ids from 0 to 252, such as 1-18 or 1,2,5.',
                hint="--ids 1-18",
            )
        ids += range(int(ends[0]), int(ends[1]) + 1)
    return list(dict.fromkeys(ids))


# Scan ---------------------------------------------------------------------------------------------


def _scan(options: argparse.Namespace) -> int:
    """List the servos of a port; status 1 where there are none."""
    bauds = (options.baud,) if options.baud else BAUDS
    protocols = (options.protocol,) if options.protocol else (1, 2)
    rows, ids = [["id", "model", "baud", "protocol", "return delay"]], _ids(options.ids)
    advice = ""
    attempts = list(product(bauds, protocols))
    with progress_bar("scanning", len(attempts), quiet=False) as progress:
        for number, (baud, protocol) in enumerate(attempts):
            if len(rows) > 1 and baud != attempts[number - 1][0]:
                break
            if progress is not None:
                progress(number, note=f" at {baud} baud, protocol {protocol}")
            with _opened(options, baud, protocol) as bus:
                for id_, found in bus.scan(ids).items():
                    rows.append([str(id_), *_described(bus, id_, found, baud, protocol)])
                if not advice and bus.models:
                    advice = _advice(bus, next(iter(bus.models)))
    if len(rows) == 1:
        tried = ", ".join(map(str, bauds))
        say(f"No servo answers on {plain(options.port)} (tried {tried} baud).")
        return 1
    print_table(rows, right=(0, 2, 3, 4))
    if advice:
        say(advice)
    return 0


def _described(bus: Bus, id_: int, found: Model | int, baud: int, protocol: int) -> list[str]:
    """Return model, baud rate, protocol and return delay of a servo as text."""
    if isinstance(found, int):
        return [f"unknown model {found}", str(baud), f"{protocol}.0", ""]
    delay = bus.read(id_, "return_delay_time")
    return [found.name, str(baud), f"{protocol}.0", f"{1e6 * delay:.0f} us"]


def _opened(options: argparse.Namespace, baud: int, protocol: int) -> Bus:
    """Open the port of the options."""
    latency = options.latency_ms
    return Bus(options.port, baud, protocol, latency=None if latency is None else latency / 1000)


def _advice(bus: Bus, id_: int) -> str:
    """Return the measured latency and the rate that it allows, and a remedy where it is long."""
    latency, count = bus.measure_latency(id_), len(bus.models)
    table = bus.models[id_]
    rate = achievable_rate(
        table,
        count,
        baud=bus.baud,
        return_delay=bus.read(id_, "return_delay_time"),
        latency=latency,
        read_size=table.register("present_position").size,
    )
    text = (
        f"The adapter adds {1000 * latency:.1f} ms to an answer.\n"
        f"Goals and positions of {count} servos can be exchanged at {rate:.0f} Hz."
    )
    if latency >= MOST_LATENCY:
        remedy = latency_advice(bus.path)
        text += f"\nIts latency timer is too long for control; set it to 1 ms:\n  {remedy}"
    return text


# Monitor ------------------------------------------------------------------------------------------


def _monitor(options: argparse.Namespace) -> int:
    """Show the state of the servos until Ctrl-C; status 1 where there are none."""
    with _opened(options, options.baud or 1_000_000, options.protocol or 1) as bus:
        bus.scan(_ids(options.ids))
        if not bus.models:
            say(f"No servo answers on {plain(options.port)}.")
            return 1
        first = next(iter(bus.models))
        advice = _advice(bus, first)
        while True:
            began = time.perf_counter()
            rows = _states(bus)
            if not options.once and sys.stdout.isatty():
                # Home, and clear what is below.
                print("\x1b[H\x1b[J", end="")
            print_table(rows, right=(0, 1, 2, 3, 4))
            traffic, took = bus.traffic, time.perf_counter() - began
            say(
                f"{traffic.answers} answers, {traffic.lost} lost, {traffic.damaged} damaged; "
                f"all read in {1000 * took:.0f} ms."
            )
            say(advice)
            if options.once:
                return 0
            time.sleep(max(0.2 - took, 0.0))


def _states(bus: Bus) -> list[list[str]]:
    """Return the state of all servos as rows of text."""
    rows = [["id", "position", "load", "supply", "temperature", "errors"]]
    for id_, reading in bus.read_all(list(bus.models)).items():
        if reading is None or not reading.values:
            rows.append([str(id_), "", "", "", "", "no answer" if reading is None else "refuses"])
            continue
        error = reading.error
        if error.ALERT in error:
            error = bus.errors(id_)
        position, load, voltage, temperature = reading.values.values()
        has_current = "current_limit" in bus.models[id_].registers
        amount = f"{load:.2f} A" if has_current else f"{100 * load:.0f} %"
        rows.append(
            [
                str(id_),
                f"{math.degrees(position):.1f}°",
                amount,
                f"{voltage:.1f} V",
                f"{temperature:.0f} °C",
                ", ".join(error.names) or "none",
            ]
        )
    return rows


# Calibrate ----------------------------------------------------------------------------------------


def _calibrate(options: argparse.Namespace) -> int:
    """Guide the user through a calibration, and write it."""
    if not options.robot:
        raise InvalidInput("phasmid bus calibrate needs a robot.", hint="--robot phantomx-ax")
    if options.pose not in (None, *POSES):
        guess = nearest(options.pose, POSES)
        raise InvalidInput(
            f'--pose is "{plain(options.pose)}"; it must be one of {", ".join(POSES)}.',
            hint=f"--pose {guess}" if guess else "",
        )
    path = Path(options.out or "calibration.toml")
    if path.suffix != ".toml":
        raise InvalidInput(f'--out is "{plain(str(path))}"; it must end in .toml.')
    check_new_file(path, option="--out FILE", force=options.force)
    robot = load_robot(options.robot)
    ids, known = _robot_ids(options, robot), models().get(robot.servo.name)
    if known is None and robot.servo.name in servo_names():
        # A servo of a file may be one of the models, under a name of its own.
        known = bus_servo(robot, options.robot)
    protocol = options.protocol or (known.protocol if known else 1)
    with _opened(options, options.baud or 1_000_000, protocol) as bus:
        rows = calibrate(bus, robot, ids, options.pose)
    save_calibration(path, rows, robot.name, force=options.force)
    say(
        f"Written to {plain(str(path))}. Let the robot stand up with this calibration:\n"
        f"  phasmid drive --bus {plain(options.port)} --robot {plain(options.robot)} "
        f"--calibration {plain(str(path))} --velocity 0,0,0"
    )
    return 0


def _robot_ids(options: argparse.Namespace, robot: Robot) -> list[int] | None:
    """Return the ids of the options for all servos of a robot, or None."""
    ids, count = _ids(options.ids), 3 * len(robot.legs)
    if ids is not None and len(ids) != count:
        raise InvalidInput(f"{robot.name} has {count} servos; --ids names {len(ids)}.")
    return ids


# Emulate ------------------------------------------------------------------------------------------


def _emulate(options: argparse.Namespace) -> int:
    """Emulate servos until Ctrl-C."""
    emulator, rows = emulator_of(options)
    with suppress(KeyboardInterrupt), emulator:
        say(f"The port is {emulator.port}\nCtrl-C ends it.")
        if rows:
            print_table(rows, right=(0, 2, 3))
        while True:
            time.sleep(1)
    say("phasmid: the bus is closed.")
    return 0


def emulator_of(options: argparse.Namespace) -> tuple[Emulator, Sequence[Sequence[str]]]:
    """Return the emulator of the options, and a table of a robot's servos."""
    baud, rows, plant = options.baud or 1_000_000, [], None
    if options.robot:
        from phasmid.hardware.plant import SimulatedRobot

        scenario = load_scenario("paper").for_robot(load_robot(options.robot))
        scenario = scenario.replace(start_posture="packed")
        robot = scenario.build().robot
        calibration = _calibration(options, robot)
        servos = [
            servo
            for r in calibration
            for servo in make_servos(r.model, [r.id], baud=baud, servo=robot.servo)
        ]
        plant = SimulatedRobot(scenario, calibration)
        rows = [["id", "joint", "offset", "range"]]
        rows += [
            [str(r.id), r.joint, str(r.homing_offset), f"{r.range_min} to {r.range_max}"]
            for r in calibration
        ]
    elif options.calibration:
        raise InvalidInput("--calibration needs the robot.", hint="--robot phantomx-ax")
    else:
        ids = _ids(options.ids) or range(1, 19)
        servos = make_servos(options.model or "AX-12A", ids, baud=baud)
    delay = servos[0].model.register("return_delay_time")
    microseconds = 500 if options.return_delay_us is None else options.return_delay_us
    for one in servos:
        one["return_delay_time"] = delay.from_si(1e-6 * microseconds)
    latency = 1.0 if options.latency_ms is None else options.latency_ms
    emulator = Emulator(
        servos, plant, latency=latency / 1000, faults=options.fault, seed=options.seed or 0
    )
    return emulator, rows


def bus_servo(robot: Robot, source: str) -> Model:
    """Return the model of a robot's servos.

    Args:
        robot: The robot.
        source: Its preset or file.

    Raises:
        InvalidInput: They have no bus, or one that phasmid does not know.
    """
    if robot.servo.name not in models():
        raise InvalidInput(
            f"the {servo_words(robot.servo.name)} of {robot.name} has no bus that phasmid knows, "
            f"which are those of {', '.join(models())}.",
            hint=f"phasmid export --robot {shlex.quote(plain(source))} --out walk.h",
        )
    return models()[robot.servo.name]


def _calibration(options: argparse.Namespace, robot: Robot) -> list[ServoCalibration]:
    """Return the calibration of the options: the file's, or the default one."""
    if not options.calibration:
        servo = options.model or bus_servo(robot, options.robot)
        return default_calibration(robot, servo, _robot_ids(options, robot))
    if options.ids or options.model:
        raise InvalidInput("--calibration gives the ids and models; --ids and --model must go.")
    return load_calibration(options.calibration, robot)
