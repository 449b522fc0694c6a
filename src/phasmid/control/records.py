"""NumPy records made from annotated classes, for compiled functions and for Python."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from functools import cache
from typing import Annotated, Any, TypeVar, cast, get_args, get_origin, get_type_hints

import numpy as np

MAX_LEGS = 8
"""Legs of every record."""

NUMBERS = float, int, bool

Kind = TypeVar("Kind")


def record_of(kind: type) -> np.dtype[Any]:
    """Return the dtype of a record with the fields of a dataclass.

    Args:
        kind: Its fields are float, int, bool (stored as int), dataclasses, jaxtyping's Float and
            Int arrays with dimensions of whole numbers and ``legs``, or arrays of dataclasses such
            as ``Annotated[list[Foot], "legs"]``.
    """
    hints = get_type_hints(kind, include_extras=True)
    return np.dtype([(name, *_entry(hint)) for name, hint in hints.items()])


def view_of(records: np.ndarray, kind: type[Kind], leg_count: int) -> Kind:
    """Return an instance of a dataclass whose fields share the memory of the first of some records.

    Arrays leave out absent legs. Assignment to a field writes into the record.

    Args:
        records: Of the dtype that `record_of` returns, shape (1+,).
        kind: The dataclass.
        leg_count: Number of legs.
    """
    view: Kind = object.__new__(_view_type(cast(Any, kind)))
    parts: dict[str, Any] = {"_records": records}
    for name, hint in get_type_hints(kind, include_extras=True).items():
        shape = getattr(hint, "dim_str", "").split()
        if is_dataclass(hint):
            assert isinstance(hint, type)
            parts[name] = view_of(records[name], hint, leg_count)
        elif get_origin(hint) is Annotated:
            (element,), dims = get_args(get_args(hint)[0]), hint.__metadata__[0]
            part = records[name][0]
            count = leg_count if dims == "legs" else len(part)
            parts[name] = [view_of(part[i : i + 1], element, leg_count) for i in range(count)]
        elif "legs" in shape:
            trimmed = (0,) + (slice(None),) * shape.index("legs") + (slice(leg_count),)
            parts[name] = records[name][trimmed]
        elif hint in NUMBERS:
            parts[f"_{name}"] = records[name][:1]
        else:
            parts[name] = records[name][0]
    vars(view).update(parts)
    return view


def record_behind(view: Any) -> Any:
    """Return the record whose memory a view shares."""
    return view._records[0]


def fill(view: Any, values: Any) -> None:
    """Copy the fields of one instance of a dataclass into another, which may be a view.

    Args:
        view: Written.
        values: Instance of the same dataclass.
    """
    for name in (field.name for field in fields(values)):
        value = getattr(values, name)
        if is_dataclass(value):
            fill(getattr(view, name), value)
        elif isinstance(value, np.ndarray):
            getattr(view, name)[...] = value
        else:
            setattr(view, name, value)


@cache
def _view_type(kind: Any) -> Any:
    """Return a subclass whose numbers are read from and written to a record."""

    def field(name: str) -> property:
        number = f"_{name}"
        return property(lambda self: getattr(self, number).item())

    def assign(self: Any, name: str, value: Any) -> None:
        if name in numbers:
            getattr(self, f"_{name}")[0] = value
        else:
            getattr(self, name)[...] = value

    numbers = [name for name, hint in get_type_hints(kind).items() if hint in NUMBERS]
    members = {name: field(name) for name in numbers}
    return type(kind.__name__, (kind,), {**members, "__setattr__": assign})


def _entry(hint: Any) -> tuple[Any, ...]:
    if hint in NUMBERS:
        return (np.dtype(float if hint is float else int),)
    if is_dataclass(hint):
        assert isinstance(hint, type)
        return (record_of(hint),)
    if get_origin(hint) is Annotated:
        (element,), dims = get_args(get_args(hint)[0]), hint.__metadata__[0]
        return record_of(element), _shape(dims)
    return np.dtype(np.int64 if "int64" in hint.dtypes else np.float64), _shape(hint.dim_str)


def _shape(dims: str) -> tuple[int, ...]:
    return tuple(MAX_LEGS if name == "legs" else int(name) for name in dims.split())
