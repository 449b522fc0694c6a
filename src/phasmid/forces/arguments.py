"""What callers give: numbers, arrays of numbers, and values of a kind."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from phasmid.errors import InvalidInput

SHORT = 40
"""Values of more characters than this are not shown."""


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


def finite(values: object, name: str) -> np.ndarray:
    """A new array of finite floats.

    Raises:
        InvalidInput: The values are not finite real numbers, or ragged.
    """
    array = numbers(values, name)
    if not np.isfinite(array).all():
        index = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        place = f"{name}[{', '.join(map(str, index))}]" if index else name
        raise InvalidInput(f"{place} is {array[index]:g}; it must be a finite number.")
    return array


def number(value: object, name: str) -> float:
    """One number.

    Raises:
        InvalidInput: The value is none.
    """
    if not isinstance(value, int | float | np.integer | np.floating):
        raise InvalidInput(f"{name} is {described(value)}; it must be a number.")
    return float(value)


def between(value: object, name: str, low: float, high: float, unit: str = "") -> float:
    """A number within bounds.

    Raises:
        InvalidInput: The value is no number, or beyond them.
    """
    found = number(value, name)
    if not low <= found <= high:
        raise InvalidInput(
            f"{name} is {found:g}{unit}; it must be between {low:g} and {high:g}{unit}."
        )
    return found


def broadcast(values: np.ndarray, shape: Sequence[int], name: str) -> np.ndarray:
    """A read-only number for each of a shape's entries.

    Raises:
        InvalidInput: The shapes do not fit.
    """
    try:
        return np.broadcast_to(values, tuple(shape))
    except ValueError:
        raise InvalidInput(
            f"{name} has shape {values.shape}; it must fit {tuple(shape)}."
        ) from None


def check_kind(value: object, kind: type, name: str, hint: str) -> None:
    """Refuse a value that is not of a kind.

    Raises:
        InvalidInput: It is of another.
    """
    if not isinstance(value, kind):
        raise InvalidInput(f"{name} is {described(value)}; it must be {kind.__name__}.", hint=hint)


def described(value: object) -> str:
    """A value in a few words, for messages."""
    if isinstance(value, type):
        return f"the class {value.__name__}"
    if isinstance(value, np.ndarray):
        return f"an array of shape {value.shape}"
    text = f'"{value}"' if isinstance(value, str) else repr(value)
    return text if len(text) <= SHORT and text.isprintable() else f"of type {type(value).__name__}"
