"""Options of commands with a scenario: the scenario, its robot, and each field."""

from __future__ import annotations

import argparse
import math
import shlex
import string
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args, get_origin

from phasmid.cli.output import say
from phasmid.errors import InvalidInput, plain

if TYPE_CHECKING:
    from phasmid.scenario import Scenario

PLACES = {"robot", "height_map"}
"""Fields that name a file."""

COMMANDS = ("walk", "drive", "studio", "check", "advise", "gaits", "export")
"""Commands with these options."""

SCENARIO = (
    "a scenario: a preset or a file; default: {}, of another --robot with the period and "
    "the contact that follow its size and weight"
)
GROUPS = {
    "": "fields of the scenario; each option replaces a value of it",
    "robot_import": "reading URDF, MJCF and STEP",
}
"""Titles of groups of options."""

OUT = {
    "--out DIR": "result folder; default: results/NAME, where NAME has the scenario and the "
    "options, and a number where a run of that name exists"
}

TEXTS = {
    "name",
    "description",
    "gait",
    "terrain",
    "servo",
    "foot",
    "masses",
    "servo_model",
    "package",
}
"""Fields whose value is text, also where it looks like a number."""


def scenario_options(
    parser: argparse.ArgumentParser, words: str = SCENARIO.format("paper"), name: str = "SCENARIO"
) -> None:
    """Add the scenario and each of its fields.

    Args:
        parser: Parser of the command.
        words: Help of the scenario.
        name: Its placeholder.
    """
    from phasmid.gait import GAITS
    from phasmid.robot import preset_names
    from phasmid.scenario import option_keys

    parser.add_argument("scenario", nargs="?", metavar=name, help=words)
    groups: dict[str, argparse._ArgumentGroup] = {}
    for key, path in option_keys().items():
        words = _help_of(path)
        if key == "robot":
            words = f"a preset ({', '.join(preset_names())}) or a file"
        elif key == "gait":
            words = "; ".join(f"{', '.join(gaits)} of {n} legs" for n, gaits in GAITS.items())
            words += "; alternating, wave, ripple of others; or a gait file (.toml)"
        table = path[0] if len(path) > 1 else ""
        if table not in groups:
            title = GROUPS.get(table, f"[{table}] of the scenario")
            groups[table] = parser.add_argument_group(title)
        groups[table].add_argument(
            _flag(key), dest=f"field:{key}", metavar=_metavar(path), help=words
        )
    groups["robot_import"].add_argument(
        "--strict", action="store_true", help="refuse a file of which something is ignored"
    )


def _flag(key: str) -> str:
    return f"--{key.replace('_', '-')}"


def _table_of(path: tuple[str, ...]) -> Any:
    from phasmid.scenario.scenario import Scenario

    table: Any = Scenario
    for part in path[:-1]:
        table = table.model_fields[part].annotation
    return table


def _metavar(path: tuple[str, ...]) -> str:
    from phasmid.tables import choices

    words = "|".join(choices(_table_of(path).model_fields[path[-1]]))
    return words or _list_form(path) or "VALUE"


def _help_of(path: tuple[str, ...]) -> str:
    """Return the description of a field, in the unit of its option."""
    from phasmid import units
    from phasmid.tables import field_help, quantity

    table = _table_of(path)
    carried = quantity(table.model_fields[path[-1]])
    text = field_help(table, path[-1]).replace("%", "%%")
    if carried:
        si, shown = units.SI[carried.dimension].symbol, units.UNITS[carried.unit].symbol
        text = text.replace(f"[{si}]", f"[{shown}]")
    return text


def scenario_of(options: argparse.Namespace, default: str | None = "paper") -> Scenario:
    """Return the scenario of the options, its robot read.

    Args:
        options: Those of the command line.
        default: Scenario where none is named; None: one with the defaults of each field.
    """
    scenario = scenario_as_named(options, default)
    source = scenario.robot
    from phasmid.formats import Severity, import_robot, is_foreign, possible
    from phasmid.scenario import option_keys

    # Options of reading are refused for a robot that is not imported.
    reads = any(option_keys()[key][0] == "robot_import" for key in given_fields(options))
    if isinstance(source, str) and (reads or is_foreign(source)):
        imported = import_robot(source, scenario.robot_import, strict=options.strict)
        scenario = scenario.replace(robot=possible(imported, source))
        notes = [f for f in imported.findings if f.severity is Severity.NOTE]
        for finding in () if options.quiet else imported.findings:
            if finding.severity is not Severity.NOTE:
                say(f"phasmid: {plain(finding.sentence)}", file=sys.stderr)
        if notes and not options.quiet:
            command = f"phasmid check --robot {plain(str(source))}"
            say(f"phasmid: {len(notes)} notes on the robot; {command} lists them.", file=sys.stderr)
    return scenario


