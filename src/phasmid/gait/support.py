"""Static stability: the support margin."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Bool, Float

from phasmid.arguments import numbers
from phasmid.errors import InvalidInput
from phasmid.gait.gait import FEWEST_FEET
from phasmid.units import plain_number

SAME_PLACE = 1e-9
"""Feet closer than this stand in one place [m]."""


def support_margin(
    feet: Float[np.ndarray, "*batch legs 2"],
    stance: Bool[np.ndarray, "*batch legs"],
    centre_of_mass: Float[np.ndarray, "*batch 2"],
) -> Float[np.ndarray, "*batch"]:
    """Return the distance of the projected centre of mass from the edge of the support polygon.

    Args:
        feet: Horizontal positions of the feet [m], shape (..., L, 2).
        stance: Feet that stand, shape (..., L).
        centre_of_mass: Horizontal position, in the same axes [m], shape (..., 2).

    Returns:
        Margin [m], positive inside the polygon, negative outside; minus infinity where fewer
        than three feet stand or they lie on a line, shape (...).

    Raises:
        InvalidInput: The shapes do not fit.
    """
    # Lazy import: numba takes 0.6 s.
    from phasmid.gait.support_kernels import support_margins

    feet = numbers(feet, "feet")
    if feet.ndim < 2 or feet.shape[-1] != 2:
        raise InvalidInput(f"feet has the shape {feet.shape}; it must be (..., legs, 2).")
    legs, batch = feet.shape[-2], feet.shape[:-2]
    points = _rows("centre_of_mass", numbers(centre_of_mass, "centre_of_mass"), (*batch, 2))
    standing = _rows("stance", numbers(stance, "stance").astype(bool), (*batch, legs))
    margins = np.empty(len(points))
    support_margins(np.ascontiguousarray(feet.reshape(-1, legs, 2)), standing, points, margins)
    return margins.reshape(batch)


def _rows(name: str, values: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Return values with one row for each sample of the feet."""
    try:
        rows = np.broadcast_to(values, shape).reshape(-1, shape[-1])
    except ValueError:
        raise InvalidInput(
            f"{name} has the shape {values.shape}; it must be {shape}, as feet has."
        ) from None
    return np.ascontiguousarray(rows)


def shortfall(margin: float) -> str:
    """Return a clause on an insufficient support margin.

    Args:
        margin: Negative, or minus infinity where the feet span no polygon [m].
    """
    if math.isinf(margin):
        return f"fewer than {FEWEST_FEET} feet stand, or they stand in a line"
    outside = plain_number(-1000 * margin, 3)
    return f"the centre of mass is {outside} mm outside the support polygon"
