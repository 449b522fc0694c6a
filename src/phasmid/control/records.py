"""NumPy records made from annotated classes, for compiled functions and for Python."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any, TypeVar, get_type_hints

import numpy as np

MAX_LEGS = 8
"""Legs of every record."""

Kind = TypeVar("Kind")


def record_of(kind: type) -> np.dtype[Any]:
    """Return the dtype of a record with the fields of a dataclass.

    Args:
        kind: Its fields are float, int, dataclasses, or jaxtyping's Float and Int arrays with
            dimensions of whole numbers and ``legs``.
    """
    return np.dtype([(name, *_entry(hint)) for name, hint in get_type_hints(kind).items()])


def view_of(record: Any, kind: type[Kind], leg_count: int) -> Kind:
    """Return the fields of a record as arrays that share its memory, without absent legs.

    Args:
        record: Of the dtype that `record_of` returns.
        kind: The dataclass.
        leg_count: Number of legs.
    """
    parts = {}
    for name, hint in get_type_hints(kind).items():
        value = record[name]
        shape = getattr(hint, "dim_str", "").split()
        if is_dataclass(hint):
            assert isinstance(hint, type)
            value = _scalars_of(hint)(value)
        elif "legs" in shape:
            value = value[(slice(None),) * shape.index("legs") + (slice(leg_count),)]
        elif hint in (float, int):
            value = hint(value)
        parts[name] = value
    return kind(**parts)


def fill(record: Any, values: Any, leg_count: int) -> None:
    """Copy the fields of a dataclass into a record.

    Args:
        record: Written.
        values: Instance of the record's dataclass, with arrays of its own.
        leg_count: Number of legs.
    """
    view = view_of(record, type(values), leg_count)
    for name in (field.name for field in fields(values)):
        value = getattr(values, name)
        if isinstance(value, np.ndarray):
            getattr(view, name)[...] = value
        else:
            record[name] = value


@cache
def _scalars_of(kind: type[Kind]) -> Callable[[Any], Kind]:
    """Return a subclass whose attributes read and write the fields of one record."""

    def field(name: str) -> property:
        def read(self: Any) -> Any:
            return self.record[name]

        def write(self: Any, value: Any) -> None:
            self.record[name] = value

        return property(read, write)

    def keep(self: Any, record: Any) -> None:
        self.record = record

    names = {name: field(name) for name in get_type_hints(kind)}
    return type(kind.__name__, (kind,), {"__init__": keep, **names})


def _entry(hint: Any) -> tuple[Any, ...]:
    if hint in (float, int):
        return (np.dtype(hint),)
    if is_dataclass(hint):
        assert isinstance(hint, type)
        return (record_of(hint),)
    shape = tuple(MAX_LEGS if name == "legs" else int(name) for name in hint.dim_str.split())
    number = np.int64 if "int64" in hint.dtypes else np.float64
    return np.dtype(number), shape
