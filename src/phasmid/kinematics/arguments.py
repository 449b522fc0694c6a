"""What callers give: legs, and arrays of real numbers whose leading axes broadcast."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from phasmid.arguments import check_type
from phasmid.errors import InvalidInput
from phasmid.robot import Leg, LegArrays, Robot


@runtime_checkable
class HasLengths(Protocol):
    """A leg, or the arrays of several legs; lengths broadcast against the leading axes."""

    @property
    def lengths(self) -> Float[np.ndarray, "*legs 3"]:
        """Lengths of coxa, femur and tibia [m]."""

    @property
    def lateral_offsets(self) -> Float[np.ndarray, "*legs 3"]:
        """Lateral offsets of coxa, femur and tibia [m]."""


def check_leg(leg: object, *types: type) -> None:
    """Refuse what is no leg.

    Args:
        leg: What was given.
        types: What it may be; anything with lengths by default.

    Raises:
        InvalidInput: It is something else.
    """
    must, hint = "a Leg or the arrays of a robot's legs", "robot.arrays, or robot.legs[0]"
    # The protocol is asked last, since it takes longest.
    check_type("leg", leg, types or (Leg, LegArrays, HasLengths), must, hint)


def geometry(leg: HasLengths) -> tuple[np.ndarray, np.ndarray]:
    """Return a leg's lengths, shape (..., 3), and its foot's offset from its plane, shape (...)."""
    return leg.lengths, np.asarray(leg.lateral_offsets.sum(axis=-1))


def as_printed(form: str) -> bool:
    """Whether an equation is asked for as the paper prints it.

    Raises:
        InvalidInput: There is no such form.
    """
    if form not in ("corrected", "as-printed"):
        raise InvalidInput(
            f'form is "{form}"; it must be "corrected" or "as-printed".', hint='"corrected"'
        )
    return form == "as-printed"


def number(name: str, value: object) -> float:
    """One finite number.

    Raises:
        InvalidInput: It is an array, no real number, or not finite.
    """
    array = _real(value)
    if array is None or array.ndim > 0 or not np.isfinite(array):
        what = f"an array of shape {np.shape(array)}" if array is not None and array.ndim else value
        raise InvalidInput(f"{name} is {what}; it must be one finite number.")
    return float(array)


def numbers(**arrays: object) -> dict[str, np.ndarray]:
    """Arrays of floats.

    Raises:
        InvalidInput: Something is not made of real numbers.
    """
    found = {}
    for name, values in arrays.items():
        array = _real(values)
        if array is None:
            raise InvalidInput(f"{name} is no array of real numbers; it must be one.")
        found[name] = array
    return found


def _real(values: object) -> np.ndarray | None:
    """An array of floats; nothing where that would drop or invent something."""
    try:
        array = np.asarray(values)
        return array.astype(float, copy=False) if array.dtype.kind in "biuf" else None
    except (TypeError, ValueError):
        return None


def lead(name: str, array: np.ndarray, tail: tuple[int, ...]) -> tuple[int, ...]:
    """The axes before an array's entries of shape ``tail``.

    Raises:
        InvalidInput: An entry has another shape.
    """
    axes = array.shape[: max(array.ndim - len(tail), 0)]
    if array.shape[len(axes) :] != tail:
        raise InvalidInput(
            f"{name} has shape {array.shape}; it must end in {', '.join(map(str, tail))}."
        )
    return axes


def shared_axes(
    leads: Mapping[str, tuple[int, ...]], legs: tuple[int, ...] = ()
) -> tuple[int, ...]:
    """Leading axes broadcast together; the last are ``legs``.

    Raises:
        InvalidInput: They do not broadcast.
    """
    shapes = {*leads.values(), legs}
    try:
        # NumPy takes some microseconds even where there is nothing to broadcast.
        axes = shapes.pop() if len(shapes) == 1 else np.broadcast_shapes(*shapes)
    except ValueError:
        axes = None
    if axes is None or axes[len(axes) - len(legs) :] != legs:
        listed = ", ".join(f"{name} {shape}" for name, shape in leads.items())
        also = f" with the legs' {legs}" if legs else ""
        raise InvalidInput(f"the leading axes are {listed}; they must broadcast together{also}.")
    return axes


def leading_axes(
    arrays: Mapping[str, np.ndarray], tail: tuple[int, ...], legs: tuple[int, ...] = ()
) -> tuple[int, ...]:
    """The axes that arrays share before their entries of shape ``tail``; the last are ``legs``.

    Raises:
        InvalidInput: An entry has another shape, or the axes before do not broadcast.
    """
    leads = {name: lead(name, array, tail) for name, array in arrays.items()}
    return shared_axes(leads, legs)


def threes(leg: HasLengths, **arrays: object) -> list[np.ndarray]:
    """Arrays of floats with three numbers for each joint or axis, shape (..., 3), that fit a leg.

    Args:
        leg: The leg, or the arrays of several, checked already.
        arrays: Arrays of shape (..., 3) by their names.

    Raises:
        InvalidInput: Something is not made of real numbers, has not three of them, or does not
            broadcast.
    """
    given = numbers(**arrays)
    leading_axes(given, (3,), leg.lengths.shape[:-1])
    return list(given.values())


def alike(**arrays: object) -> list[np.ndarray]:
    """Arrays of floats, broadcast to one shape.

    Raises:
        InvalidInput: Something is not made of real numbers, or does not broadcast.
    """
    given = numbers(**arrays)
    axes = leading_axes(given, ())
    return [np.broadcast_to(array, axes) for array in given.values()]


def per_leg(robot: Robot, **arrays: object) -> list[np.ndarray]:
    """Arrays with three numbers for each leg of a robot, shape (..., L, 3).

    Raises:
        InvalidInput: It is no robot, or an array does not fit it or the others.
    """
    check_robot(robot)
    given = numbers(**arrays)
    leading_axes(given, (len(robot.legs), 3))
    return list(given.values())


def check_robot(robot: object) -> None:
    """Refuse what is no robot.

    Raises:
        InvalidInput: It is something else.
    """
    check_type("robot", robot, (Robot,), "a Robot", 'phasmid.load_robot("phantomx-paper")')
