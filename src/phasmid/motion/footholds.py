"""Foothold selection on uneven ground: the nearest good place to each nominal one."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from phasmid.experiment import Footing
from phasmid.terrain import Ground

DIRECTIONS = 16
"""Directions in which the neighbourhood of a place is sampled."""

SPACING = 0.005
"""Distance between the rings of candidate places [m]."""

WIDEST_GAP = 4.0
"""Width of a valley, in which a robot can walk, in search radii; narrower ones are gaps."""

RAY = 20
"""Samples of the ground in one direction, in search of the side of a gap."""

PREFERENCE = 1e-6
"""Preference of a place ahead to one behind, relative to its distance."""


class Footholds(NamedTuple):
    """Footholds of each leg, one row per cycle.

    Attributes:
        place: Footholds in world axes [m], shape (C, L, 3).
        found: Footholds that are good places; the others are nominal, shape (C, L).
    """

    place: Float[np.ndarray, "cycles legs 3"]
    found: Bool[np.ndarray, "cycles legs"]


def choose_footholds(
    terrain: Ground,
    footing: Footing,
    nominal: Float[np.ndarray, "cycles legs 2"],
    ahead: Float[np.ndarray, "cycles legs 2"],
    outward: Float[np.ndarray, "cycles legs 2"],
) -> Footholds:
    """Return the good place nearest to each nominal foothold.

    A place is good where the ground within the margin is no steeper than the steepest foothold, and
    where it is not in a gap. Good places with enough friction come first, then the nearest, then
    those farther ahead, then those farther out.

    Args:
        terrain: The ground.
        footing: Criteria and search radius.
        nominal: Footholds of level ground, x and y [m].
        ahead: Direction of travel at each, of length 1 or 0.
        outward: Direction away from the trunk, of length 1.
    """
    flat = nominal.reshape(-1, 2)
    even, firm = is_even(terrain, footing, flat), has_grip(terrain, footing, flat)
    chosen, found = flat.copy(), even.copy()
    offsets = _offsets(footing.search_radius)
    distance = np.hypot(*offsets.T)
    for i in np.flatnonzero(~(even & firm)):
        places = flat[i] + offsets
        good = is_even(terrain, footing, places)
        if not good.any():
            continue
        liking = offsets @ (ahead.reshape(-1, 2)[i] + 0.5 * outward.reshape(-1, 2)[i])
        cost = distance - PREFERENCE * liking / SPACING
        cost += 2 * footing.search_radius * ~has_grip(terrain, footing, places)
        best = int(np.argmin(np.where(good, cost, np.inf)))
        chosen[i], found[i] = places[best], True
    z = terrain.height(chosen[:, 0], chosen[:, 1])
    shape = nominal.shape[:2]
    return Footholds(
        np.concatenate([chosen, z[:, None]], axis=1).reshape(*shape, 3),
        found.reshape(shape),
    )


def is_even(
    terrain: Ground, footing: Footing, places: Float[np.ndarray, "places 2"]
) -> Bool[np.ndarray, " places"]:
    """Return where the ground around places is even and outside gaps, shape (N,).

    Args:
        terrain: The ground.
        footing: The margin, the steepest foothold and the depth of a gap.
        places: x and y [m], shape (N, 2).
    """
    here = terrain.height(places[:, 0], places[:, 1])
    margin, widest = footing.foothold_margin, WIDEST_GAP * footing.search_radius
    radii = margin * np.array([0.25, 0.5, 1.0])
    near = np.abs(_heights(terrain, places, radii) - here[:, None, None]).max(axis=2)
    even = np.all(near <= radii * math.tan(footing.steepest_foothold) + 1e-9, axis=1)
    # In a gap the ground rises on two opposite sides; at the foot of a stair on one.
    ray = widest * np.arange(1, RAY + 1) / RAY
    side = _heights(terrain, places, ray) - here[:, None, None] > footing.deepest_foothold
    away = np.where(side.any(axis=1), ray[np.argmax(side, axis=1)], np.inf)
    across = (away + np.roll(away, DIRECTIONS // 2, axis=1)).min(axis=1)
    return np.asarray(even & (across > widest))


def has_grip(
    terrain: Ground, footing: Footing, places: Float[np.ndarray, "places 2"]
) -> Bool[np.ndarray, " places"]:
    """Return where friction is enough for the slope, and not below the least, shape (N,)."""
    needed = np.maximum(footing.least_friction, holding_friction(terrain, places))
    return np.asarray(terrain.friction(places[:, 0], places[:, 1]) >= needed)


def holding_friction(
    terrain: Ground, places: Float[np.ndarray, "places 2"]
) -> Float[np.ndarray, " places"]:
    """Return the friction at which a load holds on the slope of places, shape (N,)."""
    n = terrain.normal(places[:, 0], places[:, 1])
    return np.asarray(np.hypot(n[:, 0], n[:, 1]) / n[:, 2])


def _heights(
    terrain: Ground, places: Float[np.ndarray, "places 2"], radii: Float[np.ndarray, " rings"]
) -> Float[np.ndarray, "places rings directions"]:
    """Return the heights of the ground on rings around places [m]."""
    points = places[:, None, None] + radii[:, None, None] * _circle()
    return terrain.height(points[..., 0], points[..., 1])


def _circle() -> Float[np.ndarray, "directions 2"]:
    angle = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _offsets(radius: float) -> Float[np.ndarray, "places 2"]:
    """Return offsets of the candidate places: none, and rings [m]."""
    rings = math.floor(radius / SPACING + 1e-9)
    around = SPACING * np.arange(1, rings + 1)[:, None, None] * _circle()
    return np.concatenate([np.zeros((1, 2)), around.reshape(-1, 2)])
