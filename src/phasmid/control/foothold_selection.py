"""Foothold selection: where a swinging foot lands."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import internal
from phasmid.control.body_motion import (
    approach,
    ground_height,
    in_odom,
    in_path,
    integrate_twist,
    place_body,
)
from phasmid.control.foothold_region import region_share
from phasmid.control.foothold_search import is_returning, is_searching
from phasmid.control.reach import AT_ENOUGH, is_within, to_hip_frame
from phasmid.control.types import Model, Reference, State
from phasmid.kinematics.leg_kernels import Triple

STOPS = 0.08
"""Time for which a body that comes to rest keeps its velocity [s]."""

POSED = 1e-3
"""Pose from which on the legs may reach less than in the neutral pose [m, rad]."""

TRIES, NEARER = 4, 0.012
"""Attempts to move an unreachable neutral place towards the body, and distance of each [m]."""


@internal
def is_foothold(
    state: State, model: Model, leg: int, path: Triple, x: float, y: float, z: float
) -> bool:
    """Return whether a foot can land at a point of odom [m] while the body is on a path.

    That holds for the present pose and for its reference.
    """
    R, body = np.empty((3, 3)), np.empty(3)
    sway = state.sway_filter[3]
    for k in (0, 3):
        place_body(state, model, path, state.pose_filter[k], sway[0], sway[1], R, body)
        u, v, w = to_hip_frame(model, leg, R, body, x, y, z)
        if not is_within(model, AT_ENOUGH, leg, u, v, w):
            return False
    return True


@internal
def choose_foothold(
    state: State, model: Model, reference: Reference, leg: int, left: float
) -> None:
    """Write where a foot lands after a time [s], within its foothold region.

    It is neutral in the middle of its next stance, if the body follows the prediction.
    """
    now, mean, goal = state.velocity_filter[2], np.empty(3), np.empty(3)
    v = now.copy()
    for i in range(3):
        goal[i] = state.clock.velocity_share * reference.velocity[i]
        if is_returning(state, leg):
            # So does the body.
            goal[i] = state.velocity_filter[0, i]
    approach(v, goal, 0, model.radius, model.acceleration * left)
    for i in range(3):
        mean[i] = (v[i] + now[i]) / 2
    there = integrate_twist(state.path, mean, left)
    # It is not certain that the walk accelerates until then.
    kept = integrate_twist(state.path, now, left)
    # Nor that it goes on at all; in the neutral pose a robot has room for that anyhow.
    posed = np.abs(state.pose_filter[0]).max() > POSED or np.abs(state.pose_filter[3]).max() > POSED
    rest = integrate_twist(state.path, now, min(left, STOPS)) if posed else kept
    nx, ny = model.neutral[leg, 0], model.neutral[leg, 1]
    if is_searching(state, leg):
        x, y = state.search_goal[leg, 0], state.search_goal[leg, 1]
    else:
        stance = reference.duty_factor * reference.period
        x, y = in_odom(integrate_twist(there, v, stance / 2), nx, ny)
    px, py = in_path(there, x, y)
    dx, dy = px - nx, py - ny
    share, z = region_share(state.region[leg], dx, dy), reference.touchdown_height[leg]
    flat = not math.isfinite(z)
    # From the neutral place towards the body, where it will be.
    inward_x = state.pose_filter[0, 0] + state.sway_filter[3, 0] - nx
    inward_y = state.pose_filter[0, 1] + state.sway_filter[3, 1] - ny
    size = max(math.sqrt(inward_x * inward_x + inward_y * inward_y), 1e-6)
    for attempt in range(4 + TRIES + 1):
        # The region approximates the reach; near its corners the reach itself counts.
        nearer = NEARER * (attempt - 3) / size if 4 <= attempt < 4 + TRIES else 0.0
        px, py = nx + share * dx + nearer * inward_x, ny + share * dy + nearer * inward_y
        x, y = in_odom(there, px, py)
        if flat:
            z = ground_height(state, x, y)
        if (
            is_foothold(state, model, leg, there, x, y, z)
            and is_foothold(state, model, leg, kept, x, y, z)
            and (not posed or is_foothold(state, model, leg, rest, x, y, z))
        ):
            break
        share *= 0.5 if attempt < 2 else 0.0
    state.touchdown[leg, 0], state.touchdown[leg, 1], state.touchdown[leg, 2] = x, y, z
