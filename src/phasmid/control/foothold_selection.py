"""Foothold selection: where a swinging foot lands."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import internal
from phasmid.control.body_motion import approach, ground_height, in_odom, in_path, integrate_twist
from phasmid.control.foothold_region import region_share
from phasmid.control.foothold_search import is_returning, is_searching
from phasmid.control.limbs import rotation
from phasmid.control.reach import AT_ENOUGH, is_within, to_hip_frame
from phasmid.control.types import Model, Parameters, Reference, State
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
    """Return whether a foot can land at a point of odom, at the present pose and at its reference.

    Args:
        state: State of the engine.
        model: The robot.
        leg: Index of the leg.
        path: Predicted path.
        x: The point [m].
        y: The same.
        z: The same.
    """
    R, body = np.empty((3, 3)), np.empty(3)
    for k in (0, 3):
        pose = state.pose_filter[k]
        forward, left = pose[0] + state.sway_filter[3, 0], pose[1] + state.sway_filter[3, 1]
        rotation(pose[3], pose[4], pose[5] + path[2], R)
        body[0], body[1] = in_odom(path, forward, left)
        body[2] = ground_height(state, path[0], path[1]) + model.height + pose[2]
        u, v, w = to_hip_frame(model, leg, R, body, x, y, z)
        if not is_within(model, AT_ENOUGH, leg, u, v, w):
            return False
    return True


@internal
def choose_foothold(
    state: State, model: Model, reference: Reference, parameters: Parameters, leg: int, left: float
) -> None:
    """Write the touchdown of a foot: neutral in the middle of its next stance, within its region.

    Args:
        state: State of the engine, changed.
        model: The robot.
        reference: Velocity and gait.
        parameters: The acceleration.
        leg: Index of the leg.
        left: Time until touchdown [s].
    """
    now, mean, goal = state.velocity_filter[2], np.empty(3), np.empty(3)
    v = now.copy()
    for i in range(3):
        goal[i] = state.clock.velocity_share * reference.velocity[i]
        if is_returning(state, leg):
            # So does the body.
            goal[i] = state.velocity_filter[0, i]
    approach(v, goal, 0, model.radius, parameters.acceleration * left)
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
