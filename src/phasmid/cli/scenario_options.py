"""Options of commands with a scenario: the scenario, and each of its fields."""

from __future__ import annotations

import argparse
import math
import string
import sys
from collections.abc import Iterable
from contextlib import suppress
from typing import TYPE_CHECKING, Any, get_args, get_origin

from phasmid.cli.output import say
from phasmid.errors import InvalidInput, plain

if TYPE_CHECKING:
    from phasmid.formats import ImportOptions
    from phasmid.scenario import Scenario

PLACES = {"robot", "height_map"}
"""Fields that name a file."""

SCENARIO = {
    "[SCENARIO]": "a preset or a file; default: paper, of another --robot with the period and the "
    "contact that follow its size and weight"
}

OUT = {
    "--out DIR": "result folder; default: results/NAME, where NAME has the scenario and the "
    "options, and a number where a run of that name exists"
}

TEXTS = {"name", "description", "gait", "terrain", "foot", "masses", "servo_model", "package"}
"""Fields whose value is text, also where it looks like a number."""


def add_field_options(
    parser: argparse.ArgumentParser,
    title: str = "fields of the scenario; each replaces a value of it",
    keys: Iterable[str] | None = None,
) -> None:
    """Add fields of a scenario.

    Args:
        parser: Parser of the command.
        title: Title of the options.
        keys: Keys of the fields; None: all.
    """
    from phasmid.gait import GAITS
    from phasmid.robot import preset_names
    from phasmid.scenario import option_keys

    fields = parser.add_argument_group(title)
    for key in option_keys() if keys is None else keys:
        path = option_keys()[key]
        words = _help_of(path)
        if key == "robot":
            words = f"a preset ({', '.join(preset_names())}) or a file"
        elif key == "gait":
            words = "; ".join(f"{', '.join(gaits)} of {n} legs" for n, gaits in GAITS.items())
            words += "; alternating, wave, ripple of others; or a gait file (.toml)"
        fields.add_argument(_flag(key), dest=f"field:{key}", metavar=_metavar(path), help=words)


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


def scenario_of(options: argparse.Namespace) -> Scenario:
    """Return the scenario of the options."""
    from phasmid.scenario import load_scenario

    scenario = load_scenario(options.scenario or "paper", read_robot=False)
    robot = given_fields(options).get("robot")
    if options.scenario is None and robot is not None:
        scenario = scenario.for_robot(robot)
    scenario = with_fields(scenario, options, options.scenario or "")
    return _with_robot(scenario, quiet=options.quiet)


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


def add_import_options(parser: argparse.ArgumentParser) -> None:
    """Add the fields of ``[robot_import]``: values missing in a robot's file."""
    from phasmid.scenario import option_keys

    keys = [key for key, path in option_keys().items() if path[0] == "robot_import"]
    add_field_options(parser, "reading URDF, MJCF and STEP", keys)
    parser.add_argument(
        "--strict", action="store_true", help="refuse a file with anything that is ignored"
    )


def import_options(options: argparse.Namespace) -> ImportOptions:
    """Return the options of reading a robot.

    Raises:
        InvalidInput: A value is refused.
    """
    from phasmid.scenario import Scenario, option_keys

    keys = [key for key, path in option_keys().items() if path[0] == "robot_import"]
    own = {f"field:{key}": vars(options)[f"field:{key}"] for key in keys}
    return with_fields(Scenario(), argparse.Namespace(**own)).robot_import


def given_fields(options: argparse.Namespace) -> dict[str, str]:
    """Return the fields that are given as options, by their keys."""
    return {
        key.removeprefix("field:"): value
        for key, value in vars(options).items()
        if key.startswith("field:") and value is not None
    }


def field_arguments(options: argparse.Namespace) -> list[str]:
    """Return the fields that are given as options, as arguments of a command."""
    return [word for key, value in given_fields(options).items() for word in (_flag(key), value)]


def _with_robot(scenario: Scenario, *, quiet: bool) -> Scenario:
    """Return the scenario with its robot read, and print the findings about a foreign file."""
    from phasmid.formats import Severity, import_robot, is_foreign, possible

    source = scenario.robot
    if not isinstance(source, str) or not is_foreign(source):
        return scenario
    imported = import_robot(source, scenario.robot_import)
    robot = possible(imported, source)
    if not quiet:
        notes = [f for f in imported.findings if f.severity is Severity.NOTE]
        for finding in imported.findings:
            if finding.severity is not Severity.NOTE:
                say(f"phasmid: {plain(finding.sentence)}", file=sys.stderr)
        if notes:
            command = f"phasmid check {plain(str(source))}"
            say(f"phasmid: {len(notes)} notes on the robot; {command} lists them.", file=sys.stderr)
    return scenario.replace(robot=robot)


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
