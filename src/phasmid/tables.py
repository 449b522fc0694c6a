"""Tables of TOML files: typed, with units in the key names, and messages for users."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias, TypeVar, get_args, get_origin

from annotated_types import Gt
from pydantic import (
    BaseModel,
    ConfigDict,
    Strict,
    StringConstraints,
    ValidationError,
    model_validator,
)
from pydantic.fields import FieldInfo
from pydantic_core import InitErrorDetails

from phasmid import units
from phasmid.errors import InvalidInput, nearest
from phasmid.toml import line_of

if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(BaseModel)


@dataclass(frozen=True)
class Quantity:
    """Marks a field that carries a dimension.

    Attributes:
        unit: Ending of its usual unit; a key without an ending is in SI.
    """

    unit: str

    @property
    def dimension(self) -> str:
        """Dimension of the field."""
        return units.UNITS[self.unit].dimension


@dataclass(frozen=True)
class Hint:
    """Hint for a refused value of a field."""

    text: str


class Of:
    """Marks a field that only some choices of its table use.

    Attributes:
        choices: Those choices.
    """

    def __init__(self, *choices: str) -> None:
        self.choices = choices


LARGEST = 1e12
"""Largest size of a number in SI. No quantity of a walking robot is larger, and products of a dozen
such numbers stay within the range of floats."""

SMALLEST = 1e-12
"""Smallest of a number in SI that must be positive, for the same reasons."""

# Strict: a number in quotes would pass its key's unit by, and true is not 1.
Number = Annotated[float, Strict()]
Count = Annotated[int, Strict()]
Length = Annotated[Number, Quantity("mm")]
Mass = Annotated[Number, Quantity("g")]
Angle = Annotated[Number, Quantity("deg")]
Time = Annotated[Number, Quantity("s")]
Inertia = Annotated[Number, Quantity("g_mm2")]
Rate = Annotated[Number, Quantity("rpm")]
AngularVelocity = Annotated[Number, Quantity("deg_per_s")]
Velocity = Annotated[Number, Quantity("mm_per_s")]
Weight = Annotated[Number, Quantity("n")]
Density = Annotated[Number, Quantity("kg_m3")]
Voltage = Annotated[Number, Quantity("v")]
Temperature = Annotated[Number, Quantity("degc")]

LONGEST_NAME = 64
"""Robots and legs with longer names than this make no readable tables."""

_PRINTABLE = r"[^\p{C}\p{Z}]"
Name = Annotated[
    str,
    # Formats of XML know no blanks at the ends.
    StringConstraints(
        pattern=rf"^{_PRINTABLE}((?:{_PRINTABLE}| ){{0,{LONGEST_NAME - 2}}}{_PRINTABLE})?$"
    ),
    Hint(f"1 to {LONGEST_NAME} printable characters, without a blank at the ends"),
]


Loc: TypeAlias = tuple[str | int, ...]
"""Place of a value in a table."""


class _TableType(ModelMetaclass):
    """Converts an error of a table that is built by its name; tables inside others do not pass."""

    def __call__(self, **fields: Any) -> Any:
        table: Any = self
        with speaking(table, fields):
            return super().__call__(**fields)


class Table(BaseModel, metaclass=_TableType):
    """A frozen table; keys may end in a unit, values inside are SI, unknown keys are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _convert_units(cls, raw: Any) -> Any:
        return in_si(cls, raw) if isinstance(raw, Mapping) else raw

    @model_validator(mode="after")
    def _check_values(self: T) -> T:
        for name, value in self:
            # Half a character of UTF-16: Python holds it, and no file does.
            if isinstance(value, str) and any("\ud800" <= c <= "\udfff" for c in value):
                raise InvalidInput(f"{name} is {value!r}; it must be text that a file can hold.")
            least = _least(type(self))[name]
            for loc, number in _floats(value, (name,)):
                if math.isfinite(number) and not least <= number <= LARGEST:
                    raise _beyond(type(self), loc, number, least)
        return self


def _beyond(table: type[Table], loc: Loc, number: float, least: float) -> ValidationError:
    """Return the error of a number that no field of a table may hold."""
    error: InitErrorDetails = {"type": "less_than_equal", "loc": loc, "input": number}
    error["ctx"] = {"le": LARGEST}
    if number < least:
        error |= {"type": "greater_than_equal", "ctx": {"ge": least}}
    return ValidationError.from_exception_data(table.__name__, [error])


@lru_cache
def _least(table: type[Table]) -> dict[str, float]:
    """Return the least number that each field of a table may hold."""
    return {
        name: SMALLEST if Gt(0) in _marks(field) else -LARGEST
        for name, field in table.model_fields.items()
    }


def _floats(value: Any, loc: Loc) -> Iterator[tuple[Loc, float]]:
    """Yield the floats of a field, also those in its list, with their places."""
    if isinstance(value, float):
        yield loc, value
    elif isinstance(value, list | tuple | Mapping):
        for key, inner in value.items() if isinstance(value, Mapping) else enumerate(value):
            yield from _floats(inner, (*loc, key))


