"""Tables that people write: typed, with units in the key names, and errors that speak."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, get_args, get_origin

import annotated_types
from pydantic import BaseModel, ConfigDict, ValidationError, model_validator
from pydantic.fields import FieldInfo

from phasmid import units
from phasmid.errors import InvalidInput, nearest

LARGEST_FILE = 1_000_000
"""Files above this many bytes are not robots or scenarios that a person wrote."""


@dataclass(frozen=True)
class Quantity:
    """Marks a field that carries a dimension.

    Attributes:
        unit: Ending of the unit that people use for it; without an ending a key is SI.
    """

    unit: str

    @property
    def dimension(self) -> str:
        """What the field measures."""
        return units.UNITS[self.unit].dimension


@dataclass(frozen=True)
class Hint:
    """What to try when a field's value is refused."""

    text: str


Length = Annotated[float, Quantity("mm")]
Mass = Annotated[float, Quantity("g")]
Angle = Annotated[float, Quantity("deg")]
Time = Annotated[float, Quantity("s")]
Inertia = Annotated[float, Quantity("g_mm2")]
Rate = Annotated[float, Quantity("rpm")]


class Table(BaseModel):
    """A frozen table; keys may end in a unit, values inside are SI, unknown keys are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _convert_units(cls, raw: Any) -> Any:
        if not isinstance(raw, Mapping):
            return raw
        table: dict[str, Any] = {}
        for key, value in raw.items():
            name, ending = _field_of(cls, key)
            if name in table:
                raise InvalidInput(f'key "{name}" is given twice, as "{key}" and in another unit.')
            table[name] = _scale(value, ending) if ending else value
        return table


def _scale(value: Any, ending: str) -> Any:
    if isinstance(value, bool | str):
        return value
    if isinstance(value, int | float):
        return units.UNITS[ending].to_si(value)
    if isinstance(value, Mapping):
        return {k: _scale(v, ending) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_scale(v, ending) for v in value]
    return value


def quantity(field: FieldInfo) -> Quantity | None:
    """The dimension that a field carries, also where it is a list or optional."""
    found = [m for m in field.metadata if isinstance(m, Quantity)]
    pending = [field.annotation]
    while pending and not found:
        kind = pending.pop()
        found = [m for m in getattr(kind, "__metadata__", ()) if isinstance(m, Quantity)]
        pending += [k for k in get_args(kind) if k is not None]
    return found[0] if found else None


def _field_of(table: type[Table], key: str) -> tuple[str, str]:
    """The field that a key names and the unit that ends the key, if they fit together."""
    if key in table.model_fields:
        return key, ""
    name, ending = units.split_unit(key)
    field = table.model_fields.get(name)
    if ending and field is not None:
        carried = quantity(field)
        if carried and carried.dimension == units.UNITS[ending].dimension:
            return name, ending
    return key, ""


def key_of(name: str, field: FieldInfo) -> str:
    """The key under which people know a field, such as ``step_length_mm``."""
    carried = quantity(field)
    if carried is None or units.UNITS[carried.unit].per_si == 1.0:
        return name
    return f"{name}_{carried.unit}"


T = TypeVar("T", bound="Table")

Locator = Callable[[tuple[str | int, ...]], tuple[str, str]]
"""From the place of a value in a table to its subject in a sentence and its file and line."""


def validate(table: type[T], raw: Mapping[str, Any], locate: Locator) -> T:
    """Build a table from what a person wrote.

    Args:
        table: The kind of table.
        raw: Keys and values as read from a file or options.
        locate: Tells the name and the place of a value, for messages.

    Raises:
        InvalidInput: In the house form, for the first thing that is wrong.
    """
    try:
        return table.model_validate(raw)
    except ValidationError as error:
        # An unknown key explains a missing one, so it comes first.
        details = sorted(error.errors(), key=lambda e: e["type"] != "extra_forbidden")
        raise _speak(table, raw, details[0], locate) from None


def _speak(
    table: type[Table], raw: Mapping[str, Any], detail: Mapping[str, Any], locate: Locator
) -> InvalidInput:
    loc = tuple(p for p in detail["loc"] if isinstance(p, str | int))
    parent, field, value, ending = _descend(table, raw, loc)
    subject, where = locate(loc)
    if detail["type"] == "extra_forbidden":
        key = str(loc[-1])
        keys = [key_of(n, f) for n, f in parent.model_fields.items()]
        guess = nearest(key, [*keys, *parent.model_fields])
        if guess in parent.model_fields:
            guess = key_of(guess, parent.model_fields[guess])
        inside = ".".join(map(str, loc[:-1]))
        return InvalidInput(
            f'unknown key "{key}"' + (f" in {inside}." if inside else "."),
            where=where,
            hint=f'"{guess}"' if guess else "keys here are " + ", ".join(keys),
        )
    if detail["type"] == "missing":
        key = key_of(str(loc[-1]), field) if field else str(loc[-1])
        return InvalidInput(f"{subject} is missing.", where=where, hint=f"{key} = ...")
    hints = [m.text for m in field.metadata if isinstance(m, Hint)] if field else []
    return InvalidInput(
        f"{subject} is {_show(value, ending)}; it must be {_demand(field, detail, ending)}.",
        where=where,
        hint=hints[0] if hints else "",
    )


def _descend(
    table: type[Table], raw: Any, loc: tuple[str | int, ...]
) -> tuple[type[Table], FieldInfo | None, Any, str]:
    """Follow a location down to its table, its field, the value as written and its unit."""
    parent: type[Table] = table
    field: FieldInfo | None = None
    ending = ""
    for i, part in enumerate(loc):
        if isinstance(raw, Mapping):
            written = next((k for k in raw if k == part or _field_of(parent, k)[0] == part), part)
            ending = _field_of(parent, str(written))[1] or ending
            raw = raw.get(written)
        elif isinstance(raw, list | tuple) and isinstance(part, int) and part < len(raw):
            raw = raw[part]
        if part in parent.model_fields:
            field = parent.model_fields[str(part)]
            carried = quantity(field)
            if carried and not ending:
                ending = next(k for k, u in units.UNITS.items() if u is units.SI[carried.dimension])
            inner = _table_in(field.annotation)
            if inner and i < len(loc) - 1:
                parent = inner
    return parent, field, raw, ending


def _table_in(kind: Any) -> type[Table] | None:
    if isinstance(kind, type) and issubclass(kind, Table):
        return kind
    return next((t for t in map(_table_in, get_args(kind)) if t), None)


def _show(value: Any, ending: str) -> str:
    if isinstance(value, bool | int | float):
        number = f"{value:g}" if isinstance(value, float) else str(value).lower()
        finite = not isinstance(value, float) or math.isfinite(value)
        return f"{number} {units.UNITS[ending].symbol}" if ending and finite else number
    if isinstance(value, str):
        return f'"{value}"'
    return "empty" if value is None else str(value)


def _demand(field: FieldInfo | None, detail: Mapping[str, Any], ending: str) -> str:
    """What a value must be, in words, from the field's own constraints."""
    if detail["type"] in {"literal_error", "enum"}:
        return str(detail["ctx"]["expected"]).replace("'", '"')
    kind = field.annotation if field else None
    scale = units.UNITS[ending].from_si if ending else float
    bounds = []
    for m in field.metadata if field else []:
        if isinstance(m, annotated_types.Gt):
            bounds.append(f"greater than {scale(m.gt):g}")  # type: ignore[arg-type]
        if isinstance(m, annotated_types.Ge):
            bounds.append(f"{scale(m.ge):g} or more")  # type: ignore[arg-type]
        if isinstance(m, annotated_types.Lt):
            bounds.append(f"less than {scale(m.lt):g}")  # type: ignore[arg-type]
        if isinstance(m, annotated_types.Le):
            bounds.append(f"{scale(m.le):g} or less")  # type: ignore[arg-type]
    words = " and ".join(bounds)
    if detail["type"] == "string_pattern_mismatch":
        return "a plain name"
    if detail["type"] == "finite_number":
        return f"a finite number {words}".strip()
    if detail["type"].startswith(("int", "float", "string", "bool", "list", "tuple", "dict")):
        noun = {"int": "a whole number", "str": "text", "bool": "true or false"}
        name = getattr(kind, "__name__", "")
        if name in noun:
            return f"{noun[name]} {words}".strip()
        if "too_" in detail["type"] or not detail["type"].startswith("float"):
            return str(detail["msg"]).removeprefix("Input should be ").lower()
        return f"a number {words}".strip()
    return words or str(detail["msg"]).removeprefix("Value error, ")


