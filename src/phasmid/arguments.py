"""What callers give: values of a kind, numbers, arrays of numbers, and names of files."""

from __future__ import annotations

from collections.abc import Sized
from pathlib import Path

import numpy as np

from phasmid.errors import InvalidInput

SHORT = 40
"""Values of more characters than this are not shown."""


def check_type(
    name: str,
    value: object,
    types: tuple[type, ...],
    must: str,
    hint: str = "",
    *,
    error: type[InvalidInput] = InvalidInput,
) -> None:
    """Refuse a thing of another kind than these.

    Args:
        name: Of the argument.
        value: What was given.
        types: What it may be.
        must: The same in words.
        hint: What to try.
        error: What is raised.

    Raises:
        InvalidInput: It is something else.
    """
    if not isinstance(value, types):
        raise error(f"{name} is {described(value)}; it must be {must}.", hint=hint)


def check_number(name: str, value: object, *, error: type[InvalidInput] = InvalidInput) -> None:
    """Refuse what is no real number; true and false are none.

    Args:
        name: Of the argument.
        value: What was given.
        error: What is raised.

    Raises:
        InvalidInput: It is something else.
    """
    kinds = (int, float, np.integer, np.floating)
    if isinstance(value, bool):
        raise error(f"{name} is {str(value).lower()}; it must be a number.")
    check_type(name, value, kinds, "a number", error=error)


def check_callable(name: str, value: object) -> None:
    """Refuse what cannot be called, where there is something.

    Raises:
        InvalidInput: It is no function and not None.
    """
    if value is not None and not callable(value):
        raise InvalidInput(f"{name} is {described(value)}; it must be a function, or None.")


def path_of(name: str, value: object) -> Path:
    """The path that a caller gives.

    Args:
        name: Of the argument.
        value: Text or a path.

    Raises:
        InvalidInput: It is neither, or no file can be called so.
    """
    check_type(name, value, (str, Path), "the name of a file or folder, as text or a Path")
    path = Path(str(value))
    if "\0" in str(path):
        raise InvalidInput(f"{name} holds a character of number 0; no file can be called so.")
    return path


def numbers(values: object, name: str) -> np.ndarray:
    """A new array of floats.

    Raises:
        InvalidInput: The values are not real numbers, or ragged.
    """
    try:
        array = np.asarray(values)
    except (TypeError, ValueError):
        array = np.empty(0, dtype=object)
    if array.dtype.kind not in "biuf":
        raise InvalidInput(f"{name} is {described(values)}; it must be an array of numbers.")
    return np.array(array, dtype=float)


def described(value: object) -> str:
    """A value in a few words, for messages."""
    if isinstance(value, type):
        return f"the class {value.__name__}"
    if isinstance(value, np.ndarray):
        return f"an array of shape {value.shape}"
    plain = type(value).__repr__ is object.__repr__
    if not plain and not (isinstance(value, Sized) and len(value) > SHORT):
        text = f'"{value}"' if isinstance(value, str) else repr(value)
        if len(text) <= SHORT and text.isprintable():
            return text
    return f"of type {type(value).__name__}"
