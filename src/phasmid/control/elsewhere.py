"""Feet that find no ground where they come down look for it elsewhere."""

from __future__ import annotations

import math
from typing import Any

from phasmid.compiled import internal
from phasmid.control.state import SWING
from phasmid.control.swing import plant

FAR, LOOKS = 0.06, 2
"""How far from where it has found none a foot looks [m], ahead and then behind, and how often."""

GAVE_UP, STAYS = LOOKS + 1, LOOKS + 2
"""What `State.search` is of a foot that has found no ground anywhere, and of one that is to stand
where it comes down, whatever it finds."""

RISE, RISE_SPEED, SHORTEST = 0.01, 0.4, 0.1
"""How far above the ground a foot rises before it looks elsewhere [m], its largest speed on that
way [m/s], and the least time for it [s]."""


@internal
def is_looking(state: Any, leg: int) -> bool:
    """Whether a foot is on its way to where it looks for ground."""
    return bool(0.0 < state.search[leg] <= LOOKS)


@internal
def set_search(state: Any, leg: int, what: float) -> None:
    """Note how a foot's search is, and that there is news of it."""
    if state.search[leg] != what:
        state.search[leg] = what
        state.mode[3] += 1


@internal
def look_elsewhere(state: Any, order: Any, leg: int) -> None:
    """Let a foot that has come down to no ground rise out of the hole, to swing elsewhere.

    First it goes to a place along its own way with the body, then as far to the other side.

    Args:
        state: Where the engine is, changed.
        order: What is to be done.
        leg: The leg's index.
    """
    foot, there, first = state.foot[leg], state.sought[0, leg], state.sought[1, leg]
    if state.search[leg] == 0.0:
        v, path = order.velocity, state.path
        if v[0] == 0.0 and v[1] == 0.0 and v[2] == 0.0:
            v = state.speed[2]
        c, s = math.cos(path[2]), math.sin(path[2])
        x = c * v[0] - s * v[1] - v[2] * (foot[1] - path[1])
        y = s * v[0] + c * v[1] + v[2] * (foot[0] - path[0])
        size = math.sqrt(x * x + y * y)
        x, y = (x / size, y / size) if size > 1e-9 else (c, s)
        for i in range(3):
            first[i] = there[i] = foot[i]
        there[0] += FAR * x
        there[1] += FAR * y
    else:
        for i in range(2):
            there[i] = 2 * first[i] - there[i]
    set_search(state, leg, state.search[leg] + 1.0)
    # Straight up, since the wall of the hole may be near.
    g = state.ground[3]
    way = max(g[0] + g[1] * foot[0] + g[2] * foot[1] - foot[2], 0.0) + RISE
    plant(state, leg)
    state.leg[leg] = SWING
    state.retreat[leg] = 1.0
    state.landing[leg, 2] += way
    state.swing[leg, 0], state.swing[leg, 2] = 0.0, 0.0
    state.swing[leg, 1] = max(1.875 * way / RISE_SPEED, SHORTEST)
