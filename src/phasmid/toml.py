"""TOML files: found by name or path, read with care, and the lines on which things stand."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

from phasmid.errors import InvalidInput, nearest
from phasmid.units import split_unit

LARGEST_FILE = 1_000_000
"""Files above this many bytes are no robots or scenarios written by hand."""

MOST_TABLES = 5_000
"""Most lines with the heading of a table: a robot of 100 legs has 1000. The parser and the search
for the line of a mistake take seconds for ten times as many."""

MOST_KEYS = 20_000
"""Most lines with a key, for the same reason: a robot of 100 legs has 5000."""

MOST_PARTS = 16
"""Most parts of a dotted key: the parser's memory grows with their square."""

_HEADING, _KEY = (
    re.compile(rf"^[ \t]*{begin}", re.MULTILINE) for begin in (r"\[[^,\n]*$", r"[^\n=]{1,200}=")
)
"""A line with the heading of a table, and one with a key; no line of a list of lists is either."""

_DOTTED_KEY = re.compile(
    rf"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){{{MOST_PARTS}}}"""
)
"""A dotted key of too many parts, or a text that looks like one; the search takes linear time."""


_OTHER = {"{": "JSON", "<": "XML"}
"""Formats whose files no TOML file begins like."""


def preset_names(package: str) -> tuple[str, ...]:
    """Return the names of a package's preset files, in its folder ``presets``."""
    folder = resources.files(package) / "presets"
    return tuple(sorted(p.name[:-5] for p in folder.iterdir() if p.name.endswith(".toml")))


def find_file(source: str | Path, package: str, noun: str) -> Path:
    """Return the file of a preset's name or of a path.

    Args:
        source: Name of a preset, or path of a ``.toml`` file.
        package: The package with the presets.
        noun: Kind of the file, for messages.

    Raises:
        InvalidInput: It is neither.
    """
    text, known = str(source), preset_names(package)
    if text in known:
        return Path(str(resources.files(package) / "presets" / f"{text}.toml"))
    path = Path(text)
    if path.suffix != ".toml" and not _exists(path):
        guess = nearest(text, known)
        choice = f"one of {', '.join(known)}, or a .toml file"
        raise InvalidInput(f'no {noun} called "{text}".', hint=f'"{guess}"' if guess else choice)
    return path


def is_file(path: Path) -> bool:
    """Return whether a path is a file; False for a name that no file system accepts."""
    return _exists(path) and path.is_file()


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):
        # A name that no file system takes: too long, or with a zero in it.
        return False


def read_toml(path: Path) -> tuple[dict[str, Any], str]:
    """Return the table in a TOML file, and its text.

    Raises:
        InvalidInput: The file is absent, no regular file, too large, not TOML, or has no keys.
    """
    content = read_text(path, LARGEST_FILE)
    table = parse_toml(content, path.name)
    if not table:
        # A file of comments is likely of another kind, such as USD.
        raise InvalidInput(f"{path.name} {'has only comments' if content.strip() else 'is empty'}.")
    return table, content


def read_text(path: Path, largest: int) -> str:
    """Return the text of a file in UTF-8, lines ending in line feeds.

    Args:
        path: The file.
        largest: Its largest size [bytes].

    Raises:
        InvalidInput: The file is absent, no regular file, too large, or not UTF-8.
    """
    try:
        # Some editors put a byte order mark first.
        return read_bytes(path, largest).decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError:
        raise InvalidInput(f"{path} is not text in UTF-8.") from None


def read_bytes(path: Path, largest: int) -> bytes:
    """Return the content of a file of a largest size [bytes].

    Raises:
        InvalidInput: The file is absent, no regular file, too large, or cannot be read.
    """
    try:
        if not path.is_file():
            if path.is_dir():
                raise InvalidInput(f"{path} is a folder.", hint="a file in it")
            exists = path.exists()
            raise InvalidInput(f"{path} is not a file." if exists else f"{path} does not exist.")
        with path.open("rb") as file:
            raw = file.read(largest + 1)
    except (OSError, ValueError) as error:
        reason = (getattr(error, "strerror", None) or str(error)).lower()
        raise InvalidInput(f"cannot read {path}: {reason}.") from None
    if len(raw) > largest:
        raise InvalidInput(f"{path} holds more than {largest} bytes; such files are refused.")
    return raw


