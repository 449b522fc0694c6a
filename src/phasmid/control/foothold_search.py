"""Feet that find no ground where they come down look for it elsewhere."""

from __future__ import annotations

import math

from phasmid.compiled import internal
from phasmid.control.swing import stop_foot
from phasmid.control.types import LegPhase, Manoeuvre, Reference, SearchStage, State

FAR, LOOKS = 0.06, 2
"""Distance of search points from where a foot has found no ground [m]; number of search points."""

ATTEMPTS = 4
"""Attempts to step back to the last foothold: the body returns too, and may be too far at first."""

THERE = 0.03
"""Distance from the last foothold below which a foot is back [m]."""

CLOSE = 0.03
"""Distance of another foot at which it does not look [m]."""

RISE, RISE_SPEED, RISE_TIME = 0.01, 0.4, 0.1
"""How far above the ground a foot rises before it looks elsewhere [m], its largest speed on that
way [m/s], and the least time for it [s]."""


@internal
def is_searching(state: State, leg: int) -> bool:
    """Whether a foot in the air looks for ground elsewhere, or goes back to it."""
    return bool(SearchStage.NONE < state.search_stage[leg] < SearchStage.RETURNED)


@internal
def is_returning(state: State, leg: int) -> bool:
    """Whether a foot goes back to where it stood."""
    return bool(state.search_stage[leg] == SearchStage.RETURNING)


@internal
def from_stood(state: State, leg: int) -> float:
    """How far a foot is from where it last stood and felt the ground, from above [m]."""
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
    """Note that a foot stands, whether it has found ground or not."""
    if found and is_returning(state, leg) and from_stood(state, leg) < THERE:
        set_search(state, leg, SearchStage.RETURNED)
    elif (found and state.search_stage[leg] != SearchStage.RETURNED) or (
        state.search_stage[leg] == SearchStage.LAND_HERE
    ):
        set_search(state, leg, SearchStage.NONE)
    elif is_searching(state, leg):
        set_search(state, leg, SearchStage.GAVE_UP)


@internal
def is_free(state: State, leg: int, x: float, y: float) -> bool:
    """Whether no other foot stands or lands near a place in odom."""
    for other in range(state.leg_count):
        dx, dy = state.touchdown[other, 0] - x, state.touchdown[other, 1] - y
        if (
            other != leg
            and state.leg_phase[other] != LegPhase.HELD
            and dx * dx + dy * dy < CLOSE * CLOSE
        ):
            return False
    return True


@internal
def start_search(state: State, reference: Reference, leg: int) -> bool:
    """Let a foot that has come down to no ground rise out of the hole, to swing elsewhere.

    First it goes to a place along its own way with the body, then as far to the other side, then
    back to where it stood, but to none that is near another foot. Of a robot that is to stand still
    it goes back at once.

    Args:
        state: Where the engine is, changed.
        reference: What is to be done.
        leg: The leg's index.

    Returns:
        Whether it does.
    """
    v, path, foot = reference.velocity, state.path, state.foot[leg]
    there, first, looked = (
        state.search_goal[leg],
        state.missed_foothold[leg],
        state.search_stage[leg],
    )
    if looked == SearchStage.NONE:
        for i in range(3):
            first[i] = foot[i]
    if v[0] == 0.0 and v[1] == 0.0 and v[2] == 0.0:
        looked = max(looked, LOOKS)
    elif looked == SearchStage.NONE:
        c, s = math.cos(path[2]), math.sin(path[2])
        x = c * v[0] - s * v[1] - v[2] * (foot[1] - path[1])
        y = s * v[0] + c * v[1] + v[2] * (foot[0] - path[0])
        size = math.sqrt(x * x + y * y)
        x, y = (x / size, y / size) if size > 1e-9 else (c, s)
        for i in range(3):
            there[i] = foot[i]
        # As if it had looked behind before.
        there[0] -= FAR * x
        there[1] -= FAR * y
    while looked < LOOKS:
        looked += 1
        for i in range(2):
            there[i] = 2 * first[i] - there[i]
        if is_free(state, leg, there[0], there[1]):
            break
    else:
        tried = is_returning(state, leg)
        attempts = state.return_attempts[leg] + 1 if tried else 0
        if attempts >= ATTEMPTS or (tried and from_stood(state, leg) < THERE):
            return False
        stood, found = state.last_foothold[leg], False
        for k in range(3):
            # Another foot may have followed it there; then it goes as near as may be.
            share = k * CLOSE / max(from_stood(state, leg), CLOSE)
            for i in range(3):
                there[i] = stood[i] + share * (foot[i] - stood[i])
            found = found or is_free(state, leg, there[0], there[1])
            if found:
                break
        if not found:
            return False
        looked = 1 * SearchStage.RETURNING
        state.return_attempts[leg] = attempts
        state.clock.search_changes += 1 if tried else 0
    set_search(state, leg, looked)
    # Straight up, since the wall of the hole may be near.
    g = state.ground_filter[3]
    way = max(g[0] + g[1] * foot[0] + g[2] * foot[1] - foot[2], 0.0) + RISE
    stop_foot(state, leg)
    state.leg_phase[leg] = LegPhase.SWING
    state.manoeuvre[leg] = Manoeuvre.RISE
    state.touchdown[leg, 2] += way
    state.swing_elapsed[leg], state.swing_height[leg] = 0.0, 0.0
    state.swing_duration[leg] = max(1.875 * way / RISE_SPEED, RISE_TIME)
    return True
