"""Static stability: the support margin."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Bool, Float

from phasmid.gait.gait import FEWEST_FEET
from phasmid.units import plain_number


def support_margin(
    feet: Float[np.ndarray, "*batch legs 2"],
    stance: Bool[np.ndarray, "*#batch legs"],
    centre_of_mass: Float[np.ndarray, "*#batch 2"],
) -> Float[np.ndarray, "*batch"]:
    """Return the distance of the projected centre of mass from the edge of the support polygon.

    Args:
        feet: Horizontal positions of the feet [m], shape (..., L, 2).
        stance: Feet that stand, shape (..., L).
        centre_of_mass: Horizontal position, in the same axes [m], shape (..., 2).

    Returns:
        Margin [m], positive inside the polygon, negative outside; minus infinity where fewer
        than three feet stand or they lie on a line, shape (...).
    """
    # Lazy import: numba takes 0.6 s.
    from phasmid.gait.support_kernels import support_margins

    feet = np.ascontiguousarray(feet, dtype=float)
    *batch, legs, _ = feet.shape
    points = np.ascontiguousarray(np.broadcast_to(centre_of_mass, (*batch, 2)), dtype=float)
    standing = np.ascontiguousarray(np.broadcast_to(stance, (*batch, legs)), dtype=bool)
    margins = np.empty(batch)
    support_margins(
        feet.reshape(-1, legs, 2),
        standing.reshape(-1, legs),
        points.reshape(-1, 2),
        margins.reshape(-1),
    )
    return margins


def shortfall(margin: float) -> str:
    """Return a clause on an insufficient support margin.

    Args:
        margin: Negative, or minus infinity where the feet span no polygon [m].
    """
    if math.isinf(margin):
        return f"fewer than {FEWEST_FEET} feet stand, or they stand in a line"
    outside = plain_number(-1000 * margin, 3)
    return f"the centre of mass is {outside} mm outside the support polygon"
