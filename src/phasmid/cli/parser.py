"""Commands and options of the command line."""

from __future__ import annotations

import argparse
import re
import shutil
import sys
import textwrap
from collections.abc import Iterator
from importlib import import_module
from typing import Any, NoReturn

from phasmid.cli.options import declare
from phasmid.errors import InvalidInput

GROUPS = {
    "Walk": {
        "walk": "plan, analyse and simulate a walk; write its data, figures and summary",
        "drive": "drive a robot by commands or to waypoints, simulated or on a servo bus",
        "studio": "open the live page: drive a robot in the browser and inspect it",
        "study": "make many runs of a varied scenario, one row of numbers for each (extra study)",
        "replay": "repeat a recorded walk and compare it bit by bit",
    },
    "Results": {
        "report": "make the result folder, figures or video of recordings",
        "export": "write a recording, robot or walk in another format: CSV, URDF, STEP, C, ...",
    },
    "Robot and servos": {
        "check": "say whether a robot, walk, posture or foot position is possible, and why not",
        "advise": "compute load, heat and battery time of the servos, and compare other servos",
        "gaits": "list the gaits of a robot with support margins and largest speeds",
        "identify": "fit a servo to logs of a bench or a robot, or compare a log with simulation",
        "bus": "list, watch or calibrate servos on a serial port, or emulate them (extra hardware)",
    },
    "About": {
        "paper": "reproduce the paper: its figures, and a grade for each of its statements",
        "doctor": "list what this machine supports, and how to install the rest",
    },
}
"""Commands with their purpose, by subject."""

COMMANDS = {name: words for group in GROUPS.values() for name, words in group.items()}

USAGES = {
    "bus": "bus scan PORT\n       phasmid bus monitor PORT\n"
    "       phasmid bus calibrate PORT --robot ROBOT [--out FILE]\n"
    "       phasmid bus emulate [--robot ROBOT] [--calibration FILE] [--fault FAULT ...]",
    "walk": "walk [SCENARIO] [--out DIR] [--force] [--FIELD VALUE ...]",
    "drive": "drive [SCENARIO] --velocity A,L,T [--FIELD VALUE ...]\n"
    "       phasmid drive [SCENARIO] --commands FILE [--FIELD VALUE ...]\n"
    "       phasmid drive [SCENARIO] --waypoints X,Y;... [--FIELD VALUE ...]",
    "check": "check [SCENARIO] [--robot ROBOT] [--FIELD VALUE ...]\n"
    "       phasmid check [--robot ROBOT] --foot-at LEG X,Y,Z\n"
    "       phasmid check [--robot ROBOT] --pose X,Y,Z [--rpy-deg R,P,Y]",
    "advise": "advise [SCENARIO] [--robot ROBOT] [--servo NAME] [--FIELD VALUE ...]",
    "gaits": "gaits [SCENARIO] [--robot ROBOT] [--gait GAIT] [--FIELD VALUE ...]",
    "export": "export RECORDING [--out FILE]\n"
    "       phasmid export [SCENARIO] [--robot ROBOT] [--FIELD VALUE ...] --out FILE",
    "report": "report RECORDING [--out DIR] [--force] [--video FILE]\n"
    "       phasmid report RECORDING... --figures NAMES [--out DIR] [--format svg,png,pdf]",
    "studio": "studio [SCENARIO] [--port N] [--no-open] [--FIELD VALUE ...]",
    "identify": "identify LOG... --mass-g G --length-mm MM [--servo NAME] [--model MODEL]\n"
    "       phasmid identify LOG... --robot ROBOT [--leg NAMES] [--model MODEL]\n"
    "       phasmid identify LOG --compare [--robot ROBOT] [--scenario SCENARIO]",
}

REMOVED = {
    "demo": "walk --open",
    "plot": "report --figures",
    "explain": "check",
    "convert": "export",
    "cad": "export --out cad",
    "live": "drive --live",
    "video": "report --video walk.mp4",
    "export-firmware": "export --out walk.h",
    "compare": "identify --compare",
    "verify": "paper, or make test ARGS=tests/physics in a clone",
}
"""Commands of earlier versions, and the commands in their place."""


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


class _Help(argparse.RawDescriptionHelpFormatter):
    """Help without a list of the commands, which the description has by subject."""

    def add_argument(self, action: argparse.Action) -> None:
        if not isinstance(action, argparse._SubParsersAction):
            super().add_argument(action)


def build_parser(command: str | None) -> Parser:
    """Return the parser, with the options of one command."""
    parser = Parser(
        prog="phasmid",
        usage="phasmid COMMAND [--help] ...",
        description=_description() if command is None else "",
        formatter_class=_Help,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and stop")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    for name, words in COMMANDS.items():
        usage = f"phasmid {USAGES[name]}" if name in USAGES else None
        inner = commands.add_parser(
            name, prog=f"phasmid {name}", description=f"{words}.", usage=usage, allow_abbrev=False
        )
        # The fields of a scenario take a while to look up.
        if name == command:
            module = import_module(f"phasmid.cli.{name}")
            inner.set_defaults(run=module.run)
            declare(inner, module.OPTIONS)
            if hasattr(module, "add_options"):
                module.add_options(inner)
    return parser


def _description() -> str:
    """Return the commands by subject, as wide as the terminal."""
    width, indent = shutil.get_terminal_size().columns - 2, 12
    lines = ["Model, simulate and control legged robots."]
    for title, commands in GROUPS.items():
        lines += ["", f"{title}:"]
        for name, words in commands.items():
            head = f"  {name}".ljust(indent)
            lines.append(
                textwrap.fill(
                    words, max(width, 40), initial_indent=head, subsequent_indent=indent * " "
                )
            )
    return "\n".join(lines)


class _Version(argparse.Action):
    def __call__(self, *_: Any, **__: Any) -> None:
        import phasmid

        print(f"phasmid {phasmid.__version__}")
        sys.exit(0)


def flags(parser: argparse.ArgumentParser, *, switches: bool = False) -> Iterator[str]:
    """Yield all options of a parser and of its commands; or those alone that take no value."""
    for action in parser._actions:
        if action.nargs == 0 or not switches:
            yield from action.option_strings
        if isinstance(action, argparse._SubParsersAction):
            for inner in action.choices.values():
                yield from flags(inner, switches=switches)
