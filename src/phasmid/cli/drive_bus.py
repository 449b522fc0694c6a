"""``phasmid drive --bus``: a controller moves a robot on a servo bus."""

from __future__ import annotations

import argparse
import math
import os
import select
import shlex
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from phasmid.cli.live import check_live, served_driver
from phasmid.cli.options import Number, declare
from phasmid.cli.output import print_table, say
from phasmid.cli.result_folder import log_of, result_folder
from phasmid.errors import InvalidInput, PhasmidError, plain

if TYPE_CHECKING:
    from phasmid.control import CommandScript
    from phasmid.experiment import Controller
    from phasmid.hardware import Driver, DriveReport, ServoCalibration
    from phasmid.robot import Robot
    from phasmid.scenario import Scenario

EMULATED = "emulated"
"""Name of the port that stands for an emulated robot."""

EMULATE = """import sys
from phasmid.parent_death import end_with_parent
end_with_parent(int(sys.argv[1]))
from phasmid.cli import main
sys.exit(main(sys.argv[2:]))
"""
"""Program of the emulated robot, which ends with this process."""

BAUD = 1_000_000
"""Baud rate where none is given."""

RATE = 50.0
"""Updates a second where no rate is given."""

SIT_KEYS, LIMP_KEYS = (b"q", b"Q", b"\x1b", b"\x1a"), (b" ",)
"""Keys that let the robot sit down (q, Escape, Ctrl-Z), and go limp at once (the space bar)."""

OPTIONS: dict[str, str | tuple[str, str] | Number] = {
    "--bus PORT": "drive a robot on this port, such as /dev/ttyUSB0, in place of the simulated "
    "one; emulated: an emulated robot",
    "--calibration FILE": "its servos, from phasmid bus calibrate; an emulated robot needs none: "
    "its ids count leg by leg from 1, the middle of each servo at the middle of its joint's limits",
    "--baud N": Number(
        "baud rate; default: 1000000", 1_000, 10_000_000, is_whole=True, hint="1000000"
    ),
}


