"""Footholds: selection of the next landing, and search by feet that find no ground.

A foot without ground searches farther ahead, then behind, then returns to its last foothold.
"""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled
from phasmid.control.body_motion import approach, ground_height, place_body
from phasmid.control.reach import ENOUGH, reach_margin, region_share
from phasmid.control.swing import set_times, stop_foot
from phasmid.control.types import LegPhase, Manoeuvre, Model, Reference, SearchStage, State
from phasmid.control.vectors import in_odom, in_path, integrate_twist, is_zero, point_velocity
from phasmid.kinematics.leg_kernels import Triple

STOPS = 0.08
"""Time for which a body that comes to rest keeps its velocity [s]."""

LEAST_RAISE = 0.01
"""Height over the ground plane from which an expected landing was raised by a hit [m]."""

POSED = 1e-3
"""Pose from which on the legs may reach less than in the neutral pose [m, rad]."""

TRIES, NEARER = 4, 0.012
"""Attempts to move an unreachable neutral place towards the body, and distance of each [m]."""

FAR, LOOKS = 0.06, 2
"""Distance of search points from where a foot has found no ground [m]; number of search points."""

ATTEMPTS = 4
"""Attempts to step back to the last foothold: the body returns too, and may be too far at first."""

THERE = 0.03
"""Distance from the last foothold below which a foot is back [m]."""

CLOSE = 0.03
"""Distance of another foot within which a foot does not search [m]."""

RISE, RISE_SPEED, RISE_TIME = 0.01, 0.4, 0.1
"""Height above the ground to which a foot rises before it searches [m], its largest speed [m/s] and
the least time for it [s]."""


@compiled
def is_searching(state: State, leg: int) -> bool:
    """Return whether a foot in the air searches for ground or returns to its last foothold."""
    return bool(SearchStage.NONE < state.search_stage[leg] < SearchStage.RETURNED)


@compiled
def is_returning(state: State, leg: int) -> bool:
    """Return whether a foot returns to its last foothold."""
    return bool(state.search_stage[leg] == SearchStage.RETURNING)


@compiled
def is_foothold(
    state: State, model: Model, leg: int, path: Triple, x: float, y: float, z: float
) -> bool:
    """Return whether a foot can land at a point of odom [m] while the body is on a path.

    That holds for the present pose and for its reference.
    """
    sway = state.sway_filter[3]
    for k in (0, 3):
        R, body = place_body(state, model, path, state.pose_filter[k], sway[0], sway[1])
        if not reach_margin(model, leg, R, body, x, y, z) >= ENOUGH:
            return False
    return True


@compiled
def neutral_landing(
    state: State, model: Model, reference: Reference, leg: int, left: float
) -> tuple[Triple, Triple, float, float]:
    """Return the paths after a time [s], and where a foot would land then, in odom [m].

    The first path is the predicted one, the second that of a constant velocity. The foot is neutral
    in the middle of its next stance, if the body follows the prediction.
    """
    now, v = state.velocity_filter[2], predicted_velocity(state, model, reference, leg, left)
    there = integrate_twist(state.path, (v + now) / 2, left)
    # It is not certain that the walk accelerates until then.
    kept = integrate_twist(state.path, now, left)
    stance = reference.duty_factor * reference.period
    nx, ny = model.neutral[leg, 0], model.neutral[leg, 1]
    x, y = in_odom(integrate_twist(there, v, stance / 2), nx, ny)
    return there, kept, x, y


@compiled
def predicted_velocity(
    state: State, model: Model, reference: Reference, leg: int, left: float
) -> np.ndarray:
    """Return the velocity vx, vy, wz of the body after a time [s]."""
    v, goal = state.velocity_filter[2].copy(), state.clock.velocity_share * reference.velocity
    if is_returning(state, leg):
        # So does the body.
        goal = state.velocity_filter[0].copy()
    approach(v, goal, model.radius, model.acceleration * left)
    return v


@compiled
def is_landing(
    state: State,
    model: Model,
    leg: int,
    paths: tuple[Triple, Triple, Triple],
    x: float,
    y: float,
    z: float,
) -> bool:
    """Return whether a foot can land at a point of odom [m], whichever path the body takes."""
    return bool(
        is_foothold(state, model, leg, paths[0], x, y, z)
        and is_foothold(state, model, leg, paths[1], x, y, z)
        and is_foothold(state, model, leg, paths[2], x, y, z)
    )