def preset_names(package: str) -> tuple[str, ...]:
    """Names of the files that come with a room, in its folder ``presets``."""
    folder = resources.files(package) / "presets"
    return tuple(sorted(p.name[:-5] for p in folder.iterdir() if p.name.endswith(".toml")))


def find_file(source: str | Path, package: str, noun: str) -> Path:
    """The file that a name or a path stands for.

    Args:
        source: Name of a preset, or path of a ``.toml`` file.
        package: The room whose presets are meant.
        noun: What the file describes, for messages.

    Raises:
        InvalidInput: It is neither.
    """
    text, known = str(source), preset_names(package)
    if text in known:
        return Path(str(resources.files(package) / "presets" / f"{text}.toml"))
    path = Path(text)
    if path.suffix != ".toml" and not path.exists():
        guess = nearest(text, known)
        choice = f"one of {', '.join(known)}, or a .toml file"
        raise InvalidInput(f'no {noun} called "{text}".', hint=f'"{guess}"' if guess else choice)
    return path


def read_toml(path: Path) -> tuple[dict[str, Any], str]:
    """The table in a TOML file, and its text.

    Raises:
        InvalidInput: The file is absent, too large, or not TOML.
    """
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise InvalidInput(
                f"{path} holds {path.stat().st_size} bytes; files above {LARGEST_FILE} are refused."
            )
        content = path.read_bytes().decode("utf-8")
    except UnicodeDecodeError:
        raise InvalidInput(f"{path} is not text in UTF-8.") from None
    except FileNotFoundError:
        raise InvalidInput(f"{path} does not exist.") from None
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InvalidInput(f"cannot read {path}: {reason}.") from None
    try:
        return tomllib.loads(content), content
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise _toml_error(path, content, str(error)) from None


