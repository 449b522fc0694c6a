"""Loops as machine code where numba is there, and as plain Python where it is not."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from inspect import unwrap
from typing import Any

from phasmid.batch.compiled import numba


@cache
def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function of numbers and arrays, compiled when it is first called.

    Args:
        function: Written in what numba understands; every function that it calls must be given
            to it as an argument or be compiled itself. Without numba it is returned as it is: the
            same numbers, but for round-off, much slower.
    """
    module = numba()
    if module is None:
        return function
    # A check of its arguments that is wrapped around it cannot be compiled.
    function = unwrap(function)
    options = {"nogil": True, "error_model": "numpy"}
    try:
        return module.njit(cache=True, **options)(function)
    except RuntimeError:
        # No folder can be written to, neither the package's own nor the user's.
        return module.njit(**options)(function)
