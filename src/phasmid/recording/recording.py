"""Construction and validation of recordings."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, nearest, plain
from phasmid.recording.channels import CHANNELS, COORDINATES

if TYPE_CHECKING:
    import xarray

FORMAT = 1
"""Version of the recording's names, units and attributes."""

Recording: TypeAlias = "xarray.Dataset"
"""A dataset whose variables are channels; the name is text so that importing it is quick."""

Attributes: TypeAlias = Mapping[str, str | int | float]
"""Where a recording comes from."""


def new_recording(
    time: Float[np.ndarray, " time"],
    channels: Mapping[str, np.ndarray],
    attributes: Attributes,
    *,
    own: bool = False,
) -> Recording:
    """Return a recording of arrays.

    Args:
        time: Time of each sample [s], increasing, shape (N,).
        channels: Arrays by channel name, in the channels' units and shapes; see `CHANNELS`.
            Absent channels are left out.
        attributes: Scenario and robot as text, versions, and the end of the run.
            A JSON list of text in ``leg_names`` becomes the coordinate ``leg_name`` along ``leg``.
        own: Keep these arrays instead of copies.

    Returns:
        A dataset with coordinates, units and the format's version.

    Raises:
        InvalidInput: A name is unknown, a shape is wrong, or time does not increase.
    """
    import xarray

    time = _checked_time(time)
    arrays = {name: _checked(name, channels[name], not own) for name in _in_order(channels)}
    legs = _leg_count(arrays)
    sizes = {"time": len(time), **{dim: len(labels) for dim, labels in COORDINATES.items()}}
    for name, array in arrays.items():
        _check_shape(name, array, sizes | ({} if legs is None else {"leg": legs}))
    variables = {
        name: (
            CHANNELS[name].dims,
            array,
            {"units": CHANNELS[name].units, "long_name": CHANNELS[name].long_name},
        )
        for name, array in arrays.items()
    }
    used = {dim for name in arrays for dim in CHANNELS[name].dims}
    coordinates: dict[str, Any] = {"time": ("time", time, {"units": "s", "long_name": "time"})}
    if legs is not None:
        coordinates["leg"] = ("leg", np.arange(1, legs + 1), {"long_name": "leg, from 1"})
        names = _leg_names(attributes, legs)
        if names:
            coordinates["leg_name"] = ("leg", names, {"long_name": "name of the leg"})
    for dim, labels in COORDINATES.items():
        if dim in used:
            coordinates[dim] = (dim, list(labels))
    return xarray.Dataset(variables, coordinates, _checked_attributes(attributes))


def _in_order(channels: Mapping[str, np.ndarray]) -> list[str]:
    for name in channels:
        if name not in CHANNELS:
            guess = nearest(name, CHANNELS)
            raise InvalidInput(
                f'a recording has no channel "{name}".',
                hint=f'"{guess}"' if guess else f"one of {', '.join(CHANNELS)}",
            )
    return [name for name in CHANNELS if name in channels]


def _checked_time(time: np.ndarray) -> np.ndarray:
    time = np.array(time, dtype=np.float64)
    if time.ndim != 1 or len(time) == 0:
        raise InvalidInput(
            f"time has shape {time.shape}; it must be one row with at least one sample."
        )
    if not np.isfinite(time).all():
        first = int(np.argmin(np.isfinite(time)))
        raise InvalidInput(f"recording sample {first}: time is {time[first]}; it must be finite.")
    steps = np.diff(time)
    if (steps <= 0).any():
        late = int(np.argmax(steps <= 0)) + 1
        raise InvalidInput(
            f"recording sample {late}: time {time[late]:.6g} s does not follow "
            f"{time[late - 1]:.6g} s."
        )
    return time


def _checked(name: str, array: np.ndarray, copy: bool) -> np.ndarray:
    """Return an array in the channel's type; values may be NaN or infinite."""
    array, kind = np.asarray(array), CHANNELS[name].kind
    if array.dtype.kind not in ("b" if kind == "bool" else "fiu"):
        wanted = "true or false" if kind == "bool" else "real numbers"
        raise InvalidInput(f'channel "{name}" holds {array.dtype} values; it must hold {wanted}.')
    return array.astype(np.bool_ if kind == "bool" else np.float64, copy=copy)


def _leg_count(arrays: Mapping[str, np.ndarray]) -> int | None:
    """Return the number of legs of the first channel with legs."""
    for name, array in arrays.items():
        if "leg" in CHANNELS[name].dims and array.ndim >= 2:
            return int(array.shape[1])
    return None


def _leg_names(attributes: Attributes, legs: int) -> list[str]:
    """Return the names in the attribute ``leg_names``; none where it does not name each leg."""
    try:
        names = json.loads(str(attributes.get("leg_names", "[]")))
    except (ValueError, RecursionError):
        return []
    each = isinstance(names, list) and all(isinstance(name, str) for name in names)
    return [plain(name) for name in names] if each and len(names) == legs else []


def _check_shape(name: str, array: np.ndarray, sizes: Mapping[str, int]) -> None:
    dims = CHANNELS[name].dims
    wanted = tuple(sizes.get(dim, -1) for dim in dims)
    if array.shape != wanted or 0 in wanted:
        needed = ", ".join(
            f"{dim} {size}" if size > 0 else dim for dim, size in zip(dims, wanted, strict=True)
        )
        raise InvalidInput(
            f'channel "{name}" has shape {array.shape}; it must be ({needed}).',
        )


def _checked_attributes(attributes: Attributes) -> dict[str, str | int | float]:
    checked: dict[str, str | int | float] = {}
    for name, value in attributes.items():
        value = value.item() if isinstance(value, np.generic) else value
        if not isinstance(value, str | int | float):
            raise InvalidInput(
                f'attribute "{name}" is {type(value).__name__}; it must be text or a number.'
            )
        if isinstance(value, int) and abs(value) >= 2**63:
            raise InvalidInput(f'attribute "{name}" is a whole number of more than 64 bits.')
        try:
            whole = "\0" not in f"{name}{value}" and f"{name}{value}".encode()
        except UnicodeEncodeError:
            whole = False
        if not whole:
            raise InvalidInput(f'attribute "{name!r}" is not text that a file can hold.')
        checked[name] = value
    checked["format"] = FORMAT
    return checked
