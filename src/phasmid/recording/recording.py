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

LATEST = 2**31
"""Time that a recording does not reach [s]: 68 years, the end of the stamps of ROS 2."""

Recording: TypeAlias = "xarray.Dataset"
"""A dataset whose variables are channels; the name is text so that importing it is quick."""

Attributes: TypeAlias = Mapping[str, str | int | float]
"""Where a recording comes from."""


def new_recording(
    time: Float[np.ndarray, " time"], channels: Mapping[str, np.ndarray], attributes: Attributes
) -> Recording:
    """Return a recording of arrays, which it shares where they have the channels' types.

    Args:
        time: Time of each sample [s], increasing, shape (N,).
        channels: Arrays by channel name, in the channels' units and shapes; see `CHANNELS`.
            Absent channels are left out.
        attributes: Scenario and robot as text, versions, and the end of the run.
            A JSON list of text in ``leg_names`` becomes the coordinate ``leg_name`` along ``leg``.

    Returns:
        A dataset with coordinates, units and the format's version.

    Raises:
        InvalidInput: A name is unknown, a shape is wrong, or time does not increase.
    """
    import xarray

    arrays = {name: _checked(name, channels[name]) for name in _in_order(channels)}
    variables = {
        name: (
            CHANNELS[name].dims,
            array,
            {"units": CHANNELS[name].units, "long_name": CHANNELS[name].long_name},
        )
        for name, array in arrays.items()
    }
    used = {dim for name in arrays for dim in CHANNELS[name].dims}
    coordinates: dict[str, Any] = {dim: list(names) for dim, names in COORDINATES.items()}
    coordinates = {dim: names for dim, names in coordinates.items() if dim in used}
    coordinates["time"] = "time", _checked_time(time), {"units": "s", "long_name": "time"}
    _check_shapes(len(coordinates["time"][1]), arrays)
    recording = xarray.Dataset(variables, coordinates, _checked_attributes(attributes))
    if 0 in recording.sizes.values():
        raise InvalidInput("a recording must have at least one leg.")
    legs = recording.sizes.get("leg")
    if legs is not None:
        numbers, names = np.arange(1, legs + 1), _leg_names(attributes, legs)
        recording.coords["leg"] = "leg", numbers, {"long_name": "leg, from 1"}
        if names:
            recording.coords["leg_name"] = "leg", names, {"long_name": "name of the leg"}
    return recording


def check_time(recording: Recording) -> None:
    """Refuse a dataset without times, which is no recording.

    Raises:
        InvalidInput: It has none.
    """
    if "time" not in recording.coords:
        raise InvalidInput(
            "the dataset has no coordinate time; it must be a recording, as of phasmid.simulate."
        )


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
    if not np.abs(time).max() < LATEST:
        first = int(np.argmax(np.abs(time) >= LATEST))
        raise InvalidInput(
            f"recording sample {first}: time is {time[first]:g} s; it must be within {LATEST:g} s."
        )
    steps = np.diff(time)
    if (steps <= 0).any():
        late = int(np.argmax(steps <= 0)) + 1
        raise InvalidInput(
            f"recording sample {late}: time {time[late]:.6g} s does not follow "
            f"{time[late - 1]:.6g} s."
        )
    return time


def _check_shapes(samples: int, arrays: Mapping[str, np.ndarray]) -> None:
    """Refuse arrays that do not have the axes of their channels, or another number of legs."""
    sizes = {"time": samples} | {dim: len(names) for dim, names in COORDINATES.items()}
    for name, array in arrays.items():
        dims = CHANNELS[name].dims
        if "leg" in dims and len(dims) == array.ndim:
            sizes.setdefault("leg", array.shape[dims.index("leg")])
        if array.shape != tuple(sizes.get(dim) for dim in dims):
            axes = ", ".join(f"{sizes.get(dim, 'any')} of {dim}" for dim in dims)
            raise InvalidInput(f'channel "{name}" has shape {array.shape}; it must have {axes}.')


def _checked(name: str, array: np.ndarray) -> np.ndarray:
    """Return an array in the channel's type; values may be NaN or infinite."""
    array, kind = np.asarray(array), CHANNELS[name].kind
    if array.dtype.kind not in ("b" if kind == "bool" else "fiu"):
        wanted = "true or false" if kind == "bool" else "real numbers"
        raise InvalidInput(f'channel "{name}" holds {array.dtype} values; it must hold {wanted}.')
    return array.astype(np.bool_ if kind == "bool" else np.float64, copy=False)


def _leg_names(attributes: Attributes, legs: int) -> list[str]:
    """Return the names in the attribute ``leg_names``; none where it does not name each leg."""
    try:
        names = json.loads(str(attributes.get("leg_names", "[]")))
    except (ValueError, RecursionError):
        return []
    each = isinstance(names, list) and all(isinstance(name, str) for name in names)
    return [plain(name) for name in names] if each and len(names) == legs else []


def _checked_attributes(attributes: Attributes) -> dict[str, str | int | float]:
    checked: dict[str, str | int | float] = {}
    for name, value in attributes.items():
        value = value.item() if isinstance(value, np.generic) else value
        # A whole number of more than 64 bits is an object to NumPy.
        if np.asarray(value).dtype.kind not in "biufU" or np.ndim(value):
            raise InvalidInput(f'attribute "{plain(name)}" must be text or a number.')
        if any(c == "\0" or "\ud800" <= c <= "\udfff" for c in f"{name}{value}"):
            raise InvalidInput(f'attribute "{plain(name)}" is not text that a file can hold.')
        checked[name] = value
    checked["format"] = FORMAT
    return checked
