"""The command line's grammar: which commands there are, and which options they take."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from typing import Any, NoReturn

from phasmid.cli import (
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
    verify,
    walk,
)
from phasmid.errors import InvalidInput

COMMANDS = {
    "walk": "plan, analyse and simulate a walk; write its data, figures and summary",
    "drive": "walk by commands or to waypoints, in closed loop",
    "studio": "the live page: drive a robot in the browser and look into it",
    "report": "make the folder of a recording, or of the log of a run that was cut off",
    "plot": "draw figures of a run, or of several that are compared",
    "export": "write a recording as CSV, NetCDF or MCAP, for other programs",
    "replay": "run a recorded walk again and compare it bit by bit",
    "paper": "reproduce the paper: its figures, and a grade for each of its statements",
    "verify": "the physics against closed forms and conservation laws, on this machine",
    "cad": "a robot as solids (STEP), meshes and what they weigh; needs the extra cad",
    "check": "is this robot or scenario possible, and if not, why not",
    "gaits": "the gaits of a robot: who stands when, how they hold it, how fast they are",
    "convert": "write a robot in another format: TOML, URDF, MJCF, STEP",
    "doctor": "what this machine can do, and what to install for the rest",
}


class Parser(argparse.ArgumentParser):
    """An argument parser whose errors are ours."""

    def error(self, message: str) -> NoReturn:
        """Raise what argparse would print."""
        raise InvalidInput(f"{message}.", hint=f"{self.prog} --help")

    def _print_message(self, message: str, file: Any = None) -> None:
        # The inherited one is silent where nothing can be written.
        (file or sys.stderr).write(message)


def build_parser(command: str | None) -> Parser:
    """The parser; of the fields of a scenario it knows those that this command needs."""
    parser = Parser(
        prog="phasmid",
        description="Model, simulate and control walking robots.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and stop")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    walking = commands.add_parser(
        "walk",
        help=COMMANDS["walk"],
        description=f"{COMMANDS['walk']}.",
        usage="phasmid walk [SCENARIO] [--out DIR] [--force] [--FIELD VALUE ...]",
        allow_abbrev=False,
    )
    walking.set_defaults(run=walk.run)
    # The scenario's fields are looked up only where they are needed: it takes a while.
    if command == "walk":
        walk.add_options(walking)
    driving = commands.add_parser(
        "drive",
        help=COMMANDS["drive"],
        description=f"{COMMANDS['drive']}.",
        usage="phasmid drive [SCENARIO] --velocity A,L,T | --commands FILE | --waypoints X,Y;... "
        "[--FIELD VALUE ...]",
        allow_abbrev=False,
    )
    driving.set_defaults(run=drive.run)
    if command == "drive":
        drive.add_options(driving)
    showing = commands.add_parser(
        "studio",
        help=COMMANDS["studio"],
        description=f"{COMMANDS['studio']}.",
        usage="phasmid studio [SCENARIO] [--port N] [--no-open] [--FIELD VALUE ...]",
        allow_abbrev=False,
    )
    showing.set_defaults(run=studio.run)
    if command == "studio":
        studio.add_options(showing)
    for name, module in (
        ("report", report),
        ("plot", plot),
        ("export", export),
        ("replay", replay),
    ):
        reading = commands.add_parser(
            name, help=COMMANDS[name], description=f"{COMMANDS[name]}.", allow_abbrev=False
        )
        module.add_options(reading)
        reading.set_defaults(run=module.run)
    grading = commands.add_parser(
        "paper", help=COMMANDS["paper"], description=f"{COMMANDS['paper']}.", allow_abbrev=False
    )
    paper.add_options(grading)
    grading.set_defaults(run=paper.run)
    verifying = commands.add_parser(
        "verify", help=COMMANDS["verify"], description=f"{COMMANDS['verify']}.", allow_abbrev=False
    )
    verify.add_options(verifying)
    verifying.set_defaults(run=verify.run)
    drawing = commands.add_parser(
        "cad", help=COMMANDS["cad"], description=f"{COMMANDS['cad']}.", allow_abbrev=False
    )
    cad.add_options(drawing)
    drawing.set_defaults(run=cad.run)
    checking = commands.add_parser(
        "check", help=COMMANDS["check"], description=f"{COMMANDS['check']}.", allow_abbrev=False
    )
    check.add_options(checking)
    checking.set_defaults(run=check.run)
    pacing = commands.add_parser(
        "gaits", help=COMMANDS["gaits"], description=f"{COMMANDS['gaits']}.", allow_abbrev=False
    )
    gaits.add_options(pacing)
    pacing.set_defaults(run=gaits.run)
    converting = commands.add_parser(
        "convert",
        help=COMMANDS["convert"],
        description=f"{COMMANDS['convert']}.",
        allow_abbrev=False,
    )
    convert.add_options(converting)
    converting.set_defaults(run=convert.run)
    examining = commands.add_parser(
        "doctor", help=COMMANDS["doctor"], description=f"{COMMANDS['doctor']}.", allow_abbrev=False
    )
    doctor.add_options(examining)
    examining.set_defaults(run=doctor.run)
    return parser


class _Version(argparse.Action):
    def __call__(self, *_: Any, **__: Any) -> None:
        import phasmid

        print(f"phasmid {phasmid.__version__}")
        sys.exit(0)


def flags(parser: argparse.ArgumentParser) -> Iterator[str]:
    """All options of a parser and of its commands."""
    for action in parser._actions:
        yield from action.option_strings
        if isinstance(action, argparse._SubParsersAction):
            for inner in action.choices.values():
                yield from flags(inner)


def join_negative_numbers(arguments: list[str]) -> list[str]:
    """Join ``--option -1e-3`` or ``--option -10,0``, which argparse would take for two options."""
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
