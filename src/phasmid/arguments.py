"""Checks of arguments: their kinds, arrays of numbers, and values in messages."""

from __future__ import annotations

import builtins
import inspect
import sys
from collections.abc import Callable, Iterable, Mapping, Set, Sized
from functools import cache, wraps
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, ForwardRef, Literal, TypeVar, Union, get_args, get_origin

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


# Kinds of arguments -------------------------------------------------------------------------------

NOUNS: dict[Any, tuple[str, str]] = {
    Any: ("anything", "values"),
    NoneType: ("None", "None"),
    bool: ("True or False", "booleans"),
    int: ("a whole number", "whole numbers"),
    float: ("a number", "numbers"),
    str: ("text", "texts"),
    Path: ("a path", "paths"),
}
"""One value and several values of a kind, in words."""

SOURCES = {
    "Scenario": 'phasmid.load_scenario("paper")',
    "ScenarioLike": 'phasmid.load_scenario("paper")',
    "Robot": 'phasmid.load_robot("phantomx-ax")',
    "Walk": "phasmid.plan(scenario)",
    "Dataset": "phasmid.simulate(scenario, walk), or phasmid.load_recording(path)",
    "Command": "phasmid.experiment.Command(velocity=(0.05, 0, 0))",
}
"""Where an object of a class comes from."""

Function = TypeVar("Function", bound=Callable[..., Any])


def checked(function: Function) -> Function:
    """Let a function refuse arguments of other kinds than its annotations name, in a sentence.

    Annotations are evaluated at the first call. Arrays are left to the function, which converts
    them.
    """

    @wraps(function)
    def call(*arguments: Any, **keywords: Any) -> Any:
        signature = _signature(function)
        try:
            bound = signature.bind(*arguments, **keywords)
        except TypeError:
            # An argument is absent, or has no parameter: Python names it.
            return function(*arguments, **keywords)
        for name, kind in _annotated(signature):
            if name in bound.arguments:
                check_kind(bound.arguments[name], kind, name)
        return function(*arguments, **keywords)

    return call  # type: ignore[return-value]


def explained(function: Function) -> Function:
    """Let a function of arrays name the argument at fault where it fails.

    A call that succeeds costs nothing: kinds and shapes are looked at after an error of Python or
    NumPy.
    """

    @wraps(function)
    def call(*arguments: Any, **keywords: Any) -> Any:
        try:
            return function(*arguments, **keywords)
        except (AttributeError, IndexError, TypeError, ValueError):
            _explain(function, arguments, keywords)
            raise

    return call  # type: ignore[return-value]


def _annotated(signature: inspect.Signature) -> list[tuple[str, Any]]:
    """Return names and kinds of the parameters of a function that are annotated and single."""
    several = inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD
    return [
        (one.name, one.annotation)
        for one in signature.parameters.values()
        if one.annotation is not one.empty and one.kind not in several
    ]


def _explain(
    function: Callable[..., Any], arguments: tuple[Any, ...], keywords: Mapping[str, Any]
) -> None:
    """Refuse the first argument of another kind or shape than a function's annotations name."""
    signature = _signature(function)
    try:
        bound = signature.bind(*arguments, **keywords).arguments
    except TypeError:
        return
    sizes: dict[str, int] = {}
    for name, kind in _annotated(signature):
        if name not in bound:
            continue
        value = bound[name]
        check_kind(value, kind, name)
        if hasattr(value, "legs"):
            sizes["legs"] = len(value.legs)
        array = next((each for each in (kind, *get_args(kind)) if hasattr(each, "dim_str")), None)
        if array is not None and (value is not None or kind is array):
            _check_shape(value, array.dim_str.split(), name, sizes)


