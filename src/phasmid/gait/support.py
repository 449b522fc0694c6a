"""How far a walking robot is from toppling."""

from __future__ import annotations

import math
from itertools import permutations

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
    """Distance of the projected centre of mass from the edge of the support polygon.

    Args:
        feet: Horizontal positions of the feet [m], shape (..., L, 2).
        stance: Which feet stand, shape (..., L).
        centre_of_mass: Its horizontal position, in the same axes [m], shape (..., 2).

    Returns:
        Margin [m], positive inside the polygon, negative outside; minus infinity where fewer
        than three feet stand or they lie on a line, shape (...).

    Raises:
        InvalidInput: Something is of a wrong kind or shape.
    """
    feet, stance = numbers(feet, "feet"), numbers(stance, "stance").astype(bool)
    if feet.ndim < 2 or feet.shape[-1] != 2:
        raise InvalidInput(f"feet has the shape {feet.shape}; it must be (..., legs, 2).")
    legs, batch = feet.shape[-2], feet.shape[:-2]
    centre = _spread("centre_of_mass", numbers(centre_of_mass, "centre_of_mass"), (*batch, 2))
    standing = _spread("stance", stance, (*batch, legs))
    places = feet.reshape(-1, legs, 2)
    # A walk has few patterns of standing feet, of each of which only those feet count; each lasts
    # for many samples, so that it is sought among the first ones after a change alone.
    changed = np.ones(len(standing), dtype=bool)
    changed[1:] = (standing[1:] != standing[:-1]).any(axis=1)
    patterns, which = np.unique(standing[changed], axis=0, return_inverse=True)
    which = which.ravel()[np.cumsum(changed) - 1]
    margin = np.full(len(places), -np.inf)
    for number, pattern in enumerate(patterns):
        rows = np.flatnonzero(which == number)
        margin[rows] = _margin(places[np.ix_(rows, np.flatnonzero(pattern))], centre[rows])
    return margin.reshape(batch)


def _spread(name: str, given: np.ndarray, wanted: tuple[int, ...]) -> np.ndarray:
    """An array with a row for each place of the feet."""
    try:
        return np.broadcast_to(given, wanted).reshape(-1, wanted[-1])
    except ValueError:
        raise InvalidInput(
            f"{name} has the shape {given.shape}; it must be {wanted}, as feet tells."
        ) from None


def _margin(
    feet: Float[np.ndarray, "time standing 2"], centre: Float[np.ndarray, "time 2"]
) -> Float[np.ndarray, " time"]:
    """The margin of feet all of which stand."""
    inside = np.full(len(feet), np.inf)
    outside = np.full(len(feet), np.inf)
    edges = np.zeros(len(feet), dtype=int)
    for i, j in permutations(range(feet.shape[1]), 2):
        along = feet[:, j] - feet[:, i]
        length = np.hypot(along[:, 0], along[:, 1])
        apart = length > SAME_PLACE
        along = along / np.where(apart, length, 1.0)[:, None]
        inward = np.stack([-along[:, 1], along[:, 0]], axis=-1)
        depth = np.sum((feet - feet[:, i, None]) * inward[:, None], axis=-1)
        # An edge of the polygon, counter-clockwise, has every standing foot on its left.
        edge = apart & np.all(depth > -1e-3 * SAME_PLACE, axis=-1)
        edge &= np.any(depth > SAME_PLACE, axis=-1)
        way = centre - feet[:, i]
        over, beside = np.sum(way * inward, axis=-1), np.sum(way * along, axis=-1)
        past = beside - np.clip(beside, 0.0, length)
        inside = np.where(edge, np.minimum(inside, over), inside)
        outside = np.where(edge, np.minimum(outside, np.hypot(over, past)), outside)
        edges += edge
    return np.where(edges >= 3, np.where(inside >= 0, inside, -outside), -np.inf)


def shortfall(margin: float) -> str:
    """Return a clause that says why a support margin is not enough.

    Args:
        margin: Negative, or minus infinity where the feet span no polygon [m].
    """
    if math.isinf(margin):
        return f"fewer than {FEWEST_FEET} feet stand, or they stand in a line"
    outside = plain_number(-1000 * margin, 3)
    return f"the centre of mass is {outside} mm outside the support polygon"


def margin_at(
    feet: Float[np.ndarray, "legs axes"], stance: Bool[np.ndarray, " legs"], x: float, y: float
) -> float:
    """The support margin at one instant, as a loop that can be compiled.

    Args:
        feet: Positions of the feet, x and y first [m], shape (L, 2) or (L, 3).
        stance: Which feet stand, shape (L,).
        x: Of the projected centre of mass, in the same axes [m].
        y: The same.

    Returns:
        What `support_margin` tells, but for round-off [m].
    """
    count = feet.shape[0]
    inside, outside, edges = np.inf, np.inf, 0
    for i in range(count):
        if not stance[i]:
            continue
        for j in range(count):
            if j == i or not stance[j]:
                continue
            along_x, along_y = feet[j, 0] - feet[i, 0], feet[j, 1] - feet[i, 1]
            length = np.sqrt(along_x * along_x + along_y * along_y)
            if length <= SAME_PLACE:
                continue
            along_x /= length
            along_y /= length
            edge, apart = True, False
            for k in range(count):
                if stance[k]:
                    depth = along_x * (feet[k, 1] - feet[i, 1]) - along_y * (
                        feet[k, 0] - feet[i, 0]
                    )
                    if depth <= -1e-3 * SAME_PLACE:
                        edge = False
                        break
                    apart = apart or depth > SAME_PLACE
            if not (edge and apart):
                continue
            edges += 1
            way_x, way_y = x - feet[i, 0], y - feet[i, 1]
            over = along_x * way_y - along_y * way_x
            beside = along_x * way_x + along_y * way_y
            past = beside - min(max(beside, 0.0), length)
            inside = min(inside, over)
            outside = min(outside, np.sqrt(over * over + past * past))
    if edges < 3:
        return -np.inf
    return float(inside) if inside >= 0 else -float(outside)
