"""What callers give: numbers within bounds, and arrays of numbers that fit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from phasmid.arguments import described, numbers
from phasmid.errors import InvalidInput


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