def in_si(table: type[Table], raw: Mapping[str, Any]) -> dict[str, Any]:
    """Values of a table by the names of its fields, those whose key ends in a unit in SI.

    Raises:
        InvalidInput: A field is given twice, in two units.
    """
    values: dict[str, Any] = {}
    for key, value in raw.items():
        name, ending = _field_of(table, key)
        if name in values:
            raise InvalidInput(f'key "{name}" is given twice, as "{key}" and in another unit.')
        values[name] = _scale(value, ending) if ending else value
    return values


def _scale(value: Any, ending: str) -> Any:
    if isinstance(value, bool | str):
        return value
    if isinstance(value, int | float):
        try:
            return units.UNITS[ending].to_si(value)
        except OverflowError:
            return math.inf
    if isinstance(value, Mapping):
        return {k: _scale(v, ending) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_scale(v, ending) for v in value]
    return value


def quantity(field: FieldInfo) -> Quantity | None:
    """Return the dimension that a field carries, also where it is a list or optional."""
    return next((m for m in _marks(field) if isinstance(m, Quantity)), None)


def _marks(field: FieldInfo) -> Iterator[Any]:
    """Yield the marks and bounds of a field, also those inside a list or an optional value."""
    yield from field.metadata
    pending = [field.annotation]
    while pending:
        kind = pending.pop()
        yield from getattr(kind, "__metadata__", ())
        pending += [k for k in get_args(kind) if k is not None]


def _field_of(table: type[Table], key: str) -> tuple[str, str]:
    """Return the field that a key names and the unit that ends the key, if they fit together."""
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
    """Return the key of a field in files: its name and its unit, such as ``step_length_mm``.

    SI units are left out.
    """
    own = quantity(field)
    if own is None or units.UNITS[own.unit].per_si == 1.0:
        return name
    return f"{name}_{own.unit}"


T = TypeVar("T", bound="Table")

Locator = Callable[[Loc], tuple[str, str]]
"""From the place of a value in a table to its subject in a sentence and its file and line."""


_LOCATE: ContextVar[Locator] = ContextVar("locate", default=lambda loc: (dotted(loc), ""))


def validate(table: type[T], raw: Mapping[str, Any], locate: Locator) -> T:
    """Validate a table of a file.

    Args:
        table: The kind of table.
        raw: Keys and values as read from a file or options.
        locate: Returns the name and the place of a value, for messages.

    Raises:
        InvalidInput: In the house form, for the first thing that is wrong.
    """
    token = _LOCATE.set(locate)
    try:
        with speaking(table, raw):
            return table.model_validate(raw)
    finally:
        _LOCATE.reset(token)


@contextmanager
def speaking(table: type[Table], raw: Mapping[str, Any]) -> Iterator[None]:
    """Convert an error of pydantic to one sentence."""
    try:
        yield
    except ValidationError as error:
        # An unknown key explains a missing one, so it comes first.
        details = error.errors(include_url=False, include_input=False)
        first = min(details, key=lambda e: e["type"] != "extra_forbidden")
        raise _speak(table, raw, first, _LOCATE.get()) from None


def _speak(
    table: type[Table], raw: Mapping[str, Any], detail: Mapping[str, Any], locate: Locator
) -> InvalidInput:
    parent, field, value, ending, loc = _descend(table, raw, detail["loc"])
    subject, where = locate(loc)
    if detail["type"] == "extra_forbidden":
        key, inside = _cut(str(loc[-1])), subject.rpartition(".")[0]
        what = f'unknown key "{key}" in {inside}.' if inside else f'unknown key "{key}".'
        return InvalidInput(what, where=where, hint=_hint_for_key(key, table, parent))
    hints = [m.text for m in field.metadata if isinstance(m, Hint)] if field else []
    if detail["type"] == "missing":
        key = key_of(str(loc[-1]), field) if field else str(loc[-1])
        # Other hints are on values.
        hints = [hint for hint in hints if " = " in hint]
        hints += [] if isinstance(loc[-1], int) else [f"{key} = ..."]
        return InvalidInput(f"{subject} is missing.", where=where, hint=hints[0] if hints else "")
    guess = nearest(value, choices(field)) if field and isinstance(value, str) else ""
    if guess:
        hints.append(f'"{guess}"')
    return InvalidInput(
        f"{subject} is {_show(value, ending)}; it must be {_demand(field, detail, ending)}.",
        where=where,
        hint=hints[0] if hints else "",
    )


def _hint_for_key(key: str, table: type[Table], parent: type[Table]) -> str:
    """Return the table of an unknown key, or the known key nearest to it."""
    stem = units.split_unit(key)[0]
    for path, _ in leaves(table):
        if len(path) > 1 and path[-1] in (key, stem) and path[-1] not in parent.model_fields:
            return f"put it into [{'.'.join(path[:-1])}]"
    keys = [key_of(name, field) for name, field in parent.model_fields.items()]
    guess = nearest(key, [*keys, *parent.model_fields])
    if guess in parent.model_fields:
        guess = key_of(guess, parent.model_fields[guess])
    return f'"{guess}"' if guess else "keys here are " + ", ".join(keys)


