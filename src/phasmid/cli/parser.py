"""Commands and options of the command line."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from typing import Any, NoReturn

from phasmid.cli import (
    advise,
    cad,
    check,
    convert,
    doctor,
    drive,
    export,
    gaits,
    paper,
    plot,
    replay,
    report,
    studio,
    study,
    verify,
    walk,
)
from phasmid.errors import InvalidInput

COMMANDS = {
    "walk": "plan, analyse and simulate a walk; write its data, figures and summary",
    "drive": "walk by commands or to waypoints, in closed loop",
    "studio": "open the live page: drive a robot in the browser and inspect it",
    "study": "make many runs of a varied scenario, one row of numbers for each (extra study)",
    "report": "make the result folder of a recording, or of the log of an interrupted run",
    "plot": "draw figures of one run, or compare several",
    "export": "write a recording as CSV, NetCDF or MCAP",
    "replay": "repeat a recorded walk and compare it bit by bit",
    "paper": "reproduce the paper: its figures, and a grade for each of its statements",
    "verify": "check the physics against closed forms and conservation laws",
    "cad": "write a robot as solids (STEP) and meshes, with their masses (extra cad)",
    "check": "check whether a robot or scenario is physically possible",
    "advise": "do these servos hold a robot, how warm and how long, and which others do",
    "gaits": "list the gaits of a robot with support margins and largest speeds",
    "convert": "write a robot in another format: TOML, URDF, MJCF, STEP",
    "doctor": "list what this machine supports, and how to install the rest",
}

MODULES = {
    "walk": walk,
    "drive": drive,
    "studio": studio,
    "study": study,
    "report": report,
    "plot": plot,
    "export": export,
    "replay": replay,
    "paper": paper,
    "verify": verify,
    "cad": cad,
    "check": check,
    "advise": advise,
    "gaits": gaits,
    "convert": convert,
    "doctor": doctor,
}

USAGES = {
    "walk": "phasmid walk [SCENARIO] [--out DIR] [--force] [--FIELD VALUE ...]",
    "drive": "phasmid drive [SCENARIO] --velocity A,L,T | --commands FILE | --waypoints X,Y;... "
    "[--FIELD VALUE ...]",
    "studio": "phasmid studio [SCENARIO] [--port N] [--no-open] [--FIELD VALUE ...]",
}


class Parser(argparse.ArgumentParser):
    """Argument parser that raises `InvalidInput`."""

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
    for name, module in MODULES.items():
        inner = commands.add_parser(
            name,
            help=COMMANDS[name],
            description=f"{COMMANDS[name]}.",
            usage=USAGES.get(name),
            allow_abbrev=False,
        )
        inner.set_defaults(run=module.run)
        # The fields of a scenario take a while to look up.
        if name == command:
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


def join_negative_numbers(arguments: list[str]) -> list[str]:
    """Join ``--option -1e-3`` or ``--option -10,0``, which argparse reads as two options."""
    joined: list[str] = []
    for argument in arguments:
        option = joined[-1] if joined else ""
        if argument.startswith("-") and option.startswith("--") and "=" not in option:
            try:
                float(argument.split(",")[0])
            except ValueError:
                pass
            else:
                joined[-1] = f"{option}={argument}"
                continue
        joined.append(argument)
    return joined
