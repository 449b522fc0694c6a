"""Validation of numbers and arrays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from phasmid.arguments import numbers
from phasmid.errors import InvalidInput


def finite(values: object, name: str) -> np.ndarray:
    """Return a new array of floats.

    Raises:
        InvalidInput: A value is not a finite real number.
    """
    array = numbers(values, name)
    if not np.isfinite(array).all():
        index = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        place = f"{name}[{', '.join(map(str, index))}]" if index else name
        raise InvalidInput(f"{place} is {array[index]:g}; it must be a finite number.")
    return array


def between(value: float, name: str, low: float, high: float, unit: str = "") -> None:
    """Refuse a number outside bounds, or NaN."""
    if not low <= value <= high:
        raise InvalidInput(
            f"{name} is {value:g}{unit}; it must be between {low:g} and {high:g}{unit}."
        )


def broadcast(values: np.ndarray, shape: Sequence[int], name: str) -> np.ndarray:
    """Return a read-only view of another shape.

    Raises:
        InvalidInput: The shapes do not fit.
    """
    try:
        return np.broadcast_to(values, tuple(shape))
    except ValueError:
        raise InvalidInput(
            f"{name} has shape {values.shape}; it must fit {tuple(shape)}."
        ) from None