def add_bus_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of a robot on a bus."""
    group = parser.add_argument_group("robot on a servo bus (extra hardware)")
    declare(group, OPTIONS)
    group.add_argument(
        "--after-exit",
        choices=("limp", "hold"),
        help="what the servos do if this program is killed: go limp after 2 s, or hold; "
        "default: limp",
    )


def run(
    options: argparse.Namespace, scenario: Scenario, script: CommandScript, words: Sequence[str]
) -> int:
    """Drive the robot on the bus; return the exit status.

    Args:
        options: Those of the command line.
        scenario: The scenario with its duration of walking.
        script: The commands.
        words: Parts of the log's name.
    """
    from phasmid.hardware import Bus, Driver, DriverSettings, RobotBus, inspect_servos
    from phasmid.recording.file import check_place
    from phasmid.recording.log import check_log

    _refuse(options)
    check_live(options)
    robot = scenario.build().robot
    script.check_legs(len(robot.legs))
    rate = options.rate or RATE
    calibration = _calibration(options, robot)
    log = result_folder(options, scenario, [*words, "bus"])
    if log.suffix != ".mcap":
        log = log_of(log)
    check_log(log, force=options.force)
    check_place(log)
    with ExitStack() as stack:
        port = options.bus
        if port == EMULATED:
            port = stack.enter_context(_emulated(options, scenario, calibration))
        protocol = _protocol(calibration)
        bus = stack.enter_context(Bus(port, options.baud or BAUD, protocol))
        found = inspect_servos(bus, robot, calibration, rate)
        if not options.quiet:
            _print_inspection(found.rows, found.notes)
        if found.refusals:
            raise InvalidInput(
                f"the robot on {plain(options.bus)} does not start: {found.refusals[0]}"
                + (
                    f" {len(found.refusals) - 1} more: {' '.join(found.refusals[1:3])}"
                    if found.refusals[1:]
                    else ""
                ),
                hint="phasmid bus monitor, or phasmid bus calibrate",
            )
        driver = Driver(
            RobotBus(bus, robot, calibration),
            scenario,
            _controller(options, scenario, rate),
            script,
            rate=rate,
            settings=DriverSettings(after_exit=options.after_exit or "limp"),
            log=log,
            force=options.force,
        )
        if not options.quiet:
            say(f"The robot stands up, walks for {scenario.duration:g} s and sits down.")
            if sys.stdin.isatty():
                say("q, Escape or Ctrl-C: sit down.")
                say("Space or a second Ctrl-C: torque off at once; the robot falls.")
                if port == options.bus:
                    say("Compare the angles above with the robot, then press Enter.")
                    input()
            driver.on_event = print_event
        with stop_keys(driver), served_driver(driver, options):
            try:
                report = driver.drive(scenario.duration)
            except Exception as error:
                _print_unconfirmed(driver.report)
                if driver.report.unconfirmed and isinstance(error, PhasmidError):
                    error.exit_status = 3
                raise
    if not options.quiet:
        _print_report(report, rate)
        if log.exists():
            say(f"\nWritten to {plain(str(log))}; compare with the simulation:")
            say(f"  phasmid identify --compare {plain(str(log))}")
    if report.ending is None:
        return 0
    say(f"phasmid: {report.ending.sentence}", file=sys.stderr)
    return 130 if report.ending.ending.name == "STOPPED" else 3


UNKNOWN = {
    "waypoints": "measures no place for waypoints",
    "policy": "has no inertial sensor for a policy",
    "fault": "has no --fault; an emulated port has its own",
    "video": "has no --video",
    "live_pace": "has its own pace",
    "mcap": "has no --mcap; its log is one",
    "open": "has no page; phasmid report makes one of its log",
    "legs": "has no --legs; phasmid report has it",
    "no_figures": "has no figures",
}
"""Options that a robot on a bus does not have, with the reason."""


def _refuse(options: argparse.Namespace) -> None:
    """Refuse options that a robot on a bus does not have."""
    velocity = "--velocity 0.05,0,0 in place of --waypoints"
    hints = {"waypoints": velocity, "policy": "phasmid.hardware.Driver with `sensors`"}
    for name, reason in UNKNOWN.items():
        if getattr(options, name, None):
            hint = hints.get(name, f"without --{name.replace('_', '-')}")
            raise InvalidInput(f"a robot on a bus {reason}.", hint=hint)


def _calibration(options: argparse.Namespace, robot: Robot) -> list[ServoCalibration]:
    """Return the calibration of the options, or the default one of the robot's servo."""
    from phasmid.cli.bus import bus_servo
    from phasmid.hardware import default_calibration, load_calibration

    if options.calibration:
        return load_calibration(options.calibration, robot)
    if options.bus != EMULATED:
        raise InvalidInput(
            f"--bus {plain(options.bus)} needs --calibration: without one, joints turn to wrong "
            "angles.",
            hint=f"phasmid bus calibrate {plain(options.bus)} --robot "
            f"{shlex.quote(plain(vars(options)['field:robot'] or robot.name))}",
        )
    source = vars(options)["field:robot"] or robot.name
    return default_calibration(robot, bus_servo(robot, source))


def _protocol(calibration: Sequence[ServoCalibration]) -> int:
    """Return the protocol of the first servo's model."""
    from phasmid.hardware import model

    return model(calibration[0].model).protocol


@contextmanager
def _emulated(
    options: argparse.Namespace, scenario: Scenario, calibration: Sequence[ServoCalibration]
) -> Iterator[str]:
    """Run an emulated robot in another process; yield its port."""
    command = [sys.executable, "-P", "-c", EMULATE, str(os.getpid()), "bus", "emulate"]
    command += ["--baud", str(options.baud or BAUD), "--return-delay-us", "0"]
    command += ["--model", calibration[0].model]
    if options.calibration:
        command += ["--calibration", str(options.calibration)]
    with (
        tempfile.TemporaryDirectory() as folder,
        tempfile.TemporaryFile("w+", encoding="utf-8") as errors,
        subprocess.Popen(  # noqa: S603
            [*command, "--robot", _saved(scenario.base_robot(), Path(folder))],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
            start_new_session=True,
        ) as process,
    ):
        assert process.stdout is not None
        try:
            first = process.stdout.readline()
            if not first.startswith("The port is "):
                process.wait()
                errors.seek(0)
                reason = plain(errors.read().strip().removeprefix("phasmid: "))
                raise InvalidInput(f"the emulated robot did not start: {reason}")
            yield first.removeprefix("The port is ").strip()
        finally:
            # A process that was stopped does not end otherwise.
            process.kill()


