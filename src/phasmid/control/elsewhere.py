"""Feet that find no ground where they come down look for it elsewhere."""

from __future__ import annotations

import math

from phasmid.compiled import internal
from phasmid.control.state import HELD, RISES, SWING, Order, State
from phasmid.control.swing import plant

FAR, LOOKS = 0.06, 2
"""How far from where it has found none a foot looks [m], ahead and then behind, and how often."""

RETURNS, AGAIN = LOOKS + 1, 0.25
"""What `State.search` is of a foot that then goes back to where it stood, and how much more at each
new attempt: the body, which comes back, too, may have been too far away at first."""

RETURNED, GAVE_UP, HERE = RETURNS + 1, RETURNS + 2, RETURNS + 3
"""What it is of a foot that stands there again, of one that has found no ground there either, and
of one that is to stand where it comes down, whatever it finds."""

THERE = 0.03
"""A foot nearer than this to where it stood is back [m]."""

CLOSE = 0.03
"""Distance of another foot at which it does not look [m]."""

RISE, RISE_SPEED, RISE_TIME = 0.01, 0.4, 0.1
"""How far above the ground a foot rises before it looks elsewhere [m], its largest speed on that
way [m/s], and the least time for it [s]."""


@internal
def is_looking(state: State, leg: int) -> bool:
    """Whether a foot in the air looks for ground elsewhere, or goes back to it."""
    return bool(0.0 < state.search[leg] < RETURNED)


@internal
def goes_back(state: State, leg: int) -> bool:
    """Whether a foot goes back to where it stood."""
    return bool(RETURNS <= state.search[leg] < RETURNED)


@internal
def from_stood(state: State, leg: int) -> float:
    """How far a foot is from where it last stood and felt the ground, from above [m]."""
    dx = state.foot[leg, 0] - state.sought[2, leg, 0]
    dy = state.foot[leg, 1] - state.sought[2, leg, 1]
    return math.sqrt(dx * dx + dy * dy)


@internal
def set_search(state: State, leg: int, how: float) -> None:
    """Note how a foot's search is, and that there is news of it."""
    if state.search[leg] != how:
        state.search[leg] = how
        state.clock.search_changes += 1


@internal
def end_search(state: State, leg: int, found: bool) -> None:
    """Note that a foot stands, whether it has found ground or not."""
    if found and goes_back(state, leg) and from_stood(state, leg) < THERE:
        set_search(state, leg, RETURNED)
    elif (found and state.search[leg] != RETURNED) or state.search[leg] == HERE:
        set_search(state, leg, 0.0)
    elif is_looking(state, leg):
        set_search(state, leg, GAVE_UP)


@internal
def is_free(state: State, leg: int, x: float, y: float) -> bool:
    """Whether no other foot stands or lands near a place in odom."""
    for other in range(state.leg_count):
        dx, dy = state.landing[other, 0] - x, state.landing[other, 1] - y
        if other != leg and state.leg[other] != HELD and dx * dx + dy * dy < CLOSE * CLOSE:
            return False
    return True


@internal
def looks_elsewhere(state: State, order: Order, leg: int) -> bool:
    """Let a foot that has come down to no ground rise out of the hole, to swing elsewhere.

    First it goes to a place along its own way with the body, then as far to the other side, then
    back to where it stood, but to none that is near another foot. Of a robot that is to stand still
    it goes back at once.

    Args:
        state: Where the engine is, changed.
        order: What is to be done.
        leg: The leg's index.

    Returns:
        Whether it does.
    """
    v, path, foot = order.velocity, state.path, state.foot[leg]
    there, first, looked = state.sought[0, leg], state.sought[1, leg], state.search[leg]
    if looked == 0.0:
        for i in range(3):
            first[i] = foot[i]
    if v[0] == 0.0 and v[1] == 0.0 and v[2] == 0.0:
        looked = max(looked, float(LOOKS))
    elif looked == 0.0:
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
        looked += 1.0
        for i in range(2):
            there[i] = 2 * first[i] - there[i]
        if is_free(state, leg, there[0], there[1]):
            break
    else:
        tried = goes_back(state, leg)
        looked = looked + AGAIN if tried else float(RETURNS)
        if looked >= RETURNED or (tried and from_stood(state, leg) < THERE):
            return False
        stood, found = state.sought[2, leg], False
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
    set_search(state, leg, looked)
    # Straight up, since the wall of the hole may be near.
    g = state.ground[3]
    way = max(g[0] + g[1] * foot[0] + g[2] * foot[1] - foot[2], 0.0) + RISE
    plant(state, leg)
    state.leg[leg] = SWING
    state.retreat[leg] = RISES
    state.landing[leg, 2] += way
    state.swing[leg, 0], state.swing[leg, 2] = 0.0, 0.0
    state.swing[leg, 1] = max(1.875 * way / RISE_SPEED, RISE_TIME)
    return True