def _toml_error(path: Path, content: str, message: str) -> InvalidInput:
    at = re.search(r"\(at line (\d+), column \d+\)", message)
    line = int(at.group(1)) if at else len(content.splitlines())
    written = content.splitlines()[line - 1] if 0 < line <= len(content.splitlines()) else ""
    if "overwrite" in message or "twice" in message:
        key = re.split(r"=", written, maxsplit=1)[0].strip().strip("[]")
        return InvalidInput(f'{path.name} line {line}: key "{key}" is given twice.')
    reason = re.sub(r"\s*\(at .*\)", "", message)
    return InvalidInput(f"{path.name} line {line}: {reason}.", hint="see the TOML syntax")


def line_of(content: str, loc: tuple[str | int, ...]) -> int:
    """The line of a TOML text on which a value stands, or the nearest line above it.

    Args:
        content: The file's text.
        loc: Path of keys to the value.

    Returns:
        Line number from 1; 0 where nothing of the path is written.
    """
    keys = [str(p) for p in loc if isinstance(p, str)]
    best, depth = 0, 0
    table: list[str] = []
    for number, line in enumerate(content.splitlines(), 1):
        head = re.match(r"\s*\[+\s*([^\]]+?)\s*\]+", line)
        entry = re.match(r"\s*([\w.\"'-]+)\s*=", line)
        if head and not entry:
            table = _parts(head.group(1))
            path = table
        elif entry:
            path = table + _parts(entry.group(1))
        else:
            continue
        shared = 0
        while shared < min(len(path), len(keys)) and keys[shared] in (
            path[shared],
            units.split_unit(path[shared])[0],
        ):
            shared += 1
        if shared == len(path) and shared > depth:
            best, depth = number, shared
    return best


def _parts(dotted: str) -> list[str]:
    return [p.strip().strip("\"'") for p in dotted.split(".")]


def in_file(path: Path, content: str) -> Locator:
    """A locator for values that stand in a file."""

    def locate(loc: tuple[str | int, ...]) -> tuple[str, str]:
        line = line_of(content, loc)
        return dotted(loc), f"{path.name}, line {line}" if line else path.name

    return locate


def dotted(loc: tuple[str | int, ...]) -> str:
    """A location as people read it, such as ``gait.offsets[2]``."""
    words = ""
    for part in loc:
        words += f"[{part}]" if isinstance(part, int) else f".{part}"
    return words.lstrip(".")


def leaves(table: type[Table]) -> Iterator[tuple[tuple[str, ...], FieldInfo]]:
    """Every field of a table and of the tables inside it, with its path."""
    for name, field in table.model_fields.items():
        inner = _table_in(field.annotation)
        if inner is None:
            yield (name,), field
        else:
            for path, leaf in leaves(inner):
                yield (name, *path), leaf


def choices(field: FieldInfo) -> tuple[str, ...]:
    """The words that a field accepts; empty where it is not a choice."""
    return get_args(field.annotation) if get_origin(field.annotation) is Literal else ()
