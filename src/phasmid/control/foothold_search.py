"""Search of feet that find no ground: farther ahead, behind, then at the last foothold."""

from __future__ import annotations

import math

from phasmid.compiled import internal
from phasmid.control.body_motion import ground_height, is_zero, point_velocity
from phasmid.control.swing import set_times, stop_foot
from phasmid.control.types import LegPhase, Manoeuvre, Reference, SearchStage, State

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


@internal
def is_searching(state: State, leg: int) -> bool:
    """Return whether a foot in the air searches for ground or returns to its last foothold."""
    return bool(SearchStage.NONE < state.search_stage[leg] < SearchStage.RETURNED)


@internal
def is_returning(state: State, leg: int) -> bool:
    """Return whether a foot returns to its last foothold."""
    return bool(state.search_stage[leg] == SearchStage.RETURNING)


@internal
def distance_from_foothold(state: State, leg: int) -> float:
    """Return the distance of a foot from its last foothold with contact, from above [m]."""
    dx = state.foot[leg, 0] - state.last_foothold[leg, 0]
    dy = state.foot[leg, 1] - state.last_foothold[leg, 1]
    return math.sqrt(dx * dx + dy * dy)


@internal
def set_search(state: State, leg: int, stage: int) -> None:
    """Set the stage of a foot's search, and count the change."""
    if state.search_stage[leg] != stage:
        state.search_stage[leg] = stage
        state.clock.search_changes += 1


@internal
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


@internal
def is_free(state: State, leg: int, x: float, y: float) -> bool:
    """Return whether no other foot stands or lands within `CLOSE` of a point of odom."""
    for other in range(state.leg_count):
        dx, dy = state.touchdown[other, 0] - x, state.touchdown[other, 1] - y
        held = state.leg_phase[other] == LegPhase.HELD
        if other != leg and not held and dx * dx + dy * dy < CLOSE * CLOSE:
            return False
    return True


@internal
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
        share = k * CLOSE / max(distance, CLOSE)
        for i in range(3):
            goal[i] = last[i] + share * (foot[i] - last[i])
        if is_free(state, leg, goal[0], goal[1]):
            state.return_attempts[leg] = attempts
            state.clock.search_changes += tried
            set_search(state, leg, SearchStage.RETURNING)
            return True
    return False


@internal
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
        for i in range(3):
            first[i] = foot[i]
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
        goal[0], goal[1], goal[2] = foot[0] - FAR * x, foot[1] - FAR * y, foot[2]
    while stage < LOOKS:
        stage += 1
        for i in range(2):
            goal[i] = 2 * first[i] - goal[i]
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
