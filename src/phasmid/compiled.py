"""Compile functions of numbers and arrays with numba.

Kernels, the controller and the simulation's loops use these decorators.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import import_module
from inspect import unwrap
from pathlib import Path
from re import findall
from types import ModuleType
from typing import Any

import numpy as np

PACKAGE = Path(__file__).resolve().parent


@cache
def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function of numbers and arrays that is compiled when it is first called.

    Args:
        function: Written in what numba understands; every function that it calls must be an
            argument or be compiled itself.
    """
    # A type check wrapped around the function cannot be compiled.
    return _cached(_numba().njit, error_model="numpy", nogil=True)(unwrap(function))


def _cached(decorator: Callable[..., Any], *arguments: Any, **options: Any) -> Callable[..., Any]:
    """Return a decorator of numba that uses its cache where a folder for it is writable."""

    def decorate(function: Callable[..., Any]) -> Any:
        try:
            return decorator(*arguments, cache=True, **options)(function)
        except RuntimeError:
            return decorator(*arguments, **options)(function)

    return decorate


@cache
def _numba() -> ModuleType:
    """Import numba, and let its cache of a function notice changes of every file it may call.

    By itself the cache looks at the function's own file only.
    """
    # Lazy import: numba takes 0.6 s.
    numba, caching = import_module("numba"), import_module("numba.core.caching")
    locator = caching._SourceFileBackedLocatorMixin
    own_stamp = locator.get_source_stamp

    def stamp(self: Any) -> tuple[Any, ...]:
        return own_stamp(self), _sources(Path(self._py_file))

    locator.get_source_stamp = stamp
    return numba


@cache
def inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that is compiled as a part of its callers.

    A function of many arrays is compiled much sooner this way: each call passes every array as
    several numbers, and each function is compiled together with all that it calls.

    Args:
        function: Written as for `compiled`, and called in one place or in few.
    """
    return _numba().njit(inline="always", nogil=True, error_model="numpy")(unwrap(function))


def gufunc(layout: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return a decorator that makes a NumPy generalised ufunc, compiled when it is first called.

    The leading axes of the arguments broadcast.

    Args:
        layout: Core dimensions as NumPy writes them, such as ``(n),(n)->(n)``. The function takes
            a float or an array of floats for each, and writes the outputs.
    """

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        @cache
        def ufunc() -> Callable[..., Any]:
            float64, guvectorize = _numba().float64, _numba().guvectorize
            inputs, outputs = (findall(r"\(([^)]*)\)", side) for side in layout.split("->"))
            # A scalar output is an array of one number.
            dimensions = [len(findall(r"\w+", core)) for core in inputs]
            dimensions += [max(len(findall(r"\w+", core)), 1) for core in outputs]
            types = tuple(float64[(slice(None),) * n] if n else float64 for n in dimensions)
            made = _cached(guvectorize, layout, nopython=True)(unwrap(function))
            # numba caches the loop apart from the function: of two processes that compile at once
            # it may load the loop of one and the function of the other, and crash.
            made.gufunc_builder.cache = False
            made.add(types)
            made.disable_compile()
            return made.build_ufunc()

        def call(*arrays: Any, **options: Any) -> Any:
            # NaN and infinity pass through.
            with np.errstate(all="ignore"):
                return ufunc()(*arrays, **options)

        return call

    return decorate


def is_compiled(function: Callable[..., Any]) -> bool:
    """Return whether a call of a function does not wait for the compiler.

    Args:
        function: From `compiled`; plain Python never waits.
    """
    if getattr(function, "overloads", True):
        return True
    try:
        return bool(function._cache._cache_file._load_index())  # type: ignore[attr-defined]
    except (AttributeError, OSError):
        # There is no cache.
        return False


@cache
def _sources(file: Path) -> tuple[tuple[str, int, int], ...]:
    """Names, times and sizes of the files of a file's package and of all files of kernels."""
    file = file.resolve()
    if PACKAGE not in file.parents:
        return ()
    package = PACKAGE / file.relative_to(PACKAGE).parts[0]
    files = {*package.rglob("*.py"), *PACKAGE.glob("*/*kernels.py")}
    stats = [(path, path.stat()) for path in sorted(files)]
    return tuple((path.name, stat.st_mtime_ns, stat.st_size) for path, stat in stats)