def parse_toml(content: str, name: str) -> dict[str, Any]:
    """Return the table of a TOML text, which may come from anyone.

    Args:
        content: The text.
        name: Name of the text, for messages.

    Raises:
        InvalidInput: It is not TOML, or a key, a number or the nesting is beyond measure.
    """
    dotted = _DOTTED_KEY.search(content)
    if dotted:
        line = content.count("\n", 0, dotted.start()) + 1
        raise InvalidInput(
            f"{name} line {line}: a key has more than {MOST_PARTS} parts; such files are refused."
        )
    for pattern, most, what in ((_HEADING, MOST_TABLES, "tables"), (_KEY, MOST_KEYS, "keys")):
        if sum(1 for _ in pattern.finditer(content)) > most:
            raise InvalidInput(f"{name} has more than {most} {what}; such files are refused.")
    try:
        return tomllib.loads(content)
    except tomllib.TOMLDecodeError as error:
        raise _toml_error(content, name, str(error)) from None
    except RecursionError:
        raise InvalidInput(f"{name}: tables or lists are nested too deeply.") from None
    except ValueError:
        # Python refuses whole numbers above 4300 digits.
        raise InvalidInput(f"{name}: a number has too many digits.") from None


def _toml_error(content: str, name: str, message: str) -> InvalidInput:
    lines = content.splitlines()
    reason, _, place = message.partition(" (at line ")
    line = int(place.partition(",")[0]) if place else len(lines)
    if "overwrite" in message or "twice" in message:
        key = lines[line - 1].partition("=")[0].strip().strip("[]")
        return InvalidInput(f'{name} line {line}: key "{key}" is given twice.')
    other = next((kind for start, kind in _OTHER.items() if content.lstrip().startswith(start)), "")
    if other or Path(name).suffix not in ("", ".toml"):
        kind = f"is {other}, not TOML" if other else "is not TOML"
        return InvalidInput(f"{name} {kind}; reading stops in line {line}: {reason}.")
    return InvalidInput(f"{name} line {line}: {reason}.", hint="key = value in each line")


def line_of(content: str, loc: Sequence[str | int]) -> tuple[int, int]:
    """Return the line of a value in a TOML text, or the nearest line above it.

    Args:
        content: The file's text.
        loc: Path of keys to the value; a key may be written with a unit.

    Returns:
        Line number from 1, and how many keys of the path are written there; both 0 for none.
    """
    keys = [str(part) for part in loc if isinstance(part, str)]
    best, depth = 0, 0
    for number, path in _written(content):
        if not depth < len(path) <= len(keys):
            continue
        pairs = zip(keys, path, strict=False)
        if all(key in (part, split_unit(part)[0]) for key, part in pairs):
            best, depth = number, len(path)
    return best, depth


@lru_cache(maxsize=8)
def _written(content: str) -> list[tuple[int, list[str]]]:
    """Lines of a TOML text with the path of keys on each."""
    found: list[tuple[int, list[str]]] = []
    table: list[str] = []
    for number, line in enumerate(content.splitlines(), 1):
        bare = line.strip()
        if bare.startswith("["):
            path = table = _parts(bare.lstrip("[").partition("]")[0])
        else:
            name, equals, _ = bare.partition("=")
            if not equals or len(name) > 200:
                continue
            path = table + _parts(name)
        found.append((number, path))
    return found


def _parts(dotted: str) -> list[str]:
    return [part.strip().strip("\"'") for part in dotted.split(".")]


def toml_string(text: str) -> str:
    """Return a text as a TOML basic string, with invisible characters written by number."""
    # Half a character of UTF-16 has no number in TOML.
    return "".join(
        c if c.isprintable() or "\ud800" <= c <= "\udfff" else f"\\U{ord(c):08x}"
        for c in json.dumps(text, ensure_ascii=False)
    )


def toml_value(value: Any) -> str:
    """Return a string, number, boolean, list or table in TOML."""
    if isinstance(value, str):
        return toml_string(value)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{toml_key(k)} = {toml_value(v)}' for k, v in value.items())} }}"
    if isinstance(value, Iterable):
        return f"[{', '.join(map(toml_value, value))}]"
    # A number of NumPy has another text than one of Python.
    return repr(float(value) if isinstance(value, float) else int(value))


def toml_lines(values: Mapping[str, Any]) -> list[str]:
    """Return the lines of a table."""
    return [f"{key} = {toml_value(value)}" for key, value in values.items()]


def toml_key(name: str) -> str:
    """Return a name as a TOML key, quoted where it must be."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else toml_string(name)
