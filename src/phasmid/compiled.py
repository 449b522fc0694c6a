"""Loops as machine code where numba is there, and as plain Python where it is not."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from inspect import unwrap
from pathlib import Path
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
    return _made(function)


def _made(function: Callable[..., Any], **options: bool) -> Callable[..., Any]:
    module = numba()
    if module is None:
        return function
    # A check of its arguments that is wrapped around it cannot be compiled.
    function = unwrap(function)
    options |= {"nogil": True}
    try:
        made = module.njit(cache=True, error_model="numpy", **options)(function)
        heed_sources(made, function)
    except (RuntimeError, AttributeError):
        # No folder can be written to, neither the package's own nor the user's; or this numba's
        # cache is another one, which would take old code for new.
        return module.njit(error_model="numpy", **options)(function)
    return made


@cache
def inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """A part of one compiled function, put in its place there.

    A function that hands on many arrays is compiled much sooner this way: each function is
    compiled together with all that it calls, level by level, and hands each array on as many
    numbers.

    Args:
        function: Written as for `compiled`, and called in one place or in few.
    """
    module = numba()
    if module is None:
        return function
    return module.njit(inline="always", nogil=True, error_model="numpy")(unwrap(function))


@cache
def internal(function: Callable[..., Any]) -> Callable[..., Any]:
    """What is compiled for compiled functions that call it, and takes half the time for that.

    Where Python calls it, Python computes it.

    Args:
        function: Written as for `compiled`.
    """
    made: Any = _made(function, no_cpython_wrapper=True, no_cfunc_wrapper=True)
    if made is not function:
        plain = unwrap(function)

        def keep(result: Any) -> None:
            made.overloads[tuple(result.signature.args)] = result

        # Python never finds code that it may call, and asks for some: it gets its own.
        made.add_overload, made._compile_for_args = keep, lambda *_, **__: plain
    return made


def is_compiled(function: Callable[..., Any]) -> bool:
    """Whether a function can be called without waiting for the compiler.

    Args:
        function: What `compiled` gave; what is plain Python never waits.
    """
    if getattr(function, "overloads", True):
        return True
    try:
        return bool(function._cache._cache_file._load_index())  # type: ignore[attr-defined]
    except (AttributeError, OSError):
        # There is no cache.
        return False


def is_kept(function: Callable[..., Any]) -> bool:
    """Whether what is compiled of a function is kept for other processes.

    Args:
        function: What `compiled` gave.
    """
    return hasattr(getattr(function, "_cache", None), "_cache_file")


def heed_sources(made: Any, function: Callable[..., Any]) -> None:
    """Let numba's cache of a function notice changes of any file of the function's room.

    By itself it looks at the function's own file, not at those of the functions that it calls.

    Args:
        made: What numba makes of a function, with a cache.
        function: That function.

    Raises:
        AttributeError: This numba keeps its cache in another way.
    """
    index = made._cache._cache_file
    index._source_stamp = (
        index._source_stamp,
        _sources(_room(Path(function.__code__.co_filename))),
    )


def _room(file: Path) -> Path:
    """The room of phasmid in which a file stands; the folder of a file elsewhere."""
    house = Path(__file__).resolve().parent
    file = file.resolve()
    return house / file.relative_to(house).parts[0] if house in file.parents else file.parent


@cache
def _sources(room: Path) -> tuple[tuple[str, int, int], ...]:
    """A room's files, when they were changed, and their sizes."""
    found = [(path, path.stat()) for path in sorted(room.rglob("*.py"))]
    return tuple((path.name, stat.st_mtime_ns, stat.st_size) for path, stat in found)
