"""Plan of the next footholds, swing heights and body height on the height map.

It is computed when the map changes, 20 times a second, beside the engine's updates.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.control.body_motion import ground_height
from phasmid.control.footholds import is_foothold, is_free, neutral_landing
from phasmid.control.leg_phases import FROZEN
from phasmid.control.swing import blend, lift
from phasmid.control.terrain_map import TerrainMap, map_height, map_variance
from phasmid.control.types import LegPhase, Model, Reference, State
from phasmid.control.vectors import in_odom
from phasmid.control.velocity_limits import time_to_lift
from phasmid.kinematics.leg_kernels import Triple
from phasmid.kinematics.vector_kernels import turned

WINDOW, SPACING = 8, 0.0125
"""Candidates to each side of the neutral landing, and their distance [m]."""

RINGS, RING_WEIGHTS = np.array((0.01, 0.02, 0.03)), np.array((1.0, 0.7, 0.4)) / 2.1
"""Distances from a candidate at which the ground is compared with it [m], and their weights."""

EDGE = 0.015
"""Change of height beside a candidate that counts as an edge [m]."""

AT_EDGE, AWAY, DEEP, UNSURE = 8.0, 0.08, 0.06, 0.02
"""Cost of an edge; distance from the neutral landing, height from the ground plane and standard
deviation of the map [m] that each cost 1."""

AHEAD = 0.02
"""Distance by which footholds should lie ahead of the neutral landing [m]."""

KEPT = 0.15
"""Cost below that of the best candidate by which the last choice is kept."""

ATTEMPTS = 12
"""Candidates whose reach is tested, the cheapest first."""

SAMPLES, FIRST, LAST = 7, 0.25, 0.75
"""Points of a swing at which its height over the ground is tested, and parts of its duration
between which they lie: nearer to its ends no height of the swing would clear a riser."""

FOOT_CLEARANCE, HIGHEST_SWING = 0.018, 0.08
"""Clearance of a swinging foot over the map, and largest height of a swing [m]."""

TRUNK_CLEARANCE, TRUNK_SPACING, LOOK_AHEAD = 0.02, 0.02, 0.8
"""Clearance of the trunk over the map, distance of the points under it [m]; time for which its
motion is looked ahead [s]."""

SOON, SLOW = 0.01, 0.01
"""Least time to a landing [s]; speed below which the robot goes in no direction [m/s]."""

KNOWN = 0.15
"""Share of the candidates that must be known. Cells in a hole that the sensor cannot see are
unknown."""

UNKNOWN = 0.3
"""Cost of an unknown neighbour, as a share of that of an edge."""


@compiled
def edge_cost(terrain_map: TerrainMap, x: float, y: float, z: float) -> float:
    """Return how near a point is to an edge, 0 to 1."""
    cost = 0.0
    for ring in range(len(RINGS)):
        r = RINGS[ring]
        for k in range(8):
            dx, dy = r * math.cos(math.pi * k / 4), r * math.sin(math.pi * k / 4)
            step, share = (map_height(terrain_map, x + dx, y + dy) - z) / EDGE, UNKNOWN
            # Comparisons with NaN are false.
            if abs(step) >= 0.0:
                share = min(abs(step), 1.0)
            cost += RING_WEIGHTS[ring] / 8 * share
    return cost


@compiled
def foothold_cost(
    state: State, terrain_map: TerrainMap, x: float, y: float, nx: float, ny: float
) -> tuple[float, float]:
    """Return the cost of a foothold, and its height [m]; (nx, ny) would be the best place."""
    z = map_height(terrain_map, x, y)
    if math.isnan(z):
        return math.inf, z
    away = math.hypot(x - nx, y - ny) / AWAY
    deep = (z - ground_height(state, x, y)) / DEEP
    unsure = map_variance(terrain_map, x, y) / UNSURE**2
    return AT_EDGE * edge_cost(terrain_map, x, y, z) + away * away + deep * deep + unsure, z


@compiled
def is_possible(
    state: State, model: Model, leg: int, there: Triple, kept: Triple, x: float, y: float, z: float
) -> bool:
    """Return whether a foot can land at a point of odom [m], on both paths and beside no foot."""
    return bool(
        is_free(state, leg, x, y)
        and is_foothold(state, model, leg, there, x, y, z)
        and is_foothold(state, model, leg, kept, x, y, z)
    )


@compiled
def candidates(
    state: State, terrain_map: TerrainMap, nx: float, ny: float
) -> tuple[Float[np.ndarray, "count count"], Float[np.ndarray, "count count"], float]:
    """Return costs and heights [m] of the candidates around a place, and the share known."""
    count, known = 2 * WINDOW + 1, 0
    costs, heights = np.empty((count, count)), np.empty((count, count))
    for i in range(count):
        for j in range(count):
            x, y = nx + (i - WINDOW) * SPACING, ny + (j - WINDOW) * SPACING
            costs[i, j], heights[i, j] = foothold_cost(state, terrain_map, x, y, nx, ny)
            known += costs[i, j] < math.inf
    return costs, heights, known / (count * count)


@compiled
def choose(
    state: State, model: Model, reference: Reference, terrain_map: TerrainMap, leg: int
) -> None:
    """Write the next foothold of a leg; NaN where too little of the ground there is known.

    The last choice is kept where no candidate is much better. Where none is in reach, a standing
    foot is to step in place.
    """
    goal = state.next_foothold[leg]
    if state.leg_phase[leg] == LegPhase.SWING:
        left = state.swing_duration[leg] - state.swing_elapsed[leg]
    else:
        left = time_to_lift(reference, leg, state.clock.phase)
        left += (1.0 - reference.duty_factor) * reference.period
    there, kept, nx, ny = neutral_landing(state, model, reference, leg, max(left, SOON))
    v = state.velocity_filter[2]
    speed = math.hypot(v[0], v[1])
    if speed > SLOW:
        ahead, aside = turned(state.path[2], AHEAD / speed * v[0], AHEAD / speed * v[1])
        nx, ny = nx + ahead, ny + aside
    costs, heights, known = candidates(state, terrain_map, nx, ny)
    if known < KNOWN:
        goal[:] = math.nan
        return
    last, last_height = math.inf, math.nan
    if math.isfinite(goal[0]):
        last, last_height = foothold_cost(state, terrain_map, goal[0], goal[1], nx, ny)
    for _ in range(ATTEMPTS):
        best = costs.argmin()
        i, j = best // len(costs), best % len(costs)
        if last < math.inf and last - KEPT <= costs[i, j]:
            x, y, z, last = goal[0], goal[1], last_height, math.inf
        elif costs[i, j] < math.inf:
            x, y, z = nx + (i - WINDOW) * SPACING, ny + (j - WINDOW) * SPACING, heights[i, j]
            # Its neighbours are hardly more within reach.
            costs[max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2] = math.inf
        else:
            break
        if is_possible(state, model, leg, there, kept, x, y, z):
            goal[0], goal[1], goal[2] = x, y, z
            return
    foot = state.foot[leg]
    stands = state.leg_phase[leg] == LegPhase.STANCE
    if stands and is_foothold(state, model, leg, there, foot[0], foot[1], foot[2]):
        goal[:] = foot
    else:
        goal[:] = math.nan


@compiled
def swing_height(state: State, terrain_map: TerrainMap, leg: int) -> float:
    """Return the height of the next swing of a leg that clears the ground on the map [m]."""
    foot, goal, height = state.foot[leg], state.next_foothold[leg], 0.0
    if math.isnan(goal[0]):
        return height
    for k in range(SAMPLES):
        s = FIRST + (LAST - FIRST) * k / (SAMPLES - 1)
        part = blend(s, 1.0)[0]
        x, y = foot[0] + part * (goal[0] - foot[0]), foot[1] + part * (goal[1] - foot[1])
        line = foot[2] + part * (goal[2] - foot[2])
        top = -math.inf
        for dx in (-0.01, 0.0, 0.01):
            for dy in (-0.01, 0.0, 0.01):
                near = map_height(terrain_map, x + dx, y + dy)
                if not math.isnan(near):
                    top = max(top, near)
        lacks = top + FOOT_CLEARANCE - line
        if lacks > 0.0:
            height = max(height, lacks / lift(s, 1.0, 1.0)[0])
    return min(height, HIGHEST_SWING)


@compiled
def least_rise(state: State, model: Model, reference: Reference, terrain_map: TerrainMap) -> float:
    """Return the least height over the neutral one at which the trunk clears the map [m].

    Heights of the map are those of the feet, which balls raise over the ground.
    """
    most, v = -math.inf, reference.velocity
    low, high = model.trunk[0], model.trunk[1]
    look = LOOK_AHEAD * state.clock.velocity_share
    ahead, aside = look * v[0], look * v[1]
    for x in np.arange(low[0] + min(ahead, 0.0), high[0] + max(ahead, 0.0), TRUNK_SPACING):
        for y in np.arange(low[1] + min(aside, 0.0), high[1] + max(aside, 0.0), TRUNK_SPACING):
            px, py = in_odom(state.path, x, y)
            top = map_height(terrain_map, px, py) - ground_height(state, px, py)
            if not math.isnan(top):
                most = max(most, top)
    return most - model.foot_radius - low[2] + TRUNK_CLEARANCE - model.height


def forget_plan(state: State, reference: Reference) -> None:
    """Plan nothing any more: the feet alone sense the ground.

    Args:
        state: `next_foothold` is written.
        reference: `swing_height` and `least_rise` are written.
    """
    state.next_foothold[:] = math.nan
    reference.swing_height[:] = 0.0
    reference.least_rise = -math.inf


@compiled
def plan_footholds(
    state: State, model: Model, reference: Reference, terrain_map: TerrainMap
) -> None:
    """Write the next footholds, the heights of the next swings and the least height of the body.

    Args:
        state: `next_foothold` is written.
        model: The robot.
        reference: `swing_height` and `least_rise` are written.
        terrain_map: Heights around the robot.
    """
    for leg in range(state.leg_count):
        phase, elapsed = state.leg_phase[leg], state.swing_elapsed[leg]
        if not reference.used[leg]:
            continue
        if phase == LegPhase.STANCE:
            choose(state, model, reference, terrain_map, leg)
            reference.swing_height[leg] = swing_height(state, terrain_map, leg)
        elif phase == LegPhase.SWING and elapsed < FROZEN * state.swing_duration[leg]:
            choose(state, model, reference, terrain_map, leg)
    reference.least_rise = least_rise(state, model, reference, terrain_map)