def scenario_as_named(options: argparse.Namespace, default: str | None = "paper") -> Scenario:
    """Return the scenario of the options; a robot file that it names is not read."""
    from phasmid.scenario import Scenario, load_scenario

    source, robot = options.scenario, given_fields(options).get("robot")
    if source is not None:
        _refuse_robot(source)
    name = default if source is None else source
    scenario = Scenario() if name is None else load_scenario(name, read_robot=False)
    if source is None and robot is not None:
        scenario = scenario.for_robot(robot)
    return with_fields(scenario, options, source or "")


def print_idle(scenario: Scenario, options: argparse.Namespace, use: str) -> None:
    """Print a note on each field of a scenario without effect on its use.

    Fields of a preset that the user has not named are left out.
    """
    from phasmid.scenario import idle_fields, scenario_names

    is_own = options.scenario not in (None, *scenario_names())
    for sentence in () if options.quiet else idle_fields(scenario, use=use):
        if is_own or sentence.split()[0] in given_fields(options):
            say(f"phasmid: note: {plain(sentence)}", file=sys.stderr)


def _refuse_robot(source: str) -> None:
    """Refuse a robot or a gait in place of a scenario.

    Raises:
        InvalidInput: It is one.
    """
    from phasmid.gait import GAIT_NAMES
    from phasmid.robot import preset_names
    from phasmid.toml import is_file, read_toml

    kinds = {"robot": source in preset_names(), "gait": source in GAIT_NAMES}
    if source.endswith(".toml") and is_file(Path(source)):
        keys = set(read_toml(Path(source))[0])
        kinds = {"robot": bool({"legs", "leg", "body"} & keys), "gait": "offsets" in keys}
    for kind in (kind for kind, is_one in kinds.items() if is_one):
        raise InvalidInput(
            f"{plain(source)} is a {kind}, no scenario.",
            hint=f"--{kind} {shlex.quote(plain(source))}",
        )


def with_fields(scenario: Scenario, options: argparse.Namespace, file: str = "") -> Scenario:
    """Return a scenario with the fields of the options.

    Args:
        scenario: The scenario.
        options: Those of the command line.
        file: File of the scenario, for messages.

    Raises:
        InvalidInput: A value is refused, under the name of its option.
    """
    from phasmid.scenario import option_keys
    from phasmid.tables import dotted

    given = given_fields(options)
    flags = {option_keys()[key]: _flag(key) for key in given}

    def locate(loc: tuple[str | int, ...]) -> tuple[str, str]:
        for path, flag in flags.items():
            if loc[: len(path)] == path:
                return flag + dotted(loc[len(path) :]), ""
        return dotted(loc), file

    return scenario.changed({key: _value(key, text) for key, text in given.items()}, locate)


def given_fields(options: argparse.Namespace) -> dict[str, str]:
    """Return the fields that are given as options, by their keys."""
    return {
        key.removeprefix("field:"): value
        for key, value in vars(options).items()
        if key.startswith("field:") and value is not None
    }


def field_arguments(options: argparse.Namespace) -> list[str]:
    """Return the fields that are given as options, as arguments of a command."""
    fields = given_fields(options).items()
    return [word for key, value in fields for word in (_flag(key), value)]


def _value(key: str, text: str) -> Any:
    """Return the text of an option as a number, a list of numbers, or text."""
    from phasmid.scenario import option_keys

    form = _list_form(option_keys()[key])
    if form.endswith("...") and not text:
        return []
    if form.endswith(";..."):
        return [[number_or_text(part) for part in row.split(",")] for row in text.split(";")]
    if form.endswith(",...") or (form and "," in text):
        return [number_or_text(part) for part in text.split(",")]
    return text if key in {*PLACES, *TEXTS} else number_or_text(text)


def _list_form(path: tuple[str, ...]) -> str:
    """Return the form of a list field as an option; empty for others."""
    pending = [_table_of(path).model_fields[path[-1]].annotation]
    while pending:
        kind = pending.pop()
        parts = get_args(kind)
        if get_origin(kind) is tuple:
            if parts[-1] is not Ellipsis:
                return ",".join(string.ascii_uppercase[: len(parts)])
            inner = get_args(parts[0]) if get_origin(parts[0]) is tuple else ()
            return f"{','.join(string.ascii_uppercase[: len(inner)])};..." if inner else "A,B,..."
        pending += parts
    return ""


def check_lists(arguments: list[str]) -> None:
    """Refuse a list with spaces, whose second number argparse reads as the scenario."""
    from phasmid.scenario import option_keys

    lists = {_flag(key) for key, path in option_keys().items() if _list_form(path)}
    for flag, first, second in zip(arguments, arguments[1:], arguments[2:], strict=False):
        numbers = (number_or_text(first), number_or_text(second))
        if flag in lists and not any(isinstance(number, str) for number in numbers):
            raise InvalidInput(
                f'{flag} takes one list; "{second}" stands apart.', hint=f"{flag} {first},{second}"
            )


def number_or_text(text: str) -> int | float | str:
    """Return the text of an option as a number where it is one; infinite beyond floats."""
    try:
        number = float(text)
    except ValueError:
        return text
    if math.isfinite(number):
        with suppress(ValueError):
            return int(text)
    # 1e3 is a whole number.
    return int(number) if number.is_integer() and abs(number) < 1e15 else number
