"""Where results go: into an array of the caller's, or a new one."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from phasmid.errors import InvalidInput


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
