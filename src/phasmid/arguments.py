"""Conversion of arguments: arrays of numbers, and values in messages."""

from __future__ import annotations

from collections.abc import Sized

import numpy as np

from phasmid.errors import InvalidInput

SHORT = 40
"""Values of more characters than this are not shown."""


def numbers(values: object, name: str) -> np.ndarray:
    """Return a new array of floats.

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
    """Describe a value in a few words, for messages."""
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
