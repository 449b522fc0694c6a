"""Commands and options of the command line."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator
from importlib import import_module
from typing import Any, NoReturn

from phasmid.cli.options import declare
from phasmid.errors import InvalidInput

COMMANDS = {
    "demo": "simulate the paper's walk with a video and open its report: the command to try first",
    "walk": "plan, analyse and simulate a walk; write its data, figures and summary",
    "drive": "walk by commands or to waypoints, in closed loop",
    "studio": "open the live page: drive a robot in the browser and inspect it",
    "study": "make many runs of a varied scenario, one row of numbers for each (extra study)",
    "report": "make the result folder of a recording, or of the log of an interrupted run",
    "plot": "draw figures of one run, or compare several",
    "export": "write a recording as CSV, NetCDF or MCAP",
    "compare": "compare a robot's log with the replay of its joint targets in simulation",
    "replay": "repeat a recorded walk and compare it bit by bit",
    "paper": "reproduce the paper: its figures, and a grade for each of its statements",
    "cad": "write a robot as solids (STEP) and meshes (extra cad)",
    "check": "check whether a robot or scenario is physically possible",
    "explain": "say why a foot position, posture or walk is impossible, and the nearest possible",
    "advise": "compute load, heat and battery time of the servos, and compare other servos",
    "identify": "fit a servo's motor, friction and law to logs of a bench or a leg",
    "gaits": "list the gaits of a robot with support margins and largest speeds",
    "convert": "write a robot in another format: TOML, URDF, MJCF, STEP",
    "export-firmware": "write leg kinematics and gait as a C header for microcontrollers",
    "bus": "list, watch or calibrate servos on a serial port, or emulate them (extra hardware)",
    "doctor": "list what this machine supports, and how to install the rest",
}

USAGES = {
    "bus": "phasmid bus scan PORT | monitor PORT | calibrate PORT --robot ROBOT [--out FILE] | "
    "emulate [--robot ROBOT] [--calibration FILE] [--fault FAULT ...]",
    "walk": "phasmid walk [SCENARIO] [--out DIR] [--force] [--FIELD VALUE ...]",
    "drive": "phasmid drive [SCENARIO] --velocity A,L,T | --commands FILE | --waypoints X,Y;... "
    "[--FIELD VALUE ...]",
    "explain": "phasmid explain [SCENARIO] [--foot-at LEG X,Y,Z | --pose X,Y,Z --rpy-deg R,P,Y] "
    "[--out FILE] [--FIELD VALUE ...]",
    "studio": "phasmid studio [SCENARIO] [--port N] [--no-open] [--FIELD VALUE ...]",
    "export-firmware": "phasmid export-firmware [SCENARIO] [--out FILE] [--FIELD VALUE ...]",
}


class Parser(argparse.ArgumentParser):
    """Argument parser that raises `InvalidInput`."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        # Numbers such as -1e-3, lists such as -10,0 and axes such as -x are values, not options.
        self._negative_number_matcher = re.compile(r"-([0-9.]|[xy]$)")

    def error(self, message: str) -> NoReturn:
        """Raise the message that argparse prints."""
        raise InvalidInput(f"{message}.", hint=f"{self.prog} --help")

    def _print_message(self, message: str, file: Any = None) -> None:
        # The inherited method ignores a closed stream.
        (file or sys.stderr).write(message)


def build_parser(command: str | None) -> Parser:
    """Return the parser, with the options of one command."""
    parser = Parser(
        prog="phasmid",
        description="Model, simulate and control legged robots.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and stop")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    for name, words in COMMANDS.items():
        inner = commands.add_parser(
            name,
            help=words,
            description=f"{words}.",
            usage=USAGES.get(name),
            allow_abbrev=False,
        )
        # The fields of a scenario take a while to look up.
        if name == command:
            module = import_module(f"phasmid.cli.{name.replace('-', '_')}")
            inner.set_defaults(run=module.run)
            declare(inner, module.OPTIONS)
            if hasattr(module, "add_options"):
                module.add_options(inner)
    return parser


class _Version(argparse.Action):
    def __call__(self, *_: Any, **__: Any) -> None:
        import phasmid

        print(f"phasmid {phasmid.__version__}")
        sys.exit(0)


def flags(parser: argparse.ArgumentParser) -> Iterator[str]:
    """Yield all options of a parser and of its commands."""
    for action in parser._actions:
        yield from action.option_strings
        if isinstance(action, argparse._SubParsersAction):
            for inner in action.choices.values():
                yield from flags(inner)


def switches(parser: argparse.ArgumentParser) -> Iterator[str]:
    """Yield those options of a parser and of its commands that take no value."""
    for action in parser._actions:
        if action.nargs == 0:
            yield from action.option_strings
        if isinstance(action, argparse._SubParsersAction):
            for inner in action.choices.values():
                yield from switches(inner)
