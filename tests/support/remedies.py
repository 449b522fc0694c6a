"""Remedies of refusals, typed back into the command that was refused."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

REFUSAL = re.compile(r"^phasmid: (.*)(?:\n  in   (.*))?(?:\n  try  (.*))?$", re.MULTILINE)
OPTION = re.compile(r"--[a-z]")
LINE = re.compile(r'(?:\[\[?([a-z_]+)\]?\] )?([a-z][a-z0-9_]*) = ("[^"]*"|\[.*\]|[^\s,;]+)')
NAME = re.compile(r'"([^"]*)"|one of ([^\s,]+)')


class Refusal(NamedTuple):
    """What a command printed where it was refused.

    Attributes:
        what: The sentence.
        where: File and line; empty where none is printed.
        remedy: What to try; empty where none is printed.
    """

    what: str
    where: str
    remedy: str


class Untypable(Exception):
    """A remedy in words, which cannot be typed."""


def refusal(printed: str) -> Refusal | None:
    """Return the last refusal among printed errors."""
    found = REFUSAL.findall(printed)
    return Refusal(*found[-1]) if found else None


def typed_back(arguments: list[str], refused: Refusal, folder: Path) -> list[str]:
    """Apply a remedy as a reader would: to the command line, or to the file that it names.

    Args:
        arguments: Those of the refused command.
        refused: Its refusal.
        folder: Where its files lie, which may be changed.

    Returns:
        The arguments to try.

    Raises:
        Untypable: The remedy cannot be typed.
    """
    hint = refused.remedy
    if hint.startswith("phasmid "):
        command = hint.partition(", ")[0].partition(" or ")[0]
        if re.search(r"\b[A-Z]{3,}\b(?![.-])", command):
            raise Untypable(hint)
        return shlex.split(command)[1:]
    if OPTION.match(hint):
        return _with_options(arguments, refused)
    if match := LINE.match(hint):
        if match[3] == "...":
            raise Untypable(hint)
        return _with_line(arguments, refused, match, folder)
    if match := NAME.match(hint):
        return _with_name(arguments, refused, match[1] or match[2], folder)
    if match := re.match(r"(?:without|leave) (--[a-z-]+)", hint):
        place = arguments.index(match[1])
        is_switch = place + 1 == len(arguments) or arguments[place + 1].startswith("--")
        return arguments[:place] + arguments[place + (1 if is_switch else 2) :]
    if match := re.match(r"put it into \[([a-z_]+)\]", hint):
        return _moved(arguments, refused, match[1], folder)
    raise Untypable(hint)


def _with_options(arguments: list[str], refused: Refusal) -> list[str]:
    arguments = [*arguments]
    words = shlex.split(refused.remedy.partition(" (")[0].replace("'s ", " "))
    unknown = re.match(r'no option "([^"]*)"', refused.what)
    while words and OPTION.match(words[0]):
        flag, value = words.pop(0), None
        ends = flag.endswith(",")
        if words and not ends and not OPTION.match(words[0]) and words[0] != "or":
            ends = words[0].endswith(",")
            value = words.pop(0).rstrip(",")
        flag = flag.rstrip(",")
        if unknown and value is None:
            arguments[arguments.index(unknown[1])] = flag
        elif flag in arguments:
            arguments[arguments.index(flag) + 1] = str(value)
        else:
            arguments += [flag] + [value] * (value is not None)
        if ends:
            break
    if place := re.match(r"(\S+) is a (?:robot|gait)\b.*, no scenario", refused.what):
        arguments.remove(place[1])
    if apart := re.search(r'"([^"]*)" stands apart', refused.what):
        arguments.remove(apart[1])
    if instead := re.search(r"in place of (--[a-z-]+)", refused.remedy):
        place = arguments.index(instead[1])
        del arguments[place : place + 2]
    return arguments


def _file(arguments: list[str], refused: Refusal, folder: Path) -> Path:
    known = [refused.where.partition(",")[0], *arguments]
    for name in known:
        if name.endswith(".toml") and (folder / name).is_file():
            return folder / name
    raise AssertionError(f"no file to change: {refused}")


def _with_line(
    arguments: list[str], refused: Refusal, match: re.Match[str], folder: Path
) -> list[str]:
    """Write a line in place of the one that is refused, or at the top of its table."""
    file = _file(arguments, refused, folder)
    lines, line = file.read_text().split("\n"), f"{match[2]} = {match[3]}"
    stem = re.sub(r"_(mm|deg|m|rad|ms|s)$", "", match[2])
    at = re.search(r"line (\d+)$", refused.where)
    same = [n for n, text in enumerate(lines) if re.match(rf"\s*{stem}\w* *=", text)]
    if same:
        # The line itself, one of the table that it heads, or the nearest one.
        place = int(at[1]) - 1 if at else 0
        heads = [n for n, text in enumerate(lines) if text.startswith("[") and n > place]
        inside = [n for n in same if place <= n < min(heads, default=len(lines))]
        nearest = (inside or sorted(same, key=lambda n: abs(n - place)))[0]
        lines[nearest] = line
    elif match[1] and f"[{match[1]}]" in lines:
        lines.insert(lines.index(f"[{match[1]}]") + 1, line)
    elif match[1]:
        lines += [f"[{match[1]}]", line]
    else:
        lines.insert(0, line)
    file.write_text("\n".join(lines))
    return arguments


def _with_name(arguments: list[str], refused: Refusal, name: str, folder: Path) -> list[str]:
    """Replace what the sentence quotes."""
    for wrong in re.findall(r'"([^"]+)"', refused.what):
        if any(wrong in re.split("[,=]", argument) for argument in arguments):
            return [
                argument.replace(wrong, name) if wrong in re.split("[,=]", argument) else argument
                for argument in arguments
            ]
        for argument in [refused.where.partition(",")[0], *arguments]:
            file = folder / argument
            if file.suffix == ".toml" and file.is_file() and wrong in file.read_text():
                file.write_text(file.read_text().replace(wrong, name, 1))
                return arguments
    raise AssertionError(f"nothing to replace: {refused}")


def _moved(arguments: list[str], refused: Refusal, table: str, folder: Path) -> list[str]:
    file = _file(arguments, refused, folder)
    lines = file.read_text().split("\n")
    line = lines.pop(int(re.search(r"line (\d+)$", refused.where)[1]) - 1)
    if f"[{table}]" in lines:
        lines.insert(lines.index(f"[{table}]") + 1, line)
    else:
        lines += [f"[{table}]", line]
    file.write_text("\n".join(lines))
    return arguments


class Accepted(BaseException):
    """A command has checked its input and begins to work."""


def accept(*_: object, **__: object) -> None:
    """Stand for what takes long after the checks of a command."""
    raise Accepted


def answer(main: Callable[[list[str]], int], arguments: list[str]) -> int:
    """Return a command's status; 0 where it begins to work."""
    try:
        return main(arguments)
    except Accepted:
        return 0
    except SystemExit as stopped:
        return int(stopped.code or 0)