@compiled
def choose_foothold(
    state: State, model: Model, reference: Reference, leg: int, left: float
) -> None:
    """Write where a foot lands after a time [s], within its foothold region.

    A foothold planned on the height map is taken where it is in reach.
    """
    now = state.velocity_filter[2]
    there, kept, x, y = neutral_landing(state, model, reference, leg, left)
    # It is not certain that the walk goes on; in the neutral pose a robot has room for that.
    posed = np.abs(state.pose_filter[0]).max() > POSED or np.abs(state.pose_filter[3]).max() > POSED
    rest = integrate_twist(state.path, now, min(left, STOPS)) if posed else kept
    paths = there, kept, rest
    nx, ny = model.neutral[leg, 0], model.neutral[leg, 1]
    planned, z = state.next_foothold[leg], reference.touchdown_height[leg]
    if math.isfinite(planned[0]) and not is_returning(state, leg):
        landing = state.touchdown[leg]
        # After a hit the foot expects higher ground.
        raised = z - ground_height(state, landing[0], landing[1])
        height = planned[2] + (raised if raised > LEAST_RAISE else 0.0)
        if is_landing(state, model, leg, paths, planned[0], planned[1], height):
            landing[0], landing[1], landing[2] = planned[0], planned[1], height
            return
        if is_foothold(state, model, leg, kept, landing[0], landing[1], landing[2]):
            return
    if is_searching(state, leg):
        x, y = state.search_goal[leg, 0], state.search_goal[leg, 1]
    px, py = in_path(there, x, y)
    dx, dy = px - nx, py - ny
    share = region_share(state.region[leg], 0.0, 0.0, dx, dy, 0.0)
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
        if is_landing(state, model, leg, paths, x, y, z):
            break
        share *= 0.5 if attempt < 2 else 0.0
    state.touchdown[leg, 0], state.touchdown[leg, 1], state.touchdown[leg, 2] = x, y, z


@compiled
def distance_from_foothold(state: State, leg: int) -> float:
    """Return the distance of a foot from its last foothold with contact, from above [m]."""
    away = state.foot[leg] - state.last_foothold[leg]
    return math.hypot(away[0], away[1])


@compiled
def set_search(state: State, leg: int, stage: int) -> None:
    """Set the stage of a foot's search, and count the change."""
    if state.search_stage[leg] != stage:
        state.search_stage[leg] = stage
        state.clock.search_changes += 1


@compiled
def end_search(state: State, leg: int, found: bool) -> None:
    """End the search of a foot that stands, on ground or not."""
    if found and is_returning(state, leg) and distance_from_foothold(state, leg) < THERE:
        set_search(state, leg, SearchStage.RETURNED)
    elif (found and state.search_stage[leg] != SearchStage.RETURNED) or (
        state.search_stage[leg] == SearchStage.LAND_HERE
    ):
        set_search(state, leg, SearchStage.NONE)
    elif is_searching(state, leg):
        set_search(state, leg, SearchStage.GAVE_UP)


@compiled
def is_free(state: State, leg: int, x: float, y: float) -> bool:
    """Return whether no other foot stands or lands within `CLOSE` of a point of odom."""
    for other in range(state.leg_count):
        foot = state.touchdown[other]
        held = state.leg_phase[other] == LegPhase.HELD
        if other != leg and not held and math.hypot(foot[0] - x, foot[1] - y) < CLOSE:
            return False
    return True


@compiled
def return_to_foothold(state: State, leg: int) -> bool:
    """Make the last foothold the goal of a foot's search; return False if it may not go there."""
    tried = is_returning(state, leg)
    attempts = state.return_attempts[leg] + 1 if tried else 0
    distance = distance_from_foothold(state, leg)
    if attempts >= ATTEMPTS or (tried and distance < THERE):
        return False
    goal, last, foot = state.search_goal[leg], state.last_foothold[leg], state.foot[leg]
    for k in range(3):
        # Another foot may have followed it there; then it goes as near as possible.
        goal[:] = last + k * CLOSE / max(distance, CLOSE) * (foot - last)
        if is_free(state, leg, goal[0], goal[1]):
            state.return_attempts[leg] = attempts
            state.clock.search_changes += tried
            set_search(state, leg, SearchStage.RETURNING)
            return True
    return False


@compiled
def start_search(state: State, reference: Reference, leg: int) -> bool:
    """Let a foot that has found no ground rise, and write the goal of its next swing.

    The first goal is ahead on the foot's own path with the body, the second as far behind, the
    third its last foothold; goals near another foot are left out. Of a robot that is to stand the
    foot returns at once.

    Returns:
        False where no goal is left.
    """
    v, path, foot, goal = reference.velocity, state.path, state.foot[leg], state.search_goal[leg]
    first, stage = state.missed_foothold[leg], state.search_stage[leg]
    if stage == SearchStage.NONE:
        first[:] = foot
    if is_zero(v):
        stage = max(stage, LOOKS)
    elif stage == SearchStage.NONE:
        x, y = point_velocity(path, v, foot[0], foot[1])
        speed = math.sqrt(x * x + y * y)
        if speed > 1e-9:
            x, y = x / speed, y / speed
        else:
            x, y = math.cos(path[2]), math.sin(path[2])
        # Goals are mirrored about the first place; this is the mirror image of the first one.
        goal[:] = foot - FAR * np.array((x, y, 0.0))
    while stage < LOOKS:
        stage += 1
        goal[:2] = 2 * first[:2] - goal[:2]
        if is_free(state, leg, goal[0], goal[1]):
            set_search(state, leg, stage)
            break
    else:
        if not return_to_foothold(state, leg):
            return False
    # Straight up, since the wall of the hole may be near.
    rise = max(ground_height(state, foot[0], foot[1]) - foot[2], 0.0) + RISE
    stop_foot(state, leg)
    state.leg_phase[leg] = LegPhase.SWING
    state.manoeuvre[leg] = Manoeuvre.RISE
    state.touchdown[leg, 2] += rise
    set_times(state, leg, max(1.875 * rise / RISE_SPEED, RISE_TIME), 0.0)
    return True