def _check_shape(value: object, dims: list[str], name: str, sizes: dict[str, int]) -> None:
    """Refuse an array without the last axes of its annotation.

    Args:
        value: The array.
        dims: Its axes, such as ``*batch legs 3``.
        name: Its name in the message.
        sizes: Of named axes, to which its own are added.

    Raises:
        InvalidInput: With the shape that it must have.
    """
    shape = numbers(value, name).shape
    last = [axis for axis in dims if axis != "..." and axis[0] not in "*#"]
    own = shape[len(shape) - len(last) :]
    wanted = [int(axis) if axis.isdigit() else sizes.get(axis, axis) for axis in last]
    has_all = len(shape) >= len(last) if len(last) < len(dims) else len(shape) == len(last)
    if not has_all or any(w != s for w, s in zip(wanted, own, strict=True) if isinstance(w, int)):
        leading = ["..."] if len(last) < len(dims) else []
        axes = ", ".join(map(str, [*leading, *wanted]))
        raise InvalidInput(f"{name} has shape {shape}; it must have shape ({axes}).")
    sizes.update(zip(last, own, strict=True))


def check_fields(instance: Any, prefix: str = "", error: type[InvalidInput] = InvalidInput) -> None:
    """Refuse fields of a dataclass whose values are of other kinds than its annotations name.

    Args:
        instance: Its fields are checked, but for arrays.
        prefix: Comes before the names of fields in messages.
        error: Class of the error.

    Raises:
        InvalidInput: Of that class; a field is of another kind.
    """
    kind_of: Any = type(instance)
    for name, kind in _fields(kind_of).items():
        check_kind(getattr(instance, name), kind, prefix + name, error)


def check_arrays(instance: Any) -> None:
    """Refuse fields of a dataclass that are no arrays of the axes that its annotations name.

    Args:
        instance: Its arrays are checked; named axes may have any size.

    Raises:
        InvalidInput: A field has no numbers, or another shape.
    """
    kind_of: Any = type(instance)
    for name, kind in _fields(kind_of).items():
        if hasattr(kind, "dim_str"):
            _check_shape(getattr(instance, name), kind.dim_str.split(), name, {})


def check_kind(
    value: object, kind: Any, name: str, error: type[InvalidInput] = InvalidInput
) -> None:
    """Refuse a value that is not of a kind.

    Args:
        value: The value.
        kind: An annotation, such as ``Sequence[int] | None``.
        name: Its name in the message.
        error: Class of the error.

    Raises:
        InvalidInput: Of that class, with the kind in words.
    """
    if not _fits(value, kind):
        sentence = f"{name} is {described(value)}; it must be {_words(kind)}."
        raise error(sentence, hint=_source(value, kind))


class _Names:
    """The names in a module's annotations.

    Names that only a type checker knows stand for anything; a class that loads slowly is known by
    a text.
    """

    def __init__(self, module: str) -> None:
        self.names = vars(sys.modules[module])

    def __getitem__(self, name: str) -> Any:
        value = self.names.get(name, vars(builtins).get(name, Any))
        return ForwardRef(value) if isinstance(value, str) else value


@cache
def _signature(function: Callable[..., Any]) -> inspect.Signature:
    names: Any = _Names(function.__module__)
    return inspect.signature(function, locals=names, eval_str=True)


@cache
def _fields(kind: Any) -> dict[str, Any]:
    names: Any = _Names(kind.__module__)
    return inspect.get_annotations(kind, locals=names, eval_str=True)


def _fits(value: Any, kind: Any) -> bool:
    """Return whether a value is of a kind; arrays of numbers are not looked at."""
    origin, inner = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return _fits(value, inner[0])
    if origin in (Union, UnionType):
        return any(_fits(value, each) for each in inner)
    if origin is Literal:
        return isinstance(value, str | int) and value in inner
    if kind in (float, int):
        return _is_number(value, kind)
    if kind is bool:
        return isinstance(value, bool | np.bool_)
    if origin is Callable:
        return callable(value) and not isinstance(value, type)
    if isinstance(origin, type) and issubclass(origin, Iterable):
        return _holds(value, origin, inner)
    return _is_of_class(value, kind)


