"""``phasmid drive``: walk by commands or waypoints, in closed loop."""

from __future__ import annotations

import argparse
import math
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

from phasmid.cli import drive_bus, scenario_options, walk
from phasmid.cli.live import add_live_options
from phasmid.cli.options import Number, declare, refuse_given
from phasmid.cli.progress import announce_compilation
from phasmid.errors import InvalidInput

if TYPE_CHECKING:
    from phasmid.control import CommandScript
    from phasmid.learning import Policy
    from phasmid.scenario import Scenario

RATE = 200.0
"""Updates a second where no rate is given."""

WAYS = {
    "--velocity A,L,T": "go ahead and to the left [m/s] and turn to the left [rad/s], such as "
    "0.05,0,0.1",
    "--commands FILE": "commands over time, or waypoints: a .toml file",
    "--waypoints X,Y[,H];...": "places to go to, ahead and to the left of the start [m], with a "
    "heading [rad]; by the robot's true place, or with --body-state estimated by its estimate",
}
"""Options that command the drive; one of them is given."""

OPTIONS = {
    **scenario_options.OUT,
    "--policy FILE": "learned policy that controls the robot: an ONNX file, or one that comes with "
    "phasmid; its robot is driven unless --robot names another; default: the locomotion controller",
    "--rate N": Number("updates a second; default: 200, on a bus 50", 1, 100_000, hint="200"),
    **walk.REPORT_OPTIONS,
}


def run(options: argparse.Namespace) -> int:
    """Drive the robot, and return the exit status."""
    script = _script(options)
    policy = _policy(options)
    scenario = _lasting(scenario_options.scenario_of(options), options, script)
    if options.bus is None:
        refuse_given(options, ("calibration", "baud", "after_exit"), "needs --bus")
        scenario_options.print_idle(scenario.driven(), options, "a driven robot")
    else:
        return drive_bus.run(options, scenario, script, _words(options))
    from phasmid.simulation import Run, check_drive, new_drive

    faults, rate = options.fault or [], options.rate or RATE
    check_drive(scenario.driven(), rate=rate, faults=faults)

    def begin() -> Run:
        controller = None
        if policy is None:
            announce_compilation(quiet=options.quiet)
        else:
            from phasmid.learning import PolicyController

            controller = PolicyController(
                policy,
                scenario.build().robot,
                update_period=1 / rate,
                gravity=scenario.model.gravity,
            )
        return new_drive(scenario, controller, script, rate=rate, faults=faults)

    return walk.make_run(begin, scenario, options, _words(options))


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    declare(parser.add_mutually_exclusive_group(required=True), WAYS)
    parser.add_argument(
        "--fault",
        action="append",
        metavar="TEXT",
        help='what fails, such as "right_middle.tibia dead at 5 s", "gyro off by 0,0,5 deg/s at '
        '2 s", "left_front foot stuck at 1 s"; may be given again',
    )
    add_live_options(parser)
    drive_bus.add_bus_options(parser)
    scenario_options.scenario_options(parser)


def _words(options: argparse.Namespace) -> list[str]:
    """Return the parts of a result folder's name that are options of a drive."""
    commands = options.commands and Path(options.commands).stem
    given = {"velocity": options.velocity, "commands": commands, "waypoints": options.waypoints}
    words = ["drive", *(f"{way}-{value}" for way, value in given.items() if value)]
    if options.rate not in (None, RATE):
        words.append(f"rate-{options.rate:g}")
    if options.policy:
        words.append(f"policy-{Path(options.policy).stem}")
    return words + [f"fault-{fault}" for fault in options.fault or []]


def _policy(options: argparse.Namespace) -> Policy | None:
    """Return the policy of the options, whose robot is driven where the options name none."""
    if options.policy is None:
        return None
    from phasmid.learning import Policy

    policy = Policy(options.policy)
    fields = vars(options)
    if policy.task is not None and fields["field:robot"] is None:
        fields["field:robot"] = policy.task.robot
    return policy


def _script(options: argparse.Namespace) -> CommandScript:
    """Return the script of the options."""
    from phasmid.control import load_script

    if options.commands is not None:
        return load_script(options.commands)
    if options.velocity is not None:
        hint = "--velocity 0.05,0,0.1 (in m/s and rad/s)"
        return _parsed(
            "velocity", "command", [options.velocity], ("ahead", "left", "turn"), 3, hint
        )
    rows = [row for row in options.waypoints.split(";") if row.strip()]
    hint = '--waypoints "1,0;1,1" (in m)'
    return _parsed("waypoints", "waypoint", rows, ("x", "y", "heading"), 2, hint)


def _parsed(
    option: str, key: str, rows: list[str], names: tuple[str, ...], least: int, hint: str
) -> CommandScript:
    """Return the script of rows of numbers, refused under the name of the option."""
    from phasmid.control import CommandScript
    from phasmid.tables import dotted, validate

    entries = []
    for row in rows:
        values = [scenario_options.number_or_text(part) for part in row.split(",")]
        if any(isinstance(v, str) for v in values) or not least <= len(values) <= len(names):
            count = " or ".join(map(str, range(least, len(names) + 1)))
            what = f'--{option} has "{row}"; it must be {count} numbers with commas between.'
            raise InvalidInput(what, hint=hint)
        entries.append(dict(zip(names, values, strict=False)))

    def locate(loc: tuple[str | int, ...]) -> tuple[str, str]:
        place = f" {loc[1] + 1}" if loc[0] == "waypoint" and isinstance(loc[1], int) else ""
        return f"--{option}{place}: {dotted(loc[2:])}", ""

    try:
        return validate(CommandScript, {key: entries}, locate)
    except InvalidInput as error:
        error.hint = hint
        raise


def _lasting(scenario: Scenario, options: argparse.Namespace, script: CommandScript) -> Scenario:
    """Return the scenario with the duration of the options, or of the script."""
    if vars(options)["field:duration"] is not None:
        return scenario
    if script.duration is not None:
        return scenario.replace(duration=script.duration)
    if script.waypoint:
        places = [(0.0, 0.0), *((place.x, place.y) for place in script.waypoint)]
        way = sum(math.dist(a, b) for a, b in pairwise(places))
        turns = math.pi * len(script.waypoint) / script.follow.turn_speed
        # Three times what the commanded speeds need; the run ends at the last waypoint.
        return scenario.replace(duration=10 + 3 * (way / script.follow.speed + 2 * turns))
    last = script.command[-1].time
    return scenario if last < scenario.duration else scenario.replace(duration=last + 2.0)
