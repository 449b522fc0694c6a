"""What callers give: arrays of numbers whose leading axes broadcast, and where results go."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from phasmid.errors import InvalidInput


def numbers(**arrays: object) -> dict[str, np.ndarray]:
    """Arrays of floats.

    Raises:
        InvalidInput: Something is not made of real numbers.
    """
    found = {}
    for name, values in arrays.items():
        try:
            array = np.asarray(values)
            if array.dtype.kind not in "biuf":
                raise TypeError
            found[name] = array.astype(float, copy=False)
        except (TypeError, ValueError):
            raise InvalidInput(f"{name} is no array of real numbers; it must be one.") from None
    return found


def leading_axes(
    arrays: Mapping[str, np.ndarray], tail: tuple[int, ...], legs: tuple[int, ...]
) -> tuple[int, ...]:
    """The axes that arrays share before their entries of shape ``tail``; the last are ``legs``.

    Raises:
        InvalidInput: An entry has another shape, or the axes before do not broadcast.
    """
    shapes = {}
    for name, array in arrays.items():
        if array.shape[-len(tail) :] != tail:
            raise InvalidInput(
                f"{name} has shape {array.shape}; it must end in {', '.join(map(str, tail))}."
            )
        shapes[name] = array.shape[: -len(tail)]
    try:
        axes = np.broadcast_shapes(*shapes.values(), legs)
    except ValueError:
        axes = None
    if axes is None or axes[len(axes) - len(legs) :] != legs:
        listed = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        also = f" with the legs' {legs}" if legs else ""
        raise InvalidInput(
            f"the leading axes are {listed}; they must broadcast together{also}."
        ) from None
    return axes


def room(
    out: np.ndarray | None, shape: tuple[int, ...], given: Mapping[str, np.ndarray]
) -> np.ndarray:
    """The array to fill: the caller's, if it fits, or a new one.

    Raises:
        InvalidInput: It has another shape or type, cannot be written to, or lies in part over an
            input.
    """
    if out is None:
        return np.empty(shape)
    if not _fits(out, shape):
        what = f"{type(out).__name__} of shape {np.shape(out)}"
        raise InvalidInput(f"out is {what}; it must be an array of float64 of shape {shape}.")
    if not out.flags.writeable:
        raise InvalidInput("out is read-only; it must be an array that can be written to.")
    for name, array in given.items():
        same = array.shape == out.shape and array.strides == out.strides
        same = same and array.__array_interface__["data"] == out.__array_interface__["data"]
        if np.may_share_memory(out, array) and not same:
            raise InvalidInput(
                f"out shares memory with {name}; it must be {name} itself or an array of its own."
            )
    return out


def _fits(out: object, shape: tuple[int, ...]) -> bool:
    return isinstance(out, np.ndarray) and out.dtype == np.float64 and out.shape == shape