def _is_number(value: Any, kind: type) -> bool:
    """Return whether a value is one number: of Python, or of an array without axes."""
    if hasattr(value, "dtype"):
        return value.ndim == 0 and value.dtype.kind in ("iu" if kind is int else "iuf")
    return isinstance(value, int if kind is int else int | float) and not isinstance(value, bool)


def _holds(value: Any, origin: type, inner: tuple[Any, ...]) -> bool:
    """Return whether a value is a collection, and what it holds of the kinds inside."""
    if isinstance(value, np.ndarray) and value.ndim == 1:
        value = value.tolist()
    if origin is tuple and isinstance(value, list):
        value = tuple(value)
    if isinstance(value, str | bytes) or not isinstance(value, origin):
        return False
    if not isinstance(value, Sized):
        # A generator is not read here.
        return True
    each: Any = value
    if isinstance(value, Mapping):
        return all(_fits(k, inner[0]) and _fits(v, inner[1]) for k, v in value.items())
    if origin is tuple and inner[-1] is not ...:
        return len(value) == len(inner) and all(map(_fits, each, inner))
    return all(_fits(one, inner[0]) for one in each)


def _is_of_class(value: Any, kind: Any) -> bool:
    if isinstance(kind, ForwardRef):
        module, _, name = kind.__forward_arg__.rpartition(".")
        loaded = sys.modules.get(module)
        return loaded is not None and isinstance(value, getattr(loaded, name))
    if kind is Any or not isinstance(kind, type) or hasattr(kind, "dim_str"):
        return True
    if methods := _methods(kind):
        has_all = all(callable(getattr(value, name, None)) for name in methods)
        return has_all and not isinstance(value, type)
    return isinstance(value, kind)


def _methods(kind: type) -> list[str]:
    """Return the methods of a protocol; none of another class."""
    if not getattr(kind, "_is_protocol", False):
        return []
    return [name for name, one in vars(kind).items() if inspect.isfunction(one) and name[0] != "_"]


def _words(kind: Any, several: bool = False) -> str:
    """Return a kind in words: one value, or several."""
    origin, inner = get_origin(kind), get_args(kind)
    if kind in NOUNS:
        return NOUNS[kind][several]
    if origin is Annotated:
        return _words(inner[0], several)
    if origin in (Union, UnionType):
        return " or ".join(_words(each, several) for each in inner)
    if origin is Literal:
        return " or ".join(f'"{each}"' if isinstance(each, str) else str(each) for each in inner)
    if origin is Callable:
        return "functions" if several else "a function"
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return f"a mapping from {_words(inner[0], True)} to {_words(inner[1], True)}"
    if origin is tuple and inner[-1] is not ...:
        return f"{len(inner)} values: {', '.join(_words(each) for each in inner)}"
    if isinstance(origin, type):
        collection = "set" if issubclass(origin, Set) else "list"
        return f"a {collection} of {_words(inner[0], True)}"
    if isinstance(kind, type) and hasattr(kind, "dim_str"):
        return "an array of numbers"
    if methods := _methods(kind):
        return f"an object with the method{'s' * (len(methods) > 1)} {' and '.join(methods)}"
    name = _name(kind)
    if several:
        return f"{name} objects"
    return f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"


def _name(kind: Any) -> str:
    if isinstance(kind, ForwardRef):
        return kind.__forward_arg__.rpartition(".")[2]
    return str(getattr(kind, "__name__", kind))


def _source(value: object, kind: Any) -> str:
    """Return where a value of a kind comes from; empty if that is not known."""
    kinds = get_args(kind) if get_origin(kind) in (Union, UnionType) else (kind,)
    if isinstance(value, type) and any(map(_methods, kinds)):
        return f"{value.__name__}(...), an object of this class"
    if isinstance(value, str) and any(_fits([value], each) for each in kinds):
        return f'["{value}"]'
    sources = (SOURCES.get(_name(each), "") for each in kinds)
    return next((source for source in sources if source), "")
