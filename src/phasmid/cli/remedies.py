"""Remedies of refusals as they are typed for a command."""

from __future__ import annotations

import re
import shlex
import tomllib
from collections.abc import Sequence
from typing import Any

from phasmid.cli.parser import COMMANDS, build_parser, flags

SETTING = re.compile(
    r'(?<![\w."\]-])([a-z][a-z0-9_]*) = '
    r'("(?:\\.|[^"\\])*"|\[(?:[^][]|\[[^][]*\])*\]|true|false|-?\d+(?:\.\d+)?(?:e[-+]?\d+)?)'
    r"(, (?=[a-z0-9_]+ = ))?"
)
"""A key with its value in TOML, and the comma before another."""

TOML_FILE = re.compile(r"\.toml\b")
"""Of a place in a file whose line is to be changed."""

OTHERS = {"speed": ("speed_mm_s", 1000.0)}
"""Arguments of functions that are options in another unit."""

ROBOT_FILE = re.compile(r".*\.(urdf|xml|mjcf|step|stp)", re.IGNORECASE)
"""Argument that names a robot of another program."""


def typed(hint: str, arguments: Sequence[str], where: str = "") -> str:
    """Return a remedy with options in place of settings, where the command has them.

    Args:
        hint: Such as ``period = 0.49``; anything else in it is kept.
        arguments: Those of the command line.
        where: File and line that the remedy changes; a TOML file's lines are kept as they are.

    Returns:
        The remedy; empty where it can be typed nowhere.
    """
    if not SETTING.search(hint):
        return hint
    # Most refusals need neither the fields of a scenario nor the command's options.
    from phasmid.scenario import option_keys

    parser = build_parser(next((one for one in arguments if one in COMMANDS), None))
    known, alone, keys = set(flags(parser)), set(flags(parser, switches=True)), option_keys()
    source = next(filter(ROBOT_FILE.fullmatch, arguments), "")
    file = any(map(TOML_FILE.search, (where, *arguments)))
    is_untypable = False

    def as_option(match: re.Match[str]) -> str:
        nonlocal is_untypable
        key, value, more = match[1], match[2], match[3]
        if key in OTHERS:
            key, factor = OTHERS[key]
            value = f"{factor * float(value):.12g}"
        path, flag = keys.get(key, ()), f"--{key.replace('_', '-')}"
        is_import = path[:1] == ("robot_import",)
        if TOML_FILE.search(where) and not is_import:
            return match[0]
        if flag in known or (is_import and source):
            if flag in alone and value != "true":
                return match[0]
            try:
                option = flag if flag in alone else f"{flag} {option_value(value)}"
            except tomllib.TOMLDecodeError:
                return match[0]
            if flag in known:
                return f"{option}{' ' if more else ''}"
            converted = f"phasmid export --robot {shlex.quote(source)} --out robot.toml {option}"
            return f"{converted}, and robot.toml in its place"
        if not path:
            return match[0]
        # A line of a scenario's file, if there is one.
        is_untypable |= not file
        table = "" if len(path) < 2 or path == ("gait", "name") else f"[{path[0]}] "
        return f"{table}{match[0]}"

    text = SETTING.sub(as_option, hint)
    return "" if is_untypable else text


def option_value(value: str) -> str:
    """Return a value of TOML as the value of an option.

    Raises:
        TOMLDecodeError: It is none.
    """
    found: Any = tomllib.loads(f"x = {value}")["x"]
    if isinstance(found, list):
        rows = [",".join(map(str, one)) if isinstance(one, list) else str(one) for one in found]
        return shlex.quote((";" if any(isinstance(one, list) for one in found) else ",").join(rows))
    return shlex.quote(found) if isinstance(found, str) else value