def _descend(
    table: type[Table], raw: Any, loc: Loc
) -> tuple[type[Table], FieldInfo | None, Any, str, tuple[str | int, ...]]:
    """Follow a location down to its table, its field, the value as written and its unit.

    The location comes back without the parts that only name a branch of a union.
    """
    parent: type[Table] = table
    field: FieldInfo | None = None
    ending = ""
    kept: list[str | int] = []
    for i, part in enumerate(loc):
        if isinstance(part, str) and (not isinstance(raw, Mapping) or "[" in part):
            continue
        if part == "str" and field is not None:
            # The branch of a union of text and an object.
            continue
        kept.append(part)
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
    return parent, field, raw, ending, tuple(kept)


def _table_in(kind: Any) -> type[Table] | None:
    if isinstance(kind, type) and issubclass(kind, Table):
        return kind
    return next((t for t in map(_table_in, get_args(kind)) if t), None)


def _show(value: Any, ending: str) -> str:
    if isinstance(value, bool | int | float):
        large = isinstance(value, float) or abs(value) >= 10**15
        try:
            number = f"{float(value):g}" if large else str(value).lower()
        except OverflowError:
            number = "more than 1e308"
        finite = not isinstance(value, float) or math.isfinite(value)
        counts = ending and finite and not isinstance(value, bool)
        return f"{number} {units.UNITS[ending].symbol}" if counts else number
    if isinstance(value, str):
        return f'"{_cut(value)}"'
    if isinstance(value, Mapping):
        return "a table"
    return "empty" if value is None else _cut(str(value))


def _cut(text: str) -> str:
    return text if len(text) <= 200 else f"{text[:200]}…"


_BOUNDS = {
    "gt": "greater than {:g}",
    "ge": "{:g} or more",
    "lt": "less than {:g}",
    "le": "{:g} or less",
}
_NOUNS = {
    "string_pattern_mismatch": "a plain name",
    "finite": "a finite number",
    "float": "a number",
    "int": "a whole number",
    "string": "text",
    "bool": "true or false",
    "list": "a list",
    "tuple": "a list",
    "dict": "a table",
    "model": "a table",
}
"""Kinds of values by the beginning of an error's type."""


def _demand(field: FieldInfo | None, detail: Mapping[str, Any], ending: str) -> str:
    """Return the requirement on a value in words, from the field's own constraints."""
    context = detail.get("ctx", {})
    if "expected" in context:
        return str(context["expected"]).replace("'", '"')
    if "actual_length" in context:
        length = context.get("min_length", context.get("max_length"))
        return f"{length} values; it has {context['actual_length']}"
    scale = units.UNITS[ending].from_si if ending else float
    own = (
        {key: getattr(m, key) for m in field.metadata for key in _BOUNDS if hasattr(m, key)}
        if field
        else {}
    )
    # The error alone has the bounds of an optional number, and those of all numbers.
    limits = own if own.items() >= context.items() else context
    bounds = [form.format(scale(limits[key])) for key, form in _BOUNDS.items() if key in limits]
    noun = next((noun for kind, noun in _NOUNS.items() if detail["type"].startswith(kind)), "")
    return f"{noun} {' and '.join(bounds)}".strip() or str(detail["msg"])


def in_file(path: Path, content: str) -> Locator:
    """Return a locator for values in a file."""

    def locate(loc: Loc) -> tuple[str, str]:
        line, _ = line_of(content, loc)
        return dotted(loc), f"{path.name}, line {line}" if line else path.name

    return locate


def dotted(loc: Loc) -> str:
    """Format a location, such as ``gait.offsets[2]``."""
    words = ""
    for part in loc:
        words += f"[{part}]" if isinstance(part, int) else f".{part}"
    return words.lstrip(".")


def leaves(table: type[Table]) -> Iterator[tuple[tuple[str, ...], FieldInfo]]:
    """Yield every field of a table and of its inner tables, with its path."""
    for name, field in table.model_fields.items():
        inner = _table_in(field.annotation)
        if inner is None:
            yield (name,), field
        else:
            for path, leaf in leaves(inner):
                yield (name, *path), leaf


def field_help(table: type[Table], name: str) -> str:
    """Return the description of a field from the docstring of its table; empty if it has none."""
    lines = [line.strip() for line in (table.__doc__ or "").splitlines()]
    start = next((i for i, line in enumerate(lines) if line.startswith(f"{name}: ")), len(lines))
    words = [line.partition(": ")[2] for line in lines[start : start + 1]]
    for line in lines[start + 1 :]:
        if not line or line.split(":")[0] in table.model_fields:
            break
        words.append(line)
    return " ".join(words).replace("``", "")


def choices(field: FieldInfo) -> tuple[str, ...]:
    """Return the choices of a field; empty if it has none."""
    # A choice that may be absent is one of a union.
    kinds = (field.annotation, *get_args(field.annotation))
    return next((get_args(kind) for kind in kinds if get_origin(kind) is Literal), ())