def _saved(robot: Robot, folder: Path) -> str:
    """Write a robot, which may have another servo than its file, and return the file's name."""
    from phasmid.robot import robot_to_toml

    path = folder / "robot.toml"
    path.write_text(robot_to_toml(replace(robot, appearance=None)), encoding="utf-8")
    return str(path)


def _controller(options: argparse.Namespace, scenario: Scenario, rate: float) -> Controller:
    """Return the locomotion controller."""
    from phasmid.cli.progress import announce_compilation
    from phasmid.simulation.drive import scenario_controller

    announce_compilation(quiet=options.quiet)
    # Servos measure no contact of the feet.
    return scenario_controller(scenario, rate, ground_sensing=False)


def _print_inspection(rows: Sequence[Sequence[str]], notes: Sequence[str]) -> None:
    from phasmid.hardware.inspection import HEADER

    print_table([HEADER, *rows], right=(1, 3, 4, 5))
    for note in notes:
        say(f"note: {plain(note)}")


def _print_report(report: DriveReport, rate: float) -> None:
    """Print what happened during the drive."""
    rows = [
        ["walked", f"{report.walked:.1f} s"],
        [
            "updates",
            f"{report.ticks} at {rate:g} Hz, {report.late} of them more than 5 ms late, "
            f"{1000 * report.worst_delay:.0f} ms at most",
        ],
        [
            "answers",
            f"{report.answers}, {report.lost} lost or damaged; each servo read "
            f"{report.reading_rate:.0f} times a second",
        ],
        [
            "warmest servo",
            f"{report.hottest:.0f} °C measured, {report.hottest_predicted:.0f} °C computed",
        ],
    ]
    if math.isfinite(report.lowest_voltage):
        rows.append(["lowest supply", f"{report.lowest_voltage:.1f} V"])
    say()
    print_table(rows)


def _print_unconfirmed(report: DriveReport) -> None:
    """Print which servos have not confirmed that their torque is off, before an error is."""
    if report.unconfirmed and report.ending is not None:
        say(f"phasmid: {report.ending.sentence}", file=sys.stderr)


def print_event(time: float, sentence: str) -> None:
    """Print an event of the drive at its time [s]."""
    # A robot must not fall because its terminal or the reader of a pipe is gone.
    with suppress(OSError):
        say(f"{time:6.1f} s  {plain(sentence)}")


@contextmanager
def stop_keys(driver: Driver) -> Iterator[None]:
    """Stop the robot at a key, where the standard input is a terminal."""
    if not sys.stdin.isatty():
        yield
        return
    import termios
    import tty

    from phasmid.hardware import Reaction

    ended, number = threading.Event(), sys.stdin.fileno()

    def listen() -> None:
        while not ended.is_set():
            if select.select([number], [], [], 0.02)[0]:
                key = b""
                with suppress(OSError):
                    key = os.read(number, 1)
                if key in LIMP_KEYS:
                    driver.stop(Reaction.LIMP)
                elif key in SIT_KEYS:
                    driver.stop(Reaction.SIT)
                elif not key:
                    # The terminal is gone; SIGHUP lets the robot sit down.
                    return

    before = termios.tcgetattr(number)
    thread = threading.Thread(target=listen, name="keys", daemon=True)
    try:
        tty.setcbreak(number)
        # Ctrl-Z and Ctrl-S would stop the driver under a robot that stands.
        mode = termios.tcgetattr(number)
        mode[0] &= ~termios.IXON
        mode[6][termios.VSUSP] = bytes([os.fpathconf(number, "PC_VDISABLE")])
        termios.tcsetattr(number, termios.TCSADRAIN, mode)
        thread.start()
        yield
    finally:
        ended.set()
        if thread.is_alive():
            thread.join()
        with suppress(termios.error):
            termios.tcsetattr(number, termios.TCSADRAIN, before)
